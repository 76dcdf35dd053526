"""The assets of an OUT in the order in which a person walks through them, and what is known of each."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path

from asset2sim.catalog.index import ASSETS_FOLDER, latest_by_asset
from asset2sim.catalog.read import query, read_table, rows
from asset2sim.intake.url_files import fetch_asset
from asset2sim.storage.mirror import local_parts
from asset2sim.viewer.viewed_object import ViewedObject, raw_subject, refined_subject
from schemas.location import Location
from schemas.vocabulary import Status

_NEW_FAILURES = """
SELECT asset_id, method, model
FROM asset_history, (SELECT max_by(run_id, started_at) AS latest FROM asset_history)
GROUP BY asset_id, method, model
HAVING bool_or(run_id = latest AND status = 'failed')
    AND max_by(status, started_at) FILTER (run_id <> latest) IS DISTINCT FROM 'failed'
"""
"""In SQL: a year of nights is a million rows, of which none need be here."""


class Show(StrEnum):
    """Which assets to walk through."""

    ALL = "all"
    FAILURES = "failures"
    NEW = "new failures"
    """Those of the latest run that did not fail in the run before."""
    UNREVIEWED = "unreviewed failures"


@dataclass(frozen=True)
class Stop:
    """An asset as it is in the catalog. ``new``: it fails in the latest run and did not before."""

    asset_id: str
    method: str
    model: str
    run_id: str
    category: str
    failed: bool
    failure_mode: str
    reason: str
    prompt: str
    refined: str | None
    source: str
    new: bool


@dataclass(frozen=True)
class LatestReview:
    """The latest review of an asset; ``current``: of the asset as it is now."""

    verdict: str
    note: str
    reviewer: str
    at: datetime
    current: bool


def stops_of(out: Path | str) -> tuple[Stop, ...]:
    """Every asset of OUT by its id, as its latest run left it. Raises UsageError where OUT has no catalog."""
    assets, new = read_table(out, "assets"), new_failures(out)
    latest = latest_by_asset(rows(assets))
    return tuple(
        Stop(
            asset_id=asset_id,
            method=row["method"],
            model=row["model"],
            run_id=row["run_id"],
            category=row["category"],
            failed=row["status"] == Status.FAILED,
            failure_mode=row["failure_mode"],
            reason=row["reason"],
            prompt=_text(row["prompt"]),
            refined=_text(row["refined_path"]) or None,
            source=row["source_path"],
            new=(asset_id, row["method"], row["model"]) in new,
        )
        for asset_id, row in sorted(latest.items())
    )


def new_failures(out: Path | str) -> set[tuple[str, str, str]]:
    """Keys of the assets that fail in the latest run and, in the last run before it that had them, did not."""
    return set(query(out, _NEW_FAILURES).itertuples(index=False, name=None))


def reviews_of(out: Path | str, stops: Sequence[Stop]) -> dict[str, LatestReview]:
    """Asset id → the latest review of it."""
    found = {}
    runs = {(stop.asset_id, stop.method, stop.model): stop.run_id for stop in stops}
    for row in read_table(out, "reviews").sort_values("reviewed_at").to_dict("records"):
        run_id = runs.get((row["asset_id"], row["method"], row["model"]))
        if run_id is not None:
            at = row["reviewed_at"].to_pydatetime()
            found[str(row["asset_id"])] = LatestReview(
                row["verdict"], row["note"], row["reviewer"], at, row["run_id"] == run_id
            )
    return found


def chosen_stops(stops: Sequence[Stop], said: dict[str, LatestReview], show: Show) -> tuple[Stop, ...]:
    """The stops that are to be walked through."""
    match show:
        case Show.FAILURES:
            return tuple(stop for stop in stops if stop.failed)
        case Show.NEW:
            return tuple(stop for stop in stops if stop.new)
        case Show.UNREVIEWED:
            done = {asset_id for asset_id, review in said.items() if review.current}
            return tuple(stop for stop in stops if stop.failed and stop.asset_id not in done)
    return tuple(stops)


def refined_of(out: Path | str, stop: Stop) -> ViewedObject:
    """The refined object, downloaded where OUT is a URL. Raises AssetError or StoreError."""
    if stop.refined is None:
        raise FileNotFoundError(f"nothing was written of it: {stop.reason}")
    return refined_subject(local_parts(Location(out), (f"{ASSETS_FOLDER}/{stop.asset_id}/",)) / stop.refined)


def raw_of(stop: Stop, *, held: bool) -> ViewedObject:
    """The object as it came, downloaded where its dataset is behind a URL. Raises AssetError or StoreError."""
    source = Location(stop.source)
    folder = fetch_asset(source) if source.is_url else source.folder
    if not folder.exists():
        raise FileNotFoundError(f"{folder} is not here: run the viewer from the folder of the run")
    return raw_subject(folder, held=held)


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""
