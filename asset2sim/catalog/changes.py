"""Figures of a run from its records, and its changes against the catalog before it: new failures and mended assets."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean, median

import pandas as pd
import pyarrow as pa

from asset2sim.catalog.rows import run_cost
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.stored_tables import recorded_assets
from asset2sim.catalog.switch import find_catalog
from schemas.alignment import NOTHING, SIZE, Alignment
from schemas.asset import AssetSummary, MotionSummary, Unchanged
from schemas.errors import Asset2SimError
from schemas.settings import Thresholds
from schemas.vocabulary import FailureMode, Stage, Status


@dataclass(frozen=True)
class Previous:
    """The catalog before a run wrote to it. ``modes``: asset id → failure mode, for the run's method and model."""

    modes: Mapping[str, str] = field(default_factory=dict)
    gone: tuple[str, ...] = ()
    """Assets that the dataset no longer has: they are not among ``modes``."""
    problem: str | None = None
    """Why the catalog could not be read, if there is one."""


@dataclass(frozen=True)
class AssetChange:
    """An asset of this run and its failure mode before, ``was``: None for an asset that is new in the catalog."""

    record: AssetSummary
    was: str | None


@dataclass(frozen=True)
class Changes:
    """Differences between a run and the catalog before it, and totals of the catalog after it. ``standing``: failure
    mode → assets of the run's method and model in the catalog, this run's included. It is comparable between runs that
    refined different shares of a dataset."""

    new_failures: tuple[AssetChange, ...]
    mended: tuple[AssetChange, ...]
    still_failing: tuple[AssetChange, ...]
    standing: Mapping[str, int]
    gone: tuple[str, ...] = ()
    """Assets that left the dataset, and so the catalog."""

    @property
    def standing_assets(self) -> int:
        """Assets in the catalog, after this run."""
        return sum(self.standing.values())

    @property
    def standing_ok(self) -> int:
        """Assets in the catalog that pass, after this run."""
        return self.standing.get(FailureMode.NONE, 0)


def find_changes(records: Sequence[AssetSummary], previous: Previous) -> Changes:
    """Compare a run's records with the catalog before it. A failed asset that was not there is a new failure."""
    seen = [AssetChange(record, previous.modes.get(record.ref.asset_id)) for record in records]
    failed = [item for item in seen if item.record.status is Status.FAILED]
    failing_before = [item for item in seen if item.was not in (None, FailureMode.NONE)]
    ended = dict(previous.modes) | {record.ref.asset_id: record.failure_mode.value for record in records}
    return Changes(
        new_failures=tuple(item for item in failed if item.was in (None, FailureMode.NONE)),
        mended=tuple(item for item in failing_before if item.record.status is Status.OK),
        still_failing=tuple(item for item in failing_before if item.record.status is Status.FAILED),
        standing=Counter(ended.values()),
        gone=previous.gone,
    )


def change_figures(changes: Changes) -> dict[str, float]:
    """Name → figure, the same names for every run; ``standing_success_rate`` only where there are assets."""
    figures: dict[str, float] = {
        "new_failures": len(changes.new_failures),
        "mended": len(changes.mended),
        "still_failing": len(changes.still_failing),
        "gone": len(changes.gone),
        "standing_assets": changes.standing_assets,
        "standing_ok": changes.standing_ok,
    }
    if changes.standing_assets:
        figures["standing_success_rate"] = changes.standing_ok / changes.standing_assets
    return figures


def read_previous(out: Path, run: RunRow, present: Collection[str] | None = None) -> Previous:
    """How each asset of the run's method and model ended before it, and which of them the dataset no longer has.

    ``present`` names the assets that the dataset still has, None where the run does not know. Call it before the run is
    written. Empty where OUT has no catalog yet; where the catalog cannot be read, ``problem`` says why, and the run
    goes on without it.
    """
    if find_catalog(out) is None:
        return Previous()
    method, model = run.settings.method.value, run.settings.model.model
    try:
        before = recorded_assets(out, method, model)
    except (Asset2SimError, OSError, KeyError, ValueError, pa.ArrowException) as error:
        return Previous(problem=f"what was there before cannot be read, so every failure counts as new: {error}")
    modes = {name: row.failure_mode.value for name, row in before.items()}
    gone = () if present is None else tuple(sorted(name for name in modes if name not in present))
    modes = {name: mode for name, mode in modes.items() if present is None or name in present}
    return Previous(modes, gone)


def like_latest(runs: pd.DataFrame) -> pd.DataFrame:
    """The runs that can be compared with the latest, oldest first, it included."""
    ordered = runs.sort_values(["started_at", "run_id"]).reset_index(drop=True)
    same = comparison_columns(ordered)
    return ordered[(same == same.iloc[-1]).all(axis=1)] if len(ordered) else ordered


def comparison_columns(runs: pd.DataFrame) -> pd.DataFrame:
    """Columns that two runs must have in common to be compared, a column each; "" for a subset or a selection of
    all."""
    names = ["dataset", "method", "model", "subset", "selection"]
    # A catalog that an earlier version wrote has no selection.
    return runs.reindex(columns=names).astype(object).fillna("")


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
