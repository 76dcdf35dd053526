"""Findings, what a stage noticed or changed, as rows, and steps of a search."""

from dataclasses import dataclass, field

from schemas.base import Frozen
from schemas.vocabulary import Severity, Stage


class Finding(Frozen):
    """One thing that one stage noticed or changed, and what to do about it. ``value`` and ``limit`` hold the number
    found and the bound it met, in the unit that the message names."""

    stage: Stage
    severity: Severity
    code: str
    message: str
    link: str | None = None
    joint: str | None = None
    value: float | None = None
    limit: float | None = None


def remark(stage: Stage, code: str, message: str, **where: object) -> Finding:
    """A finding of severity ``info``; ``where``: link, joint, value, limit."""
    return Finding.model_validate(where | {"stage": stage, "severity": Severity.INFO, "code": code, "message": message})


def warning(stage: Stage, code: str, message: str, **where: object) -> Finding:
    """A finding of severity ``warning``; ``where``: link, joint, value, limit."""
    return remark(stage, code, message, **where).model_copy(update={"severity": Severity.WARNING})


@dataclass
class Notes:
    """The findings of one validation, in the order in which they were made."""

    findings: list[Finding] = field(default_factory=list)

    def info(self, code: str, message: str, **where: object) -> None:
        """Add a finding: a value was completed; no value of the model was changed."""
        self.findings.append(remark(Stage.VALIDATE, code, message, **where))

    def warn(self, code: str, message: str, **where: object) -> None:
        """Add a warning: a value of the model or the asset is implausible, or was changed."""
        self.findings.append(warning(Stage.VALIDATE, code, message, **where))


class TraceStep(Frozen):
    """One proposal and its result in the simulator. Φ in metres; ``moved`` maps joint → new position (rad or m).

    ``proposer``: ``request`` (a search begins at the requested state), ``line``, ``perturbation`` and ``grid`` (the
    search), ``return`` (a mended pose goes back towards the requested one while Φ stays as low as wanted),
    ``authored`` (a joint without a request starts at its zero), ``model``, ``shape`` (hulls cut or decomposed),
    ``range`` (hulls cut, or limits shortened, so that joints can move), ``mend`` (terms changed because a test failed:
    ``test`` names engine, test and subject, ``value_before`` and ``value_after`` what it measured).
    """

    step: int
    proposer: str
    phi_before_m: float
    phi_after_m: float
    moved: dict[str, float]
    accepted: bool
    evaluations: int
    reason: str
    test: str | None = None
    value_before: float | None = None
    value_after: float | None = None
