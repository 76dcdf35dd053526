"""Case and type of a remedy: a pure function from an overlay to a changed one."""

from collections.abc import Callable
from dataclasses import dataclass

from schemas.base import Vector3
from schemas.features import Features
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import Settings


@dataclass(frozen=True)
class Case:
    """Inputs of a remedy: the asset, the settings, the joints that the failing check concerns (empty: all)."""

    features: Features
    settings: Settings
    joints: tuple[str, ...]
    rest_turn_rad: Vector3 = (0.0, 0.0, 0.0)
    """How the object turned until it rested in the engine of the failing check."""

    def about(self, joint: JointPhysics) -> bool:
        """Whether the failing check concerns this joint."""
        return not self.joints or joint.name in self.joints


Change = Callable[[Case, PhysicsOverlay], PhysicsOverlay | None]


@dataclass(frozen=True)
class Remedy:
    """One way to change an overlay, and its name in the trace."""

    name: str
    change: Change
