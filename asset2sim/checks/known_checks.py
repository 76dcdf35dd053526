"""The checks that are declared, in the order of their verdicts, and what is gathered over them."""

import functools
from collections.abc import Mapping

from asset2sim.checks.declared_check import DeclaredCheck
from schemas.declared import CHECK, declared
from schemas.errors import UnknownChoiceError
from schemas.interaction import Interaction
from schemas.overlay import PhysicsOverlay
from schemas.thresholds import Bound, Thresholds
from schemas.verdict import FAILURE_GUIDE, CheckVerdict, Guide
from schemas.vocabulary import FailureMode


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
