"""Guards over a recorded rollout: whether the arm did the task, or the asset did it for the arm."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from asset2sim.physics.arrays import Array
from schemas.learning_settings import GuardSettings
from schemas.overlay import JointPhysics


class Moment(NamedTuple):
    """A moment of a rollout, as ``Rollout`` has it of all."""

    position: float
    touched: bool
    tool_work_j: float
    height: float
    center: Array
    up: Array


@dataclass(frozen=True, eq=False)
class Rollout:
    """Recording of an episode, (n,) samples, the start first: ``positions`` of the part's joint, rad or m; whether the
    arm ``touched`` the part; ``tool_work_j``, its work on the object since the sample before; ``heights`` of the
    part's centre of mass, m; (n, 3) ``centers`` of the root link's mass, m, world, and ``ups``, the world's up axis in
    the root link's frame. Beside them the joint's limits as loaded, its target, how far its part's edge is from its
    axis (m; 1 of a slider), the time between samples, its spring (N·m/rad or N/m; rad or m), and whether it ``holds``:
    its friction bears its part, which never falls."""

    positions: Array
    touched: NDArray[np.bool_]
    tool_work_j: Array
    heights: Array
    centers: Array
    ups: Array
    lower: float
    upper: float
    target: float
    edge_m: float = 1.0
    sample_s: float = 0.004
    stiffness: float = 0.0
    spring_reference: float = 0.0
    holds: bool = False


def sample_of(
    data: mujoco.MjData, place: int, body: int, root: int, *, touched: bool = False, work_j: float = 0.0
) -> Moment:
    """The sample of this moment of a ``body`` whose joint has this ``place`` among positions, and of its ``root``."""
    center, up = data.xipos[root].copy(), data.xmat[root, 6:].copy()
    return Moment(float(data.qpos[place]), touched, work_j, float(data.subtree_com[body, 2]), center, up)


def rollout_of(
    samples: Sequence[Moment], joint: JointPhysics, ends: tuple[float, float], target: float, edge_m: float,
    sample_s: float = 0.004, *, holds: bool,
) -> Rollout:  # fmt: skip
    """The recording that these samples, of each of these seconds, are of a joint, led to a target between these ends,
    rad or m; the edge of its part is so far from its axis."""
    positions, touched, work, heights, centers, ups = (np.array(column) for column in zip(*samples, strict=True))
    spring = joint.stiffness, joint.spring_reference
    seen = positions, touched, work, heights, centers, ups
    return Rollout(*seen, *ends, target, edge_m, sample_s, *spring, holds=holds)


@dataclass(frozen=True)
class Guards:
    """Findings of the guards. Shares of the way to the target: ``drift_share`` was gone before anything touched the
    object, ``fallen_share`` untouched after that but downwards and no slower, as a lid falls that was pushed over,
    ``untouched_share`` all that was gone untouched but for the fall, ``struck_share`` for the first time and faster
    than a hand, touched or not, but for a fall; ``spring_share`` is the spring's share of the spring's and the arm's
    work. Of the object itself, at most in the episode: ``tilted_rad`` from how it stood, ``lifted_m`` and
    ``travelled_m`` of its root link. ``moved_untouched``, ``drifted``, ``struck``, ``spring_did_it`` and ``displaced``
    (tilted, lifted or travelled) are these over their bounds."""

    solved_at_start: bool
    untouched_share: float
    fallen_share: float
    drift_share: float
    struck_share: float
    spring_share: float
    tilted_rad: float
    lifted_m: float
    travelled_m: float
    moved_untouched: bool
    drifted: bool
    struck: bool
    spring_did_it: bool
    displaced: bool

    @property
    def degenerate(self) -> bool:
        """Whether any guard fired."""
        by_itself = self.solved_at_start or self.moved_untouched or self.drifted or self.spring_did_it
        return by_itself or self.struck or self.displaced

    def info(self) -> dict[str, float | bool]:
        """All of it by name, as an environment's ``info`` has it at the end of an episode."""
        return {**asdict(self), "degenerate": self.degenerate}


def solved_at_start(start: float, target: float, lower: float, upper: float, settings: GuardSettings) -> bool:
    """Whether a joint (rad or m) starts so near its target that nothing is left to learn, by its limits as loaded:
    limits that are too wide make it so."""
    return abs(start - target) <= settings.solved_share * (upper - lower)


def guard(rollout: Rollout, settings: GuardSettings) -> Guards:
    """Findings of the guards in a rollout. Motion is untouched where neither end of its sample was touched."""
    start, way = float(rollout.positions[0]), rollout.target - float(rollout.positions[0])
    forward = np.diff(rollout.positions) * np.sign(way)
    touched = rollout.touched
    free = ~(touched[1:] | touched[:-1])
    first = int(np.argmax(touched)) if touched.any() else len(touched)
    gone = max(float(forward.sum()), 0.0)
    whole, after = max(abs(way), gone, 1e-9), np.arange(len(free)) >= first
    steady = forward >= settings.steady_share * np.concatenate([[0.0], forward[:-1]])
    down, at_ease = np.diff(rollout.heights) < 0.0, steady & (not rollout.holds)
    falls = after & down & (at_ease | at_hand(touched, settings.away_samples)[1:])
    untouched, fallen, drift = (
        max(float(forward[which].sum()), 0.0) / whole for which in (free & ~falls, free & falls, free & ~after)
    )
    further = np.diff(
        np.maximum.accumulate(rollout.positions * np.sign(way))
    )  # what swings to and fro was there before
    fast = (further * rollout.edge_m > settings.struck_m_s * rollout.sample_s) & ~(down & at_ease)
    struck = float(further[fast].sum()) / whole
    end, rest = float(rollout.positions[-1]), rollout.spring_reference
    sprung = 0.5 * rollout.stiffness * ((start - rest) ** 2 - (end - rest) ** 2)
    worked = max(float(np.sum(rollout.tool_work_j)), 0.0)
    share = sprung / (sprung + worked) if sprung > settings.least_work_j and gone > 0.0 else 0.0
    displaced = displacement(rollout.centers[0], rollout.ups[0], rollout.centers, rollout.ups)
    tilted, lifted, travelled = (float(most) for most in displaced.max(axis=0))
    return Guards(
        solved_at_start(start, rollout.target, rollout.lower, rollout.upper, settings),
        untouched, fallen, drift, struck, share, tilted, lifted, travelled,
        moved_untouched=untouched > settings.untouched_share,
        drifted=drift > settings.drift_share,
        struck=struck > settings.struck_share,
        spring_did_it=share > settings.spring_share,
        displaced=bool(is_displaced(displaced, settings).any()),
    )  # fmt: skip


def at_hand(touched: NDArray[np.bool_], most: int) -> NDArray[np.bool_]:
    """(n,) whether a sample lies between touches at most so many samples apart: a pushed part hops ahead."""
    numbers = np.arange(len(touched))
    before = np.maximum.accumulate(np.where(touched, numbers, -len(touched)))
    after = np.minimum.accumulate(np.where(touched, numbers, 2 * len(touched))[::-1])[::-1]
    found: NDArray[np.bool_] = after - before <= most
    return found


def displacement(center: Array, up: Array, centers: Array, ups: Array) -> Array:
    """(n, 3) tilts, rad, lifts and travels along the floor, m, of the object itself: of its root link from ``center``
    and ``up``, (3,) or (n, 3), to ``centers`` and ``ups``, (n, 3), as in ``Rollout``."""
    shifts, tilts = centers - center, np.arccos(np.clip((ups * up).sum(axis=1), -1.0, 1.0))
    return np.stack([tilts, shifts[:, 2], np.hypot(shifts[:, 0], shifts[:, 1])], axis=1)


def is_displaced(displaced: Array, settings: GuardSettings) -> NDArray[np.bool_]:
    """(n,) whether an object so displaced, (n, 3) as from ``displacement``, was tipped, lifted or shoved."""
    bounds = settings.tilt_rad, settings.lift_m, settings.travel_m
    found: NDArray[np.bool_] = np.logical_or.reduce(displaced > bounds, axis=1)
    return found
