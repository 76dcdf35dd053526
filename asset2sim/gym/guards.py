"""Guards over a recorded rollout: whether the arm did the task, or the asset did it for the arm."""

from dataclasses import asdict, dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from schemas.learning_settings import GuardSettings


@dataclass(frozen=True, eq=False)
class Rollout:
    """What an episode recorded of the part: (n,) ``positions`` of its joint, rad or m, the start first; (n,) whether
    the arm ``touched`` the object, and (n,) ``tool_work_j``, its work on the object since the sample before. Beside
    them the joint's limits as loaded, its target, and its spring (N·m/rad or N/m; rad or m)."""

    positions: Array
    touched: Array
    tool_work_j: Array
    lower: float
    upper: float
    target: float
    stiffness: float = 0.0
    spring_reference: float = 0.0


@dataclass(frozen=True)
class Guards:
    """What was found. ``untouched_share`` and ``drift_share`` are shares of the way to the target: gone while nothing
    touched the object, and gone before anything did; ``spring_share`` is the spring's share of the spring's and the
    arm's work. ``moved_untouched``, ``drifted`` and ``spring_did_it`` are these shares over their bounds."""

    solved_at_start: bool
    untouched_share: float
    drift_share: float
    spring_share: float
    moved_untouched: bool
    drifted: bool
    spring_did_it: bool

    @property
    def degenerate(self) -> bool:
        """Whether any guard fired."""
        return self.solved_at_start or self.moved_untouched or self.drifted or self.spring_did_it

    def info(self) -> dict[str, float | bool]:
        """All of it by name, as an environment's ``info`` has it at the end of an episode."""
        return {**asdict(self), "degenerate": self.degenerate}


def solved_at_start(start: float, target: float, lower: float, upper: float, settings: GuardSettings) -> bool:
    """Whether a joint (rad or m) starts so near its target that nothing is left to learn, by its limits as loaded:
    limits that are too wide make it so."""
    return abs(start - target) <= settings.solved_share * (upper - lower)


def guard(rollout: Rollout, settings: GuardSettings) -> Guards:
    """What a rollout shows. A sample's motion is untouched where neither its end nor its start was touched."""
    start, way = float(rollout.positions[0]), rollout.target - float(rollout.positions[0])
    forward = np.diff(rollout.positions) * np.sign(way)
    touched = np.asarray(rollout.touched, dtype=bool)
    free = ~(touched[1:] | touched[:-1])
    first = int(np.argmax(touched)) if touched.any() else len(touched)
    gone = max(float(forward.sum()), 0.0)
    untouched = max(float(forward[free].sum()), 0.0) / max(abs(way), gone, 1e-9)
    drift = max(float(forward[: max(first - 1, 0)].sum()), 0.0) / max(abs(way), gone, 1e-9)
    end, rest = float(rollout.positions[-1]), rollout.spring_reference
    sprung = 0.5 * rollout.stiffness * ((start - rest) ** 2 - (end - rest) ** 2)
    worked = max(float(np.sum(rollout.tool_work_j)), 0.0)
    share = sprung / (sprung + worked) if sprung > settings.least_work_j and gone > 0.0 else 0.0
    return Guards(
        solved_at_start(start, rollout.target, rollout.lower, rollout.upper, settings),
        untouched, drift, share,
        moved_untouched=untouched > settings.untouched_share,
        drifted=drift > settings.drift_share,
        spring_did_it=share > settings.spring_share,
    )  # fmt: skip
