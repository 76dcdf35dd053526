"""What a run changed: which assets fail that did not, and which no longer do. Pure."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime

from schemas.asset import AssetRecord
from schemas.vocabulary import FailureMode, Status


@dataclass(frozen=True)
class PreviousRun:
    """The figures of an earlier run over the same dataset, method and model."""

    run_id: str
    started_at: datetime
    assets: int
    ok: int
    refined: int
    """Those of its assets that were not left as they were."""
    queries: int
    tokens: int
    cost_usd: float
    seconds: float
    asset_seconds: float


@dataclass(frozen=True)
class Previous:
    """What the catalog held before a run wrote to it: asset → how it ended then, for the run's method and model."""

    modes: Mapping[str, str] = field(default_factory=dict)
    run: PreviousRun | None = None
    gone: tuple[str, ...] = ()
    """Assets that the dataset no longer has: they are not among ``modes``."""
    problem: str | None = None
    """Why nothing of it could be read, where something is there."""


@dataclass(frozen=True)
class Changed:
    """An asset of this run, and how it had ended before; ``was`` is None for one that was not there."""

    record: AssetRecord
    was: str | None


@dataclass(frozen=True)
class Changes:
    """A run against what was before it, and the catalog after it.

    ``standing`` counts the assets of the run's method and model in the catalog by how they end, this run's included:
    it compares across runs that refined different shares of a dataset.
    """

    new_failures: tuple[Changed, ...]
    mended: tuple[Changed, ...]
    still_failing: tuple[Changed, ...]
    standing: Mapping[str, int]
    gone: tuple[str, ...] = ()
    """Assets that left the dataset, and so the catalog."""

    @property
    def standing_assets(self) -> int:
        """Assets in the catalog, after this run."""
        return sum(self.standing.values())

    @property
    def standing_ok(self) -> int:
        """Those of them that pass."""
        return self.standing.get(FailureMode.NONE, 0)


def find_changes(records: Sequence[AssetRecord], previous: Previous) -> Changes:
    """A run's records against what was there before. An asset that was not there and fails is a new failure."""
    seen = [Changed(record, previous.modes.get(record.ref.asset_id)) for record in records]
    failed = [item for item in seen if item.record.status is Status.FAILED]
    ended = dict(previous.modes) | {record.ref.asset_id: record.failure_mode.value for record in records}
    return Changes(
        new_failures=tuple(item for item in failed if item.was in (None, FailureMode.NONE)),
        mended=tuple(
            item for item in seen if item.record.status is Status.OK and item.was not in (None, FailureMode.NONE)
        ),
        still_failing=tuple(item for item in failed if item.was not in (None, FailureMode.NONE)),
        standing=Counter(ended.values()),
        gone=previous.gone,
    )


def change_figures(changes: Changes) -> dict[str, float]:
    """Name → figure, the same names every night; the share only where there are assets."""
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
