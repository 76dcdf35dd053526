"""Guards over a recorded rollout: whether the arm did the task, or the asset did it for the arm."""

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from asset2sim.physics.arrays import Array
from schemas.learning_settings import GuardSettings


@dataclass(frozen=True, eq=False)
class Rollout:
    """Recording of an episode, (n,) samples, the start first: ``positions`` of the part's joint, rad or m; whether the
    arm ``touched`` the part; ``tool_work_j``, its work on the object since the sample before; ``heights`` of the
    part's centre of mass, m; (n, 3) ``centers`` of the root link's mass, m, world, and ``ups``, the world's up axis in
    the root link's frame. Beside them the joint's limits as loaded, its target, and its spring (N·m/rad or N/m; rad
    or m)."""

    positions: Array
    touched: NDArray[np.bool_]
    tool_work_j: Array
    heights: Array
    centers: Array
    ups: Array
    lower: float
    upper: float
    target: float
    stiffness: float = 0.0
    spring_reference: float = 0.0


@dataclass(frozen=True)
class Guards:
    """Findings of the guards. Shares of the way to the target: ``drift_share`` was gone before anything touched the
    object, ``fallen_share`` untouched after that but downwards, as a lid falls that was pushed over,
    ``untouched_share`` all that was gone untouched but for the fall; ``spring_share`` is the spring's share of the
    spring's and the arm's work. Of the object itself, at most in the episode: ``tilted_rad`` from how it stood,
    ``lifted_m`` and ``travelled_m`` of its root link. ``moved_untouched``, ``drifted``, ``spring_did_it`` and
    ``displaced`` (tilted, lifted or travelled) are these over their bounds."""

    solved_at_start: bool
    untouched_share: float
    fallen_share: float
    drift_share: float
    spring_share: float
    tilted_rad: float
    lifted_m: float
    travelled_m: float
    moved_untouched: bool
    drifted: bool
    spring_did_it: bool
    displaced: bool

    @property
    def degenerate(self) -> bool:
        """Whether any guard fired."""
        return self.solved_at_start or self.moved_untouched or self.drifted or self.spring_did_it or self.displaced

    def info(self) -> dict[str, float | bool]:
        """All of it by name, as an environment's ``info`` has it at the end of an episode."""
        return {**asdict(self), "degenerate": self.degenerate}


def solved_at_start(start: float, target: float, lower: float, upper: float, settings: GuardSettings) -> bool:
    """Whether a joint (rad or m) starts so near its target that nothing is left to learn, by its limits as loaded:
    limits that are too wide make it so."""
    return abs(start - target) <= settings.solved_share * (upper - lower)


def guard(rollout: Rollout, settings: GuardSettings) -> Guards:
    """Findings of the guards in a rollout. A sample's motion is untouched where neither its end nor its start was
    touched."""
    start, way = float(rollout.positions[0]), rollout.target - float(rollout.positions[0])
    forward = np.diff(rollout.positions) * np.sign(way)
    touched = rollout.touched
    free = ~(touched[1:] | touched[:-1])
    first = int(np.argmax(touched)) if touched.any() else len(touched)
    gone = max(float(forward.sum()), 0.0)
    whole, after = max(abs(way), gone, 1e-9), np.arange(len(free)) >= first
    falls = after & (np.diff(rollout.heights) < 0.0)
    untouched, fallen, drift = (
        max(float(forward[which].sum()), 0.0) / whole for which in (free & ~falls, free & falls, free & ~after)
    )
    end, rest = float(rollout.positions[-1]), rollout.spring_reference
    sprung = 0.5 * rollout.stiffness * ((start - rest) ** 2 - (end - rest) ** 2)
    worked = max(float(np.sum(rollout.tool_work_j)), 0.0)
    share = sprung / (sprung + worked) if sprung > settings.least_work_j and gone > 0.0 else 0.0
    tilted = float(np.arccos(np.clip(rollout.ups @ rollout.ups[0], -1.0, 1.0).min()))
    shifts = rollout.centers - rollout.centers[0]
    lifted, travelled = float(shifts[:, 2].max()), float(np.hypot(shifts[:, 0], shifts[:, 1]).max())
    return Guards(
        solved_at_start(start, rollout.target, rollout.lower, rollout.upper, settings),
        untouched, fallen, drift, share, tilted, lifted, travelled,
        moved_untouched=untouched > settings.untouched_share,
        drifted=drift > settings.drift_share,
        spring_did_it=share > settings.spring_share,
        displaced=tilted > settings.tilt_rad or lifted > settings.lift_m or travelled > settings.travel_m,
    )  # fmt: skip
