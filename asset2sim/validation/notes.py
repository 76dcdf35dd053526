"""Findings gathered while validating."""

from dataclasses import dataclass, field

from schemas.finding import Finding
from schemas.vocabulary import Severity, Stage


@dataclass
class Notes:
    """The findings of one validation, in the order in which they were made."""

    findings: list[Finding] = field(default_factory=list)

    def info(self, code: str, message: str, **where: object) -> None:
        """Add a finding: a value was completed; no value of the model was changed."""
        self._add(Severity.INFO, code, message, where)

    def warn(self, code: str, message: str, **where: object) -> None:
        """Add a warning: a value of the model or the asset is implausible, or was changed."""
        self._add(Severity.WARNING, code, message, where)

    def _add(self, severity: Severity, code: str, message: str, where: dict[str, object]) -> None:
        finding = {"stage": Stage.VALIDATE, "severity": severity, "code": code, "message": message, **where}
        self.findings.append(Finding.model_validate(finding))
