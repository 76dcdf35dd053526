"""Declaration of a check and of what may mend it, in the module that measures it: ``CHECK``.

Everything that is to be known of a check goes over these: the run in each engine, verdicts, tables, the report, what
is mended, the documentation and the bench of planted defects.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from schemas.base import Vector3
from schemas.features import Features
from schemas.interaction import Interaction
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import Settings
from schemas.thresholds import Bound, Thresholds
from schemas.verdict import CheckVerdict, Guide
from schemas.vocabulary import FailureMode

if TYPE_CHECKING:  # worlds take a second to import, and who reads a verdict needs none
    from asset2sim.checks.rig import Rig


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


Measure = Callable[["Rig"], Mapping[str, object]]
"""Measures an object; the records, by field of ``Interaction``. Those of a check from outside the package stand in
``Interaction.further`` instead: sequences of frozen records, by a name of its own."""
Judge = Callable[[Interaction, Mapping[str, JointPhysics], Thresholds], Iterable[CheckVerdict]]
"""The verdicts on what was recorded, of the joints by name and within the thresholds; pure."""


@dataclass(frozen=True)
class DeclaredCheck:
    """One check: what it does, what it can fail as, and how it is measured and judged."""

    name: str
    """Its name in the documentation and in tables of figures."""
    modes: Mapping[FailureMode, Guide]
    """What it fails as → what that means, and what people do about it."""
    done: str
    """What is done with the object, for the documentation."""
    holds: str
    """What must then hold."""
    bounds: tuple[str | Bound, ...]
    """Fields of ``Thresholds`` that decide, or bounds of its own."""
    measure: Measure | None
    """None for the paper's check at rest, which is measured where interaction is not, too."""
    judge: Judge | None
    place: int = 100
    """Where its verdicts stand among those of other checks; the first that fails names the object's failure."""
    turn: int = 100
    """When it is run: contact caches make numbers depend slightly on earlier poses in the same world."""
    on_plane: bool = False
    """Whether it puts the object down and lets it be, before the plane's world is closed."""
    along: tuple[FailureMode, ...] = ()
    """Checks, by failure mode, whose records it needs: run with it where it is run alone."""
    remedies: tuple[Remedy, ...] = ()
    """What may mend it, least intrusive first; of the checks in here, ``refinement.dynamics.remedies`` says so."""
    planted: tuple[str, ...] = ()
    """Defects of the bench that show it."""
