"""A synthetic year of nightly runs in ``asset_history``: a file a night, past months merged into one file each.
``python -m lab.speed.history_rows RESULT STARTED OUT GROUPING`` times the breakdown of its failures."""

import importlib
import sys
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.random import Generator

from asset2sim.catalog.failures import failures_by
from asset2sim.catalog.history import HISTORY_FOLDER, compact_history, history_files, write_synced
from asset2sim.catalog.read import query
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.write import write_run
from lab.speed.measured import QueryTimes
from schemas.asset import AssetRecord
from schemas.table import TIME
from schemas.tables import COST_COLUMNS, HISTORY
from schemas.vocabulary import PAPER_FAILURE_MODES, FailureMode, Grouping

MODULE = "lab.speed.history_rows"
TIMES = 6
"""Runs of the query: the first, and five for a median."""
FIRST_NIGHT = datetime(2025, 1, 1, 2, tzinfo=UTC)
ASSETS = 2740
"""Assets of a night: 365 nights of them are a little more than 1,000,000 rows."""
CATEGORIES = 46
"""Kinds of object, as in PartNet-Mobility."""
PERSISTENT_FAILURE_SHARE = 0.04
"""Share of the assets that fail every night, each with a failure mode of its own."""
FLAKY_FAILURE_SHARE = 0.01
"""Share of the assets that fail in one night besides those."""
CHANGED_SHARE = 0.02
"""Share of the assets that a night refines again; the others are unchanged."""
SEED = 20250101
Flags = np.ndarray[tuple[int], np.dtype[np.bool_]]


def write_history(out: Path, record: AssetRecord, rows: int, assets: int = ASSETS) -> int:
    """Write a catalog with ``record`` and a history of at least ``rows`` rows under ``out``; returns their number. Each
    night is written as a run's file, and the months are merged as a run would. Raises what ``write_run`` does."""
    nights = -(-rows // assets)
    last = FIRST_NIGHT + timedelta(days=nights - 1)
    write_run(out, RunRow(run_id=run_id(last), started_at=last, finished_at=last, dataset="synthetic"), [record])
    for start, night in night_tables(nights, assets):
        folder = out / HISTORY_FOLDER / f"month={start:%Y-%m}"
        folder.mkdir(parents=True, exist_ok=True)
        write_synced(night, folder / f"{run_id(start)}.parquet")
    compact_history(out, last)
    return nights * assets


def run_id(start: datetime) -> str:
    """The id of the run of a night."""
    return f"{start:%Y%m%dT%H%M%S}-bench000"


def night_tables(nights: int, assets: int) -> Iterator[tuple[datetime, pa.Table]]:
    """The rows of each night, with its start; the same whenever it is called."""
    random = np.random.default_rng(SEED)
    modes = [mode for mode in FailureMode if mode is not FailureMode.NONE]
    lasting = np.where(random.random(assets) < PERSISTENT_FAILURE_SHARE, random.integers(len(modes), size=assets), -1)
    same = _lasting_columns(assets, random)
    for number in range(nights):
        start = FIRST_NIGHT + timedelta(days=number)
        flaky = random.random(assets) < FLAKY_FAILURE_SHARE
        struck = np.where(flaky, random.integers(len(modes), size=assets), lasting)
        fresh = flaky | (random.random(assets) < CHANGED_SHARE)
        yield start, _night(start, [None if place < 0 else modes[place] for place in struck], fresh, same, random)


def _lasting_columns(assets: int, random: Generator) -> dict[str, list[object]]:
    """Columns whose values are the same every night."""
    return {
        "asset_id": [f"{100_000 + place}" for place in range(assets)],
        "method": ["asset2sim"] * assets,
        "model": ["prior/household"] * assets,
        "category": [f"Category{place % CATEGORIES:02}" for place in range(assets)],
        "subset": [("paper9", "paper93", "extra")[place % 3] for place in range(assets)],
        "content_hash": [random.bytes(32).hex() for _ in range(assets)],
    }


def _night(
    start: datetime, struck: list[FailureMode | None], fresh: Flags, same: dict[str, list[object]], random: Generator
) -> pa.Table:
    count = len(struck)
    made: dict[str, object] = dict(same)
    made |= {
        "run_id": [run_id(start)] * count,
        "status": ["ok" if mode is None else "failed" for mode in struck],
        "failure_mode": [(mode or FailureMode.NONE).value for mode in struck],
        "paper_failure_mode": [PAPER_FAILURE_MODES.get(mode) if mode else None for mode in struck],
        "reason": ["within every threshold" if mode is None else f"{mode.value}: over its limit" for mode in struck],
        "unchanged": [not changed for changed in fresh],
    }
    columns = []
    for field in HISTORY.schema:
        if field.name in made:
            columns.append(pa.array(made[field.name], type=field.type))
        elif field.type == TIME:
            columns.append(pa.repeat(pa.scalar(start, type=TIME), count))
        elif pa.types.is_integer(field.type):
            columns.append(pa.array(fresh.astype(np.int64) * (field.name in COST_COLUMNS), type=field.type))
        else:
            numbers = random.random(count)
            columns.append(pa.array(numbers * fresh if field.name in COST_COLUMNS else numbers, type=field.type))
    return pa.Table.from_arrays(columns, schema=HISTORY.schema)


def time_query(out: Path, grouping: Grouping, times: int = TIMES) -> QueryTimes:
    """Times of ``times`` runs of the query for failures over the whole history of OUT."""
    importlib.import_module("duckdb")
    seconds = []
    for _ in range(times):
        started = time.perf_counter()
        failures_by(out, grouping, FIRST_NIGHT)
        seconds.append(time.perf_counter() - started)
    rows = int(query(out, "SELECT count(*) AS rows FROM asset_history")["rows"].iloc[0])
    return QueryTimes(rows=rows, files=len(history_files(out)), seconds=tuple(seconds), what=grouping.value)


def main(words: Sequence[str]) -> int:
    """Time the query and write the result."""
    times = time_query(Path(words[2]), Grouping(words[3]))
    Path(words[0]).write_text(times.model_dump_json(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
