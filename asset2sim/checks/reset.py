"""The reset check: the object starts slightly off its pose, as in reinforcement learning."""

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.hold import hold_bound
from asset2sim.checks.mechanism import Mechanism, poses_at, pull_on, span_of
from asset2sim.checks.rig import Rig
from asset2sim.checks.set_down import Resting, angle_between, up_in_root
from asset2sim.checks.watch import Watched, capped_reading, harmless, watch
from asset2sim.engines.world import World
from asset2sim.physics.arrays import floats_of
from asset2sim.physics.kinematics import in_chains
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from asset2sim.physics.support_polygon import SupportPolygon
from schemas.base import Vector3
from schemas.interaction import Interaction, Reset
from schemas.overlay import JointPhysics
from schemas.settings import EngineSettings, Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode

TETRAHEDRON = ((1.0, 1.0, 1.0), (1.0, -1.0, -1.0), (-1.0, 1.0, -1.0), (-1.0, -1.0, 1.0))

CORNERS = tuple((sign * x, sign * y, sign * z) for x, y, z in TETRAHEDRON for sign in (1.0, -1.0))
"""Signs of a start's shift, each corner followed by its opposite; the tilt has those of the corner three places
further, so that the two differ."""
TILT_CORNER_SHIFT = 3
SIGNS = (1.0, -1.0)
STOP_SHARE = 1e-3
"""Share of its range from a limit within which a joint rests on that stop."""
LONGEST_S = 20.0
"""Longest time that is given to what still moves, s: a clock case of two metres rocks for fifteen, a floor lamp rolls
on the rim of its foot as long, a hose of four metres swings on."""
MANY_JOINTS = 50
"""Joints beyond which only half of the perturbed starts are run: a contact costs engines in proportion to the joints,
and a step on a keyboard of 115 takes 30 ms. So it is with chains, which have 8 and more."""


def measure(rig: Rig) -> dict[str, object]:
    """The perturbed starts, compared with how the object rests undisturbed; of a fixed object, its joints perturbed."""
    item, settings, limits = rig.item, rig.settings, rig.limits
    down = rig.down()
    resting, support = down.resting, down.support
    many = len(item.joints) > MANY_JOINTS or bool(in_chains(item.tree))
    if rig.fixed:
        shares = held_starts(settings)
        shares = shares[: len(shares) // 2] if many else shares
        return {"resets": tuple(held_reset(rig.held.sound(), item, share, settings, limits) for share in shares)}
    if support is None or not settings.resets:
        return {}
    # Every second corner of a box gives a tetrahedron: four starts that still tilt in every direction.
    chosen = perturbed_starts(settings)[:: 2 if many else 1]
    found = [reset_from(rig.free.sound(), item, *start, resting, support, settings, limits) for start in chosen]
    return {"resets": tuple(found), "tip_rise_m": support.rise, "support_m": support.furthest}


def perturbed_starts(settings: EngineSettings) -> list[tuple[Vector3, Vector3]]:
    """The perturbed starts as (shift, rotation vector), m and rad: every corner of the box of shifts, each with a
    corner of the box of tilts, then the same again half as far, and so on. Nothing is random."""
    found: list[tuple[Vector3, Vector3]] = []
    for index in range(settings.resets):
        share = 0.5 ** (index // len(CORNERS))
        shift = np.array(CORNERS[index % len(CORNERS)]) * share * settings.reset_m
        tilt = np.array(CORNERS[(index + TILT_CORNER_SHIFT) % len(CORNERS)]) * share * settings.reset_rad
        found.append((floats_of(shift), floats_of(tilt)))
    return found


def reset_from(
    world: World,
    item: Mechanism,
    shift: Vector3,
    tilt: Vector3,
    resting: Resting,
    support: SupportPolygon,
    settings: EngineSettings,
    limits: Thresholds,
) -> Reset:
    """Start from one perturbed pose on the plane, free, and watch until it is still, at most ``LONGEST_S``. A shift
    downwards starts it in contact, never inside the plane. Its end is compared with ``resting``."""
    height = settings.drop_height_m + max(0.0, shift[2])
    world.place(item.start, height_m=height, shift_m=(shift[0], shift[1]), tilt_rad=tilt)
    seen = until_slow(world, item, LONGEST_S, settings, limits)
    turned, motion, joint = math.pi, 1.0, None
    if seen.finite:
        turned = angle_between(resting.up, up_in_root(world))
        motion, joint = moved_share(item, world, resting.joints, limits)
    return Reset(
        offset_m=shift,
        tilt_rad=tilt,
        peak_speed_m_s=seen.peak,
        final_speed_m_s=seen.final,
        turned_rad=turned,
        joint_motion=capped_reading(motion),
        joint=joint,
        slip_given=capped_reading(slip_given(item, joint, shift, tilt, support)) if joint is not None else 0.0,
        finite=seen.finite,
    )


def until_slow(world: World, item: Mechanism, longest: float, settings: EngineSettings, limits: Thresholds) -> Watched:
    """The run until nothing moves, at most ``fall_s``, and up to ``longest`` (s) while a link is too fast."""
    seen = watch(world, settings.fall_s, settings, calm=harmless(world, item, settings, limits))
    while (left := longest - seen.seconds) > 0.0 and seen.finite and seen.final > limits.final_speed_m_s:
        # The end of a chain swings by turns that count as still in each of its joints.
        later = watch(world, left, settings)
        peaks, seconds = np.maximum(seen.peaks, later.peaks), seen.seconds + later.seconds
        seen = replace(later, seconds=seconds, peaks=peaks)
    return seen


def held_starts(settings: EngineSettings) -> list[float]:
    """The perturbed starts of an object whose root is held: by how much its joints are moved, as a share of each range;
    both ways, then the same again half as far, and so on."""
    count = settings.resets // 2
    return [SIGNS[index % 2] * settings.reset_share * 0.5 ** (index // 2) for index in range(count)]


def held_start(item: Mechanism, share: float) -> dict[str, float]:
    """Joint → where a perturbed start puts it, rad or m: every joint moved by ``share`` of its range, every second one
    the other way, within its limits; those of a chain share the way of one, so that its end moves no further."""
    start, chained = dict(item.start), in_chains(item.tree)
    for place, joint in enumerate(item.joints):
        lower, upper = span_of(joint)
        shared = share / len(chained) if joint.name in chained else share
        moved = start[joint.name] + shared * (1.0 if place % 2 == 0 else -1.0) * (upper - lower)
        start[joint.name] = moved if joint.lower is None else min(max(moved, lower), upper)
    return start


def held_reset(world: World, item: Mechanism, share: float, settings: EngineSettings, limits: Thresholds) -> Reset:
    """Start as ``held_start`` has it, the root held, and watch until it is still, at most ``fall_s``, or as long as a
    chain swings. A joint that must hold may stay where it starts or go back to where the object begins, no further: not
    to where it would fall undisturbed."""
    start = held_start(item, share)
    world.place(start)
    longest = LONGEST_S if in_chains(item.tree) else settings.fall_s
    seen = until_slow(world, item, longest, settings, limits)
    motion, name = moved_share(item, world, item.start, limits, start) if seen.finite else (1.0, None)
    return Reset(
        offset_m=(0.0, 0.0, 0.0),
        tilt_rad=(0.0, 0.0, 0.0),
        peak_speed_m_s=seen.peak,
        final_speed_m_s=seen.final,
        turned_rad=0.0,
        joint_motion=capped_reading(motion),
        joint=name,
        joint_share=abs(share),
        finite=seen.finite,
    )


def moved_share(
    item: Mechanism,
    world: World,
    rest: Mapping[str, float],
    limits: Thresholds,
    start: Mapping[str, float] = MappingProxyType({}),
) -> tuple[float, str | None]:
    """Largest distance of a joint that must hold from its ``rest`` (rad or m), as a share of its range, and that joint;
    or from the way between that rest and its ``start``, where it was moved by hand.

    Motion within the bound of the hold check counts as none: a third of a degree is much of a stapler's range of five.
    """
    now = dict(zip(world.joint_names, world.positions(), strict=True))
    furthest: tuple[float, str | None] = (0.0, None)
    for joint in item.joints:
        lower, upper = span_of(joint)
        if not joint.holds or upper <= lower:
            continue
        ends = sorted((rest[joint.name], start.get(joint.name, rest[joint.name])))
        moved = max(ends[0] - float(now[joint.name]), float(now[joint.name]) - ends[1], 0.0)
        if moved > hold_bound(joint, limits) and moved / (upper - lower) > furthest[0]:
            furthest = moved / (upper - lower), joint.name
    return furthest


def slip_given(item: Mechanism, joint: str, shift: Vector3, tilt: Vector3, support: SupportPolygon) -> float:
    """How far, as a share of its range, a joint slips while its friction brakes the fall of its part from one start.

    The part's m g h, h being the start's height and its tilt over the part's distance from the far edge of the support,
    is braked by what friction has over gravity's and the spring's pull; by both together where that pull presses the
    joint on its stop. Infinite where friction has nothing over it.
    """
    held = next(entry for entry in item.joints if entry.name == joint)
    poses, (lower, upper) = poses_at(item, item.start), span_of(held)
    mass = sum(item.bodies[link].mass for link in item.moved[joint])
    moment = sum(
        item.bodies[n].mass * (poses[n][:3, :3] @ item.bodies[n].com + poses[n][:3, 3]) for n in item.moved[joint]
    )
    arm = np.asarray(moment) / max(mass, 1e-12) - support.center
    level = float(np.linalg.norm(arm - (arm @ support.up) * support.up))
    rise = max(0.0, shift[2]) + math.dist(tilt, (0.0, 0.0, 0.0)) * (support.furthest + level)
    at = held.initial_position
    load = float(pull_on(item, joint, item.start, poses).at(at)) + held.exerted(at)
    stop = held.upper if load > 0.0 else held.lower
    on_stop = stop is not None and abs(at - stop) <= STOP_SHARE * (upper - lower)
    reserve = held.friction + (abs(load) if on_stop else -abs(load))
    return mass * GRAVITY_M_S2 * rise / reserve / (upper - lower) if reserve > 0.0 else math.inf


def judge(seen: Interaction, joints: Mapping[str, JointPhysics], limits: Thresholds) -> list[CheckVerdict]:
    """One verdict a start."""
    return [reset_verdict(item, index, seen, limits) for index, item in enumerate(seen.resets)]


def reset_verdict(item: Reset, index: int, interaction: Interaction, limits: Thresholds) -> CheckVerdict:
    """A perturbed start must end at rest, upright, with the joints that must hold where they were.

    An object that stands so narrow that the start has the energy to topple it may topple, as the real one would, and a
    joint that a hand can move may slip where its friction cannot brake the fall, no further than the energy of the fall
    takes it: then it must only come to rest.
    """
    engine, subject = interaction.engine.value, f"start {index + 1}"
    shift = ", ".join(f"{1e3 * v:.3g}" for v in item.offset_m)
    tilt = ", ".join(f"{v:.3g}" for v in item.tilt_rad)
    began = f"{subject} in {engine}, shifted by ({shift}) mm and turned by ({tilt}) rad"
    if item.joint_share > 0.0:
        began = f"{subject} in {engine}, every joint moved by {item.joint_share:.3g} of its range"
    held = "a joint" if item.joint is None else f"joint '{item.joint}'"
    checks: tuple[tuple[float, float, str], ...] = (
        (item.peak_speed_m_s, limits.peak_speed_m_s, "a link reaches {:.3g} m/s"),
        (item.final_speed_m_s, limits.final_speed_m_s, "a link still moves at {:.3g} m/s at the end"),
        (item.turned_rad, limits.reset_turn_rad, "it ends {:.3g} rad from where it rests undisturbed"),
        (item.joint_motion, limits.reset_joint_share, held + ", which must hold, moves over {:.3g} of its range"),
    )
    # The largest rise of the centre of mass that the start gives, m: its height, and its tilt.
    given = max(0.0, item.offset_m[2]) + math.dist(item.tilt_rad, (0.0, 0.0, 0.0)) * interaction.support_m
    topples = item.turned_rad > limits.reset_turn_rad
    if topples and interaction.tip_rise_m is not None and interaction.tip_rise_m <= given:
        why = f"it topples, which a rise of {1e3 * interaction.tip_rise_m:.3g} mm does and this start gives"
        checks = (*checks[:2], (item.turned_rad, math.pi, f"{{:.3g}} rad: {why} {1e3 * given:.3g} mm"))
    slips, most = "", limits.reset_slip_margin * item.slip_given
    if limits.reset_joint_share < min(item.joint_motion, item.slip_given) and item.joint_motion <= most:
        slips = f"; {held} slips over {item.joint_motion:.3g} of its range: its friction cannot brake this fall"
        checks = checks[:3]
    for value, limit, text in checks:
        if value > limit or not item.finite:
            return CheckVerdict(FailureMode.RESET, subject, False, value, limit, f"{began}: {text.format(value)}")
    value, limit, text = checks[2]
    return CheckVerdict(
        FailureMode.RESET, subject, True, value, limit, f"{began}: {text.format(value)}, at rest{slips}"
    )


CHECK = DeclaredCheck(
    name="reset",
    modes={
        FailureMode.RESET: Guide(
            "Started 2 cm and 2° off, it does not come to rest upright, or a held joint slips",
            "see `interactions` for the start that fails; a tall or narrow foot is in its shape",
        )
    },
    done="eight starts off by ±2 cm and ±2°",
    holds="at rest within 20 s, upright unless the start has the energy to topple it, held joints within a tenth of "
    "their range unless their friction cannot brake the fall, whose energy then bounds how far they slip",
    bounds=("reset_turn_rad", "reset_joint_share", "reset_slip_margin", "peak_speed_m_s", "final_speed_m_s"),
    measure=measure,
    judge=judge,
    place=80,
    turn=40,
    on_plane=True,
    along=(FailureMode.STANDS, FailureMode.STATE),
    planted=("spring without damping",),
)
