"""Declaration of a check and of what may mend it, in the module that measures it: ``CHECK``; and the known checks.

Everything that is to be known of a check goes over these: the run in each engine, verdicts, tables, the report, what
is mended, the documentation and the bench of planted defects.
"""

import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from schemas.base import Vector3
from schemas.declared import CHECK, declared
from schemas.errors import UnknownChoiceError
from schemas.features import Features
from schemas.interaction import Interaction
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import Settings
from schemas.thresholds import Bound, Thresholds
from schemas.verdict import FAILURE_GUIDE, CheckVerdict, Guide
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


@functools.cache
def known_checks() -> tuple[DeclaredCheck, ...]:
    """Every check that a module of this package, or one from outside, declares as ``CHECK``."""
    found = [check for check in declared(CHECK) if isinstance(check, DeclaredCheck)]
    return tuple(sorted(found, key=lambda check: check.place))


def check_of(mode: FailureMode) -> DeclaredCheck | None:
    """The check that fails as ``mode``; None where no check does."""
    return next((check for check in known_checks() if mode in check.modes), None)


def run_for(only: FailureMode | None) -> list[DeclaredCheck]:
    """The checks to be run, in their turns: all, or the one that shows a failure and those that it needs."""
    wanted = set() if only is None else {only}
    chosen = check_of(only) if only is not None else None
    if chosen is not None:
        wanted |= set(chosen.along)
    checks = [check for check in known_checks() if only is None or wanted & set(check.modes)]
    return sorted(checks, key=lambda check: check.turn)


def interaction_verdicts(seen: Interaction, overlay: PhysicsOverlay, limits: Thresholds) -> tuple[CheckVerdict, ...]:
    """One verdict per check and subject, in the checks' order."""
    joints = {joint.name: joint for joint in overlay.joints}
    return tuple(
        verdict for check in known_checks() if check.judge is not None for verdict in check.judge(seen, joints, limits)
    )


def failure_guide() -> Mapping[FailureMode, Guide]:
    """Every failure mode but ``none`` → its cause and remedy."""
    shown = {mode: guide for check in known_checks() for mode, guide in check.modes.items()}
    return {mode: guide for mode in FailureMode if (guide := shown.get(mode) or FAILURE_GUIDE.get(mode)) is not None}


def require_bounds(limits: Thresholds) -> None:
    """Raise UsageError where ``thresholds.further`` states a bound that no check declares."""
    own = [bound.name for check in known_checks() for bound in check.bounds if isinstance(bound, Bound)]
    for name in limits.further:
        if name not in own:
            raise UnknownChoiceError("bound of a further check", name, own)
