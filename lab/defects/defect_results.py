"""When a defect counts as caught and as mended: pure functions of records.

A defect is caught if checking the unrefined planted asset, or extracting and validating it, gives a symptom (a failing
check, or a finding of at least a warning) that the clean asset does not give and that concerns the planted link or
joint. Such a symptom names it, the joint that moves the link, or the link that the joint moves; or it is about the
whole object (it explodes, it does not load), of which the defect is the only change.

It is mended if refining the planted asset ends ``ok`` and nothing of the defect is left in the written folder.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass

from asset2sim.checks.verdict import failures_of
from lab.defects.planting import PlantedChange
from schemas.asset import AssetRecord
from schemas.finding import Finding
from schemas.settings import Thresholds
from schemas.vocabulary import Severity, Stage

CAUGHT_SHARE, MENDED_SHARE = 0.9, 0.8
"""Shares of the defects that must be caught and mended."""
MIN_DEFECTS_TRIED = 16
"""Least defects to try: a share of fewer means little."""
SHOWN = 2
"""Symptoms named in one cell; the rest are counted."""
WIDEST = 60
"""Widest cell of the last columns, characters."""


@dataclass(frozen=True)
class Symptom:
    """A failing check or a finding: the engine or stage that reports it, its code, and its link or joint (or empty)."""

    by: str
    code: str
    subject: str

    @property
    def said(self) -> str:
        """Engine or stage, and code, as text."""
        return f"{self.by} {self.code}"


def raw_symptoms(record: AssetRecord, limits: Thresholds) -> Iterator[Symptom]:
    """Signs from checking an unrefined asset: failing checks by engine, overlaps of links, then findings."""
    for report in record.reports:
        if record.overlay is not None:
            for failure in failures_of(report, record.overlay, limits):
                # A failing check is about a joint, or about the whole object.
                is_joint = any(joint.name == failure.subject for joint in record.overlay.joints)
                yield Symptom(report.engine.value, failure.mode.value, failure.subject if is_joint else "")
    for overlap in record.overlaps:
        if overlap.pair.depth_m > limits.penetration_m:
            yield Symptom("pybullet", "overlap", overlap.pair.link_a)
            yield Symptom("pybullet", "overlap", overlap.pair.link_b)
    yield from (symptom_of(finding) for finding in record.findings if tells(finding, record))


def early_symptoms(record: AssetRecord) -> Iterator[Symptom]:
    """Signs from the extraction and validation of a refinement."""
    for finding in record.findings:
        if finding.stage in (Stage.EXTRACT, Stage.VALIDATE) and finding.severity is not Severity.INFO:
            yield symptom_of(finding)


def tells(finding: Finding, record: AssetRecord) -> bool:
    """Whether a finding is at least a warning, and does not repeat a failing check of the reports."""
    repeated = finding.stage is Stage.MEASURE and finding.severity is Severity.ERROR and bool(record.reports)
    return finding.severity is not Severity.INFO and not repeated


def symptom_of(finding: Finding) -> Symptom:
    """A finding as a symptom."""
    return Symptom(finding.stage.value, finding.code, finding.link or finding.joint or "")


def caught_by(symptoms: set[Symptom], clean: set[Symptom], about: frozenset[str]) -> tuple[Symptom, ...]:
    """The symptoms of the planted defect that the clean asset does not give; those that name a link or joint first."""
    new = {symptom for symptom in symptoms - clean if not symptom.subject or symptom.subject in about}
    return tuple(sorted(new, key=lambda symptom: (not symptom.subject, symptom.by, symptom.code)))


def concerned(planted: PlantedChange, clean: AssetRecord) -> frozenset[str]:
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
class DefectResult:
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
        """Whether any symptom shows the defect."""
        return bool(self.caught)

    @property
    def is_mended(self) -> bool:
        """Whether nothing is left of the defect."""
        return not self.left


def share(rows: Sequence[DefectResult], *, mended: bool) -> float:
    """The share of the rows that are mended, or caught; 0 without rows."""
    return sum(row.is_mended if mended else row.is_caught for row in rows) / max(len(rows), 1)


def passes(rows: Sequence[DefectResult]) -> bool:
    """Whether enough defects were tried, caught and mended."""
    enough_caught, enough_mended = share(rows, mended=False) >= CAUGHT_SHARE, share(rows, mended=True) >= MENDED_SHARE
    return len(rows) >= MIN_DEFECTS_TRIED and enough_caught and enough_mended


def results_text(rows: Sequence[DefectResult], unclean: Mapping[str, str]) -> str:
    """The table, the totals with their shares, and the objects that were left out."""
    cells = [("defect", "object", "caught by", "mended by", "s")]
    for row in rows:
        by = _listed(row.mended) if row.is_mended else f"not: {row.left}"[:WIDEST]
        cells.append((row.defect, row.asset_id, _listed(row.caught) or "NOT CAUGHT", by, f"{row.seconds:.1f}"))
    widths = [max(len(line[column]) for line in cells) for column in range(len(cells[0]))]
    lines = ["  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)).rstrip() for line in cells]
    lines.insert(1, "  ".join("-" * width for width in widths))
    lines.append("")
    for word, mended, wanted in (("caught", False, CAUGHT_SHARE), ("mended", True, MENDED_SHARE)):
        count = sum(row.is_mended if mended else row.is_caught for row in rows)
        lines.append(f"{word} {count} of {len(rows)} ({share(rows, mended=mended):.0%}, at least {wanted:.0%} wanted)")
    lines += [f"left out: {name}, which is not clean: {why}" for name, why in unclean.items()]
    return "\n".join(lines)


def _listed(words: Sequence[str]) -> str:
    """The first few words, and how many more there are."""
    more = f" + {len(words) - SHOWN}" if len(words) > SHOWN else ""
    return ", ".join(words[:SHOWN]) + more


def results_json(rows: Sequence[DefectResult], unclean: Mapping[str, str]) -> str:
    """The shares, rows and left-out objects as JSON."""
    shares = {"caught_share": share(rows, mended=False), "mended_share": share(rows, mended=True)}
    content = {**shares, "rows": [asdict(row) for row in rows], "left_out": dict(unclean)}
    return json.dumps(content, indent=1, ensure_ascii=False)
