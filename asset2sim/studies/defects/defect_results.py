"""When a defect counts as caught and as mended: pure functions of records.

A defect is caught if checking the unrefined planted asset, or extracting and validating it, gives a sign (a failing
check, or a finding of at least a warning) that the clean asset does not give and that concerns the planted link or
joint: the sign names it, the joint that moves the link, or the link that the joint moves; or the sign is about the
whole object (it explodes, it does not load), of which the defect is the only change. A sign that names another link or
joint does not count.

It is mended if refining the planted asset ends ``ok`` and nothing of the defect is left in the written folder.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from asset2sim.checks.verdict import failures_of
from asset2sim.studies.defects.planting import Planted
from schemas.asset import AssetRecord
from schemas.finding import Finding
from schemas.overlay import PhysicsOverlay
from schemas.settings import Thresholds
from schemas.vocabulary import Severity, Stage

CAUGHT_SHARE, MENDED_SHARE = 0.9, 0.8
"""Shares of the defects that must be caught and mended."""
MIN_DEFECTS_TRIED = 16
"""Least defects to try: a share of fewer means little."""


@dataclass(frozen=True)
class Sign:
    """A failing check or a finding: the engine or stage that reports it, its code, and its link or joint (or empty)."""

    by: str
    code: str
    subject: str

    @property
    def said(self) -> str:
        """Engine or stage, and code, as text."""
        return f"{self.by} {self.code}"


def raw_signs(record: AssetRecord, limits: Thresholds) -> Iterator[Sign]:
    """Signs from checking an unrefined asset: failing checks by engine, overlaps of links, then findings."""
    for report in record.reports:
        if record.overlay is not None:
            for failure in failures_of(report, record.overlay, limits):
                yield Sign(report.engine.value, failure.mode.value, subject_joint(record.overlay, failure.subject))
    for overlap in record.overlaps:
        if overlap.pair.depth_m > limits.penetration_m:
            yield Sign("pybullet", "overlap", overlap.pair.link_a)
            yield Sign("pybullet", "overlap", overlap.pair.link_b)
    yield from (sign_of(finding) for finding in record.findings if tells(finding, record))


def early_signs(record: AssetRecord) -> Iterator[Sign]:
    """Signs from the extraction and validation of a refinement."""
    for finding in record.findings:
        if finding.stage in (Stage.EXTRACT, Stage.VALIDATE) and finding.severity is not Severity.INFO:
            yield sign_of(finding)


def tells(finding: Finding, record: AssetRecord) -> bool:
    """Whether a finding is at least a warning, and does not repeat a failing check of the reports."""
    repeated = finding.stage is Stage.MEASURE and finding.severity is Severity.ERROR and bool(record.reports)
    return finding.severity is not Severity.INFO and not repeated


def sign_of(finding: Finding) -> Sign:
    """A finding as a sign."""
    return Sign(finding.stage.value, finding.code, finding.link or finding.joint or "")


def subject_joint(overlay: PhysicsOverlay, subject: str) -> str:
    """The joint that a failing check is about, or an empty text for the whole object."""
    return subject if any(joint.name == subject for joint in overlay.joints) else ""


def caught_by(signs: set[Sign], clean: set[Sign], about: frozenset[str]) -> tuple[Sign, ...]:
    """The signs of the planted defect that the clean asset does not give; those that name a link or joint first."""
    new = {sign for sign in signs - clean if not sign.subject or sign.subject in about}
    return tuple(sorted(new, key=lambda sign: (not sign.subject, sign.by, sign.code)))


def concerned(planted: Planted, clean: AssetRecord) -> frozenset[str]:
    """The links and joints that a defect is about: those planted, and what moves or is moved by them."""
    about = {*planted.links, *planted.joints}
    for joint in () if clean.features is None else clean.features.joints:
        if joint.child in planted.links:
            about.add(joint.name)
        if joint.name in planted.joints:
            about.add(joint.child)
    return frozenset(about)


def mended_by(record: AssetRecord, clean: AssetRecord, about: frozenset[str]) -> tuple[str, ...]:
    """Findings about the defect and accepted steps of its refinement that the clean asset's refinement has not."""

    def acts(of: AssetRecord) -> set[str]:
        named = {finding.code for finding in of.findings if (finding.link or finding.joint or "") in {*about, ""}}
        return named | {step.reason.split(":")[0] for step in of.trace if step.accepted}

    return tuple(sorted(acts(record) - acts(clean))) or ("overlay",)


@dataclass(frozen=True)
class Row:
    """Result of one planted defect. ``left`` says why it does not count as mended; empty if it does."""

    defect: str
    asset_id: str
    what: str
    caught: tuple[str, ...]
    mended: tuple[str, ...]
    left: str
    seconds: float

    @property
    def is_caught(self) -> bool:
        """Whether any sign shows the defect."""
        return bool(self.caught)

    @property
    def is_mended(self) -> bool:
        """Whether nothing is left of the defect."""
        return not self.left


def share(rows: list[Row], *, mended: bool) -> float:
    """The share of the rows that are mended, or caught; 0 without rows."""
    return sum(row.is_mended if mended else row.is_caught for row in rows) / max(len(rows), 1)


def passes(rows: list[Row]) -> bool:
    """Whether enough defects were tried, caught and mended."""
    return (
        len(rows) >= MIN_DEFECTS_TRIED
        and share(rows, mended=False) >= CAUGHT_SHARE
        and share(rows, mended=True) >= MENDED_SHARE
    )
