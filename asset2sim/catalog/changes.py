"""Changes of a run against the catalog before it: new failures and mended assets. Pure functions."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
import pyarrow as pa

from asset2sim.catalog.run import RunRow
from asset2sim.catalog.stored_tables import recorded_assets
from asset2sim.catalog.switch import find_catalog
from schemas.asset import AssetSummary
from schemas.errors import Asset2SimError
from schemas.vocabulary import FailureMode, Status


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
    """Columns that two runs must share to be compared; "" for a subset or a selection of all."""
    names = ["dataset", "method", "model", "subset", "selection"]
    # A catalog that an earlier version wrote has no selection.
    return runs.reindex(columns=names).astype(object).fillna("")
