"""The history of all runs: ``OUT/history/month=YYYY-MM/RUN_ID.parquet``, a file a run. A file is written under a hidden
name before the catalog changes and gets its own after that, so that a run is in both or in
neither, whenever it is killed."""

import re
from datetime import datetime, timedelta
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import check_key
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.stored_tables import recorded_run_ids, stored_columns
from asset2sim.catalog.switch import replace_file, sync
from schemas.table import ASSET_KEY, TYPES
from schemas.tables import COST_COLUMNS, HISTORY, TABLES

HISTORY_FOLDER = "history"
PATTERN = f"{HISTORY_FOLDER}/month=*/*.parquet"
"""The files, relative to OUT; unfinished ones are hidden and have another suffix."""
_PART = re.compile(r"^\.(?P<run_id>.+)\.parquet\.part$")


def history_files(out: Path) -> list[Path]:
    """The files of the history, oldest month first."""
    return sorted(out.glob(PATTERN))


def history_rows(run: RunRow, assets: pa.Table, chosen: pa.ChunkedArray) -> pa.Table:
    """Rows of ``asset_history`` for a run. ``assets`` is the table after the run, and ``chosen`` (n,) bool marks the
    rows of the run's assets. A row that an earlier run wrote is of an unchanged asset, whose cost in this run is 0."""
    rows = assets.filter(chosen)
    unchanged = pc.not_equal(rows["run_id"], run.run_id)
    made: dict[str, pa.ChunkedArray | pa.Array] = {name: rows[name] for name in rows.schema.names}
    made["run_id"] = pa.repeat(pa.scalar(run.run_id), rows.num_rows)
    made["started_at"] = pa.repeat(pa.scalar(run.started_at, type=TYPES["time"]), rows.num_rows)
    made["unchanged"] = unchanged
    for name in COST_COLUMNS:
        made[name] = pc.if_else(unchanged, pa.scalar(0, type=rows[name].type), rows[name])
    columns = [made[field.name].cast(field.type) for field in HISTORY.schema]
    built = pa.Table.from_arrays(columns, schema=HISTORY.schema)
    check_key(HISTORY, built)
    return built.sort_by([(name, "ascending") for name in ASSET_KEY])


def stage_history(out: Path, run: RunRow, rows: pa.Table) -> None:
    """Write a run's file under its hidden name."""
    folder = out / HISTORY_FOLDER / f"month={run.started_at:%Y-%m}"
    folder.mkdir(parents=True, exist_ok=True)
    sync(folder.parent)
    part = folder / f".{run.run_id}.parquet.part"
    pq.write_table(rows, part, compression="zstd")
    sync(part)
    sync(folder)


def commit_history(out: Path) -> None:
    """Rename the staged files of the catalog's runs to their final names; remove those of other runs."""
    runs = recorded_run_ids(out)
    for part in sorted((out / HISTORY_FOLDER).glob("month=*/.*.parquet.part")):
        match = _PART.match(part.name)
        if match is not None and match["run_id"] in runs:
            replace_file(part, part.with_name(f"{match['run_id']}.parquet"))
        else:
            part.unlink()


def remove_old_history(out: Path, now: datetime, days: int) -> str | None:
    """Remove the files of runs that began over ``days`` days before ``now``; needs OUT's lock. The newest run over each
    dataset and subset with its method and model stays. Returns a line that says what was removed, None for nothing."""
    limit, newest = now - timedelta(days=days), newest_runs(out)
    rows, runs = 0, set[str]()
    for file in history_files(out):
        if file.parent.name > f"month={limit:%Y-%m}":
            continue
        found = pq.read_table(file, columns=["run_id", "started_at"], partitioning=None)
        own = set(pc.unique(found["run_id"]).to_pylist())
        if own and not own & newest and pc.max(found["started_at"]).as_py() < limit:
            file.unlink()
            rows, runs = rows + found.num_rows, runs | own
    return f"history: removed {rows} rows of {len(runs)} runs from before {limit:%Y-%m-%d}" if runs else None


def newest_runs(out: Path) -> frozenset[str]:
    """Ids of the last run over each dataset and subset with its method and model."""
    same = ("dataset", "subset", "method", "model")
    rows = stored_columns(out, TABLES["runs"], ("run_id", "started_at", *same)).sort_by("started_at").to_pylist()
    return frozenset({tuple(row[name] for name in same): row["run_id"] for row in rows}.values())
