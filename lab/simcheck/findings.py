"""Reads an independent checker's JSON reports on refined objects, counts them and groups them by cause. Pure."""

import json
from collections.abc import Sequence

from schemas.base import Frozen, NonNegative
from schemas.vocabulary import Severity

EXAMPLES = 5
"""Objects named with each cause."""


class SimcheckFinding(Frozen):
    """One error or warning of the checker; ``engine`` is empty for checks of files alone."""

    severity: Severity
    check: str
    engine: str
    target: str
    message: str


class ObjectReport(Frozen):
    """Result for one object. ``problem`` says why it was not checked, or not in full; it has then not passed."""

    asset_id: str
    seconds: NonNegative
    complaints: tuple[SimcheckFinding, ...] = ()
    problem: str = ""

    @property
    def without_error(self) -> bool:
        """Whether it was checked in full and no error was found."""
        return not self.problem and all(item.severity is not Severity.ERROR for item in self.complaints)

    @property
    def without_warning(self) -> bool:
        """Whether it was checked in full and neither error nor warning was found."""
        return not self.problem and not self.complaints


class Cause(Frozen):
    """One check in one engine at one severity, over all objects."""

    severity: Severity
    check: str
    engine: str
    objects: int
    findings: int
    examples: tuple[str, ...]
    message: str
    """The first finding's message."""


class SimcheckSummary(Frozen):
    """Result for all objects."""

    objects: int
    without_error: int
    without_warning: int
    unfinished: tuple[str, ...]
    causes: tuple[Cause, ...]
    seconds: NonNegative

    @property
    def passed(self) -> bool:
        """Whether every object was checked in full, and none has an error."""
        return self.without_error == self.objects


def read_report(asset_id: str, text: str, seconds: float) -> ObjectReport:
    """The report from the checker's JSON of one object; ``problem`` if an engine's checks were not completed."""
    try:
        found = json.loads(text)
        report = found[0] if isinstance(found, list) else found
        results = [(result, finding) for result in report["results"] for finding in result["findings"]]
        complaints = [
            SimcheckFinding(
                severity=Severity(finding["severity"]),
                check=str(result["id"]),
                engine=str(result.get("engine") or ""),
                target=str(finding.get("target") or ""),
                message=str(finding["message"]),
            )
            for result, finding in results
            if finding["severity"] in (Severity.ERROR, Severity.WARNING)
        ]
    except (ValueError, KeyError, IndexError, TypeError, AttributeError) as error:
        said = f"its report cannot be read ({type(error).__name__}: {error})"
        return ObjectReport(asset_id=asset_id, seconds=seconds, problem=said)
    cut = [str(finding["message"]) for _, finding in results if (finding.get("data") or {}).get("incomplete")]
    return ObjectReport(asset_id=asset_id, seconds=seconds, complaints=tuple(complaints), problem=cut[0] if cut else "")


def summarize(reports: Sequence[ObjectReport]) -> SimcheckSummary:
    """Counts, and findings grouped by cause: errors before warnings, causes with the most objects first."""
    groups: dict[tuple[Severity, str, str], list[tuple[str, SimcheckFinding]]] = {}
    for report in reports:
        for item in report.complaints:
            groups.setdefault((item.severity, item.check, item.engine), []).append((report.asset_id, item))
    causes = [
        Cause(
            severity=severity,
            check=check,
            engine=engine,
            objects=len({asset_id for asset_id, _ in found}),
            findings=len(found),
            examples=tuple(dict.fromkeys(asset_id for asset_id, _ in found))[:EXAMPLES],
            message=found[0][1].message,
        )
        for (severity, check, engine), found in groups.items()
    ]
    causes.sort(key=lambda cause: (cause.severity is not Severity.ERROR, -cause.objects, cause.check, cause.engine))
    return SimcheckSummary(
        objects=len(reports),
        without_error=sum(report.without_error for report in reports),
        without_warning=sum(report.without_warning for report in reports),
        unfinished=tuple(report.asset_id for report in reports if report.problem),
        causes=tuple(causes),
        seconds=sum(report.seconds for report in reports),
    )
