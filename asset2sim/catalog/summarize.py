"""An asset's record in short, as a run keeps it in memory, and how many of a file's numbers were kept and mended."""

import json
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from asset2sim.catalog.rows_engines import prismatic_joints
from asset2sim.checks.at_rest import oscillating_joints
from asset2sim.checks.verdict import report_verdict
from schemas.asset import AssetRecord, AssetSummary, MotionSummary
from schemas.authored import Authored
from schemas.interaction import Measurement
from schemas.overlay import PhysicsOverlay
from schemas.settings import Thresholds
from schemas.table import Row
from schemas.vocabulary import Quantity, Source, Stage

WAYS = KEPT, SUPPLIED, MENDED = "kept", "supplied", "mended"
"""Outcomes of a file's number, and the columns of ``assets`` that count them."""


def numbers_of(overlay: PhysicsOverlay) -> Iterator[tuple[Quantity, str, Source]]:
    """Each number that a file may state, and that the object needs: its quantity, the link or joint that has it, and
    where it comes from. Joints without limits or springs have none."""
    yield Quantity.SIZE, "", overlay.scale_source
    for link in overlay.links:
        yield Quantity.MASS, link.name, link.mass_source
        yield Quantity.CENTRE, link.name, link.com_source
        yield Quantity.INERTIA, link.name, link.inertia_source
        if link.shapes_source is not None:
            yield Quantity.SHAPES, link.name, link.shapes_source
    for joint in overlay.all_joints:
        yield Quantity.DAMPING, joint.name, joint.damping_source
        yield Quantity.FRICTION, joint.name, joint.friction_source
        if joint.stiffness > 0.0:
            yield Quantity.SPRINGS, joint.name, joint.stiffness_source
        if joint.lower is not None:
            yield Quantity.LIMITS, joint.name, joint.limits_source
        if joint.mimic is None:
            yield Quantity.START, joint.name, joint.position_source
    if overlay.contact_source is not None:
        yield Quantity.CONTACT, "", overlay.contact_source


def kept_counts(overlay: PhysicsOverlay) -> Counter[tuple[Quantity, str]]:
    """How many numbers of each quantity are kept, supplied and mended; those of the user's words are none of these."""
    stated = {(item.quantity, name) for item in overlay.authored for name in item.of or ("",)}
    # A coefficient of contacts is stated link by link, and the object has one.
    stated |= {(quantity, "") for quantity, _ in stated if quantity is Quantity.CONTACT}
    found: Counter[tuple[Quantity, str]] = Counter()
    for quantity, name, source in numbers_of(overlay):
        if source is not Source.USER:
            how = KEPT if source is Source.AUTHORED else MENDED if (quantity, name) in stated else SUPPLIED
            found[quantity, how] += 1
    return found


def totals(counts: Counter[tuple[Quantity, str]]) -> tuple[int, int, int]:
    """How many numbers are kept, supplied and mended in all."""
    kept, supplied, mended = (sum(n for (_, how), n in counts.items() if how == wanted) for wanted in WAYS)
    return kept, supplied, mended


def kept_columns(overlay: PhysicsOverlay | None) -> Row:
    """Columns of what became of a file's numbers, and of how far each is believed; null without an overlay."""
    if overlay is None:
        return dict.fromkeys((*WAYS, "authored_json"))
    counts = kept_counts(overlay)
    by_quantity = [
        {"quantity": quantity.value, **{how: counts[quantity, how] for how in WAYS}}
        | {"said": [item.model_dump(mode="json", exclude={"quantity"}) for item in beliefs_on(overlay, quantity)]}
        for quantity in Quantity
    ]
    every = dict(zip(WAYS, totals(counts), strict=True))
    return every | {"authored_json": json.dumps(by_quantity, ensure_ascii=False) if overlay.authored else None}


def beliefs_on(overlay: PhysicsOverlay, quantity: Quantity) -> Sequence[Authored]:
    """The beliefs about one quantity."""
    return [item for item in overlay.authored if item.quantity is quantity]


def kept_line(records: Iterable[AssetSummary]) -> str:
    """One line on what became of the numbers of files in metres; "" without any."""
    found = [record.numbers for record in records if record.numbers is not None]
    if not found:
        return ""
    kept, supplied, mended = (sum(counts) for counts in zip(*found, strict=True))
    files = f"{len(found)} files in metres say" if len(found) > 1 else "the file, which is in metres, says"
    return f"of what {files}: {kept} numbers kept, {mended} mended; {supplied} supplied"


def summarize(record: AssetRecord, limits: Thresholds) -> AssetSummary:
    """The record in short, judged by these thresholds."""
    overlay, paid = record.overlay, [call for call in record.calls if not call.cached]
    verdicts = [report_verdict(report, overlay, limits) for report in record.reports] if overlay else []
    return AssetSummary(
        ref=record.ref,
        category=shared(record.category),
        method=record.method,
        model=shared(record.model),
        status=record.status,
        failure_mode=record.failure_mode,
        reason=shared(record.reason),
        content_hash=record.content_hash,
        seconds={shared(stage): seconds for stage, seconds in record.seconds.items()},
        total_seconds=total_seconds(record),
        call_costs_usd=tuple(call.cost_usd for call in paid),
        prompt_tokens=sum(call.prompt_tokens for call in paid),
        completion_tokens=sum(call.completion_tokens for call in paid),
        cached_calls=len(record.calls) - len(paid),
        scale=overlay.scale if overlay else None,
        mass_kg=overlay.mass_kg if overlay else None,
        measurement=_motion(record, record.measurement, limits) if record.measurement else None,
        alignment=record.alignment,
        expected=record.expected,
        engines=(sum(verdict.passed for verdict in verdicts), len(verdicts)) if verdicts else None,
        numbers=totals(kept_counts(overlay)) if overlay and overlay.authored else None,
    )


def summarize_all(records: Iterable[AssetRecord]) -> tuple[AssetSummary, ...]:
    """The records in short, in their order."""
    return tuple(summarize(record, Thresholds()) for record in records)


def shared(text: str) -> str:
    """The one copy of a text that thousands of assets have."""
    return sys.intern(str(text))


def total_seconds(record: AssetRecord) -> float:
    """Wall time of the asset, s: the stages added up, or ``total`` where the record states one."""
    stages = sum(record.seconds.get(stage.value, 0.0) for stage in Stage)
    return record.seconds.get("total", stages)


def _motion(record: AssetRecord, measured: Measurement, limits: Thresholds) -> MotionSummary:
    return MotionSummary(
        penetration_m=measured.penetration_m,
        drift_m=measured.drift_m,
        drift_rad=measured.drift_rad,
        finite=measured.finite,
        oscillating_joints=len(oscillating_joints(measured, prismatic_joints(record), limits)),
    )
