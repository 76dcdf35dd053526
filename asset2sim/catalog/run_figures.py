"""Figures of a run, computed from its records, for MLflow and the summary."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from statistics import fmean, median

from asset2sim.catalog.rows import run_cost
from schemas.alignment import NOTHING, SIZE, Alignment
from schemas.asset import AssetSummary, MotionSummary, Unchanged
from schemas.settings import Thresholds
from schemas.vocabulary import FailureMode, Stage, Status


def run_figures(records: Sequence[AssetSummary], limits: Thresholds) -> dict[str, float]:
    """Name → figure, if it has a value. Shares (0 to 1) are of measured assets, ``success_rate`` of all."""
    ok = sum(record.status is Status.OK for record in records)
    figures = {"assets": len(records), "ok": ok, "failed": len(records) - ok, **run_cost(records)}
    if records:
        figures["success_rate"] = ok / len(records)
        figures["queries_per_asset"] = figures["queries"] / len(records)
        figures["tokens_per_asset"] = (figures["prompt_tokens"] + figures["completion_tokens"]) / len(records)
    figures |= {f"failures_{mode.value}": count for mode, count in failure_counts(records).items()}
    return figures | _penetration(records) | _shares(records, limits) | _semantics(records) | _seconds(records)


def all_asset_figures(records: Sequence[AssetSummary], unchanged: Sequence[Unchanged]) -> dict[str, float]:
    """Counts of all assets of a run, unchanged ones included, under the names of ``run_figures``: comparable between
    runs that refined different parts of one dataset."""
    every: list[AssetSummary | Unchanged] = [*records, *unchanged]
    ok = sum(item.status is Status.OK for item in every)
    figures: dict[str, float] = {"assets": len(every), "ok": ok, "failed": len(every) - ok}
    figures |= {"refined": len(records), "unchanged": len(unchanged)}
    if every:
        figures["success_rate"] = ok / len(every)
    return figures | {f"failures_{mode.value}": count for mode, count in failure_counts(every).items()}


def failure_counts(items: Sequence[AssetSummary | Unchanged]) -> dict[FailureMode, int]:
    """Failure mode → assets, every mode but ``none``, in the order of the enumeration."""
    counted = Counter(item.failure_mode for item in items)
    return {mode: counted[mode] for mode in FailureMode if mode is not FailureMode.NONE}


def drift_passes(measured: MotionSummary, limits: Thresholds) -> bool:
    """Whether the untouched object drifted by no more than the limits."""
    return measured.finite and measured.drift_m <= limits.drift_m and measured.drift_rad <= limits.drift_rad


def _penetration(records: Sequence[AssetSummary]) -> dict[str, float]:
    values = [1000.0 * record.measurement.penetration_m for record in records if record.measurement]
    figures = _spread("penetration_mm", values, {"mean": fmean, "median": median, "max": max})
    touching = [value for value in values if value > 0.0]
    # The paper averages over the objects that penetrate at all.
    figures |= _spread("penetration_mm", touching, {"mean_nonzero": fmean})
    return figures | {"penetrating_assets": len(touching)}


def _shares(records: Sequence[AssetSummary], limits: Thresholds) -> dict[str, float]:
    measured = [record.measurement for record in records if record.measurement]
    if not measured:
        return {"measured": 0}
    return {
        "measured": len(measured),
        "penetration_pass_share": fmean(m.penetration_m <= limits.penetration_m for m in measured),
        "drift_pass_share": fmean(drift_passes(m, limits) for m in measured),
        "oscillation_pass_share": fmean(m.finite and not m.oscillating_joints for m in measured),
    }


def _semantics(records: Sequence[AssetSummary]) -> dict[str, float]:
    found = [record.alignment for record in records if record.alignment is not None]
    figures = _spread("alignment", [item.value for item in found], {"mean": fmean})
    figures |= _spread("judged", [item.judged.value for item in found if item.judged is not None], {"mean": fmean})
    off = [item.scale_deviation for item in found if item.scale_deviation is not None and item.reference_states_scale]
    figures |= _spread("scale_deviation", off, {"mean": fmean})
    for name, (met, asked) in expected_counts(records).items():
        figures |= {f"expected_{name.replace(' ', '_')}_share": met / asked} if asked else {}
    for name, slider in (("joint_deviation_rad", False), ("joint_deviation_m", True)):
        figures |= _spread(name, joint_deviations(found, slider=slider), {"mean": fmean})
    return figures


def expected_counts(records: Sequence[AssetSummary]) -> dict[str, tuple[int, int]]:
    """Sizes, and asked joints at the start and at rest: how many are as expected, and of how many; {} where the dataset
    has no expectations. What swings counts at rest as it was at the start."""
    every = [item for record in records for item in record.expected]
    if not every:
        return {}
    joints = [item for item in every if item.expectation.what not in (SIZE, NOTHING)]
    verdicts = {
        "sizes": [item.met for item in every if item.expectation.what == SIZE],
        "joints at the start": [item.at_start for item in joints],
        "joints at rest": [item.met for item in joints],
    }
    known = {name: [met for met in found if met is not None] for name, found in verdicts.items()}
    return {name: (sum(found), len(found)) for name, found in known.items()}


def joint_deviations(found: Iterable[Alignment], *, slider: bool) -> list[float]:
    """Deviations of those joints of interest that are sliders, m, or hinges, rad."""
    of_kind = [item.joint_deviation for item in found if item.joint_is_slider is slider]
    return [value for value in of_kind if value is not None]


def _seconds(records: Sequence[AssetSummary]) -> dict[str, float]:
    figures: dict[str, float] = {}
    for stage in Stage:
        values = [record.seconds[stage.value] for record in records if stage.value in record.seconds]
        figures |= _spread(f"seconds_{stage.value}", values, {"mean": fmean, "median": median})
    every = [record.total_seconds for record in records]
    return figures | _spread("seconds_asset", every, {"mean": fmean, "median": median, "max": max})


def _spread(
    name: str, values: Sequence[float], functions: dict[str, Callable[[Sequence[float]], float]]
) -> dict[str, float]:
    return {f"{name}_{label}": float(function(values)) for label, function in functions.items()} if values else {}
