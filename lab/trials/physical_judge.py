"""The physical judge: what is wrong with a recorded interaction, from the recording alone and without a model."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asset2sim.gym.arm.planning import SETTLE_S
from asset2sim.physics.arrays import Array
from lab.schemas.settings import TrialSettings
from lab.trials.record import Track

PICTURE_S = 1.0 / 15.0
"""The time over which energy is balanced: contacts give back in one step what they took in another."""
STORED_S = 0.5
"""For how long a contact may keep what it took: a lid pressed onto its stop springs back."""
GRAVITY = 9.81
FULL, FLOOR = 5.0, 0.0


class Fault(NamedTuple):
    """A fault: its heading in tables, what it is in words, with its number, and what it takes from a score of 5."""

    heading: str
    words: str
    penalty: float


FAULTS = {
    "moved_before_contact": Fault(
        "moved before contact", "it moved {moved_rad:.2g} rad or {moved_m:.2g} m before it was touched", 1.5
    ),
    "energy_appeared": Fault("energy appeared", "energy appeared, enough to lift it by {appeared_m:.2g} m", 1.5),
    "jumped": Fault("jumped", "an impulse that no touch explains, worth {impulse_m_s:.2g} m/s", 1.0),
    "overlapped": Fault("tool in it", "the tool was {overlap_m:.2g} m deep in it", 1.0),
    "rang": Fault("rang", "it swung to and fro {ringing_turns} times after it was let go", 1.0),
    "forced": Fault("pressed too hard", "the tool pressed on it with {force_n:.0f} N", 1.0),
    "tipped": Fault("tipped", "it was tipped by {tilted_rad:.2g} rad", 1.5),
}
"""The faults that the judge finds, by their columns. A task that is not done takes ``NOT_DONE``; what is never touched
scores 1 at most, and what explodes 0, as the paper's examples of judges have it."""
NOT_DONE, NOT_TOUCHED = 2.0, 1.0


@dataclass(frozen=True)
class JudgedTrial:
    """The physical judge's numbers and which of them are faults; fields as the columns of the table of trials."""

    first_contact_s: float | None
    moved_rad: float
    moved_m: float
    appeared_j: float
    appeared_m: float
    impulse_m_s: float
    overlap_m: float
    ringing_turns: int
    force_n: float
    work_j: float
    tilted_rad: float
    moved_before_contact: bool
    energy_appeared: bool
    jumped: bool
    overlapped: bool
    rang: bool
    forced: bool
    tipped: bool


def judge(
    track: Track, mass_kg: float, sliders: Collection[str], free: Collection[str], settings: TrialSettings,
    *, carried: bool = False,
) -> JudgedTrial:  # fmt: skip
    """Measure a recording. ``sliders`` are the joints whose positions are in m, ``free`` those that hold no position:
    what they do in the first ``SETTLE_S`` is their coming to rest, as the paper lets objects settle. What is to be
    ``carried`` may be tilted."""
    touched = np.flatnonzero(track.touched)
    before = int(touched[0]) if len(touched) else len(track.times_s) - 1
    turned, shifted = moved(track, before, sliders, free)
    pictures = np.floor(track.times_s / PICTURE_S).astype(int)
    given = unexplained(np.bincount(pictures, weights=track.given_j).astype(float))
    appeared, most = float(given.sum()), float(given.max(initial=0.0))
    height, speed = appeared / (mass_kg * GRAVITY), float(np.sqrt(2.0 * most / mass_kg))
    depth = float(track.depth_m.max(initial=0.0))
    after = int(touched[-1]) + 1 if len(touched) else len(track.times_s)
    turns = max((turns_of(track, index, after, sliders, settings) for index in range(len(track.joints))), default=0)
    tilted, force = max(angle(track.poses[0, 0, :3, :3], pose[:3, :3]) for pose in track.poses[:, 0]), track.force_n
    return JudgedTrial(
        first_contact_s=float(track.times_s[before]) if len(touched) else None,
        moved_rad=turned,
        moved_m=shifted,
        appeared_j=appeared,
        appeared_m=height,
        impulse_m_s=speed,
        overlap_m=depth,
        ringing_turns=turns,
        force_n=float(force.max(initial=0.0)),
        work_j=float(track.work_j.sum()),
        tilted_rad=tilted,
        moved_before_contact=turned > settings.moved_rad or shifted > settings.moved_m,
        energy_appeared=height > settings.appeared_m,
        jumped=speed > settings.impulse_m_s,
        overlapped=depth > settings.overlap_m,
        rang=turns >= settings.ringing_turns,
        forced=float(force.max(initial=0.0)) > settings.force_n,
        tipped=tilted > settings.tilt_rad and not carried,
    )


def score(judged: JudgedTrial, done: bool, finite: bool) -> float:
    """0 to 5: 5 less the penalties of ``FAULTS``, and ``NOT_DONE`` where the task is not done; see there."""
    if not finite:
        return FLOOR
    penalty = sum(fault.penalty for name, fault in FAULTS.items() if getattr(judged, name))
    found = FULL - penalty - (0.0 if done else NOT_DONE)
    most = FULL if judged.first_contact_s is not None else NOT_TOUCHED
    return max(FLOOR, min(most, found))


def unexplained(given: Array) -> Array:
    """(n,) of the energy that contacts and stops gave in each picture, J, what they had not taken shortly before: they
    give like springs, and forget what they took with a time constant of ``STORED_S``."""
    found, stored = np.zeros(len(given)), 0.0
    for index, energy in enumerate(given):
        stored = stored * np.exp(-PICTURE_S / STORED_S) - energy
        found[index], stored = max(0.0, -stored), max(0.0, stored)
    return found


def moved(track: Track, before: int, sliders: Collection[str], free: Collection[str]) -> tuple[float, float]:
    """How far anything turned (rad) and shifted (m) in the samples up to ``before``."""
    turned, shifted = 0.0, 0.0
    for pose in track.poses[: before + 1, 0] if len(track.links) else ():
        turned = max(turned, angle(track.poses[0, 0, :3, :3], pose[:3, :3]))
        shifted = max(shifted, float(np.linalg.norm(pose[:3, 3] - track.poses[0, 0, :3, 3])))
    settled = int(np.searchsorted(track.times_s, SETTLE_S))
    for index, name in enumerate(track.joints):
        first = settled if name in free else 0
        part = track.positions[first : before + 1, index]
        most = float(np.abs(part - part[0]).max()) if len(part) else 0.0
        turned, shifted = (turned, max(shifted, most)) if name in sliders else (max(turned, most), shifted)
    return turned, shifted


def turns_of(track: Track, index: int, after: int, sliders: Collection[str], settings: TrialSettings) -> int:
    """How often a joint changes direction from the sample ``after`` on, swings smaller than the amplitude left out."""
    least = settings.ringing_m if track.joints[index] in sliders else settings.ringing_rad
    path: Array = track.positions[after:, index]
    if not len(path):
        return 0
    turns, heading, extreme = 0, 0, float(path[0])
    for position in path:
        if heading == 0 and abs(position - path[0]) > least:
            heading, extreme = (1 if position > path[0] else -1), float(position)
        elif heading and (position - extreme) * heading > 0.0:
            extreme = float(position)
        elif heading and abs(position - extreme) > least:
            turns, heading, extreme = turns + 1, -heading, float(position)
    return turns


def angle(first: Array, second: Array) -> float:
    """Angle between two (3, 3) rotations, rad."""
    return float(np.arccos(np.clip((np.trace(first.T @ second) - 1.0) / 2.0, -1.0, 1.0)))
