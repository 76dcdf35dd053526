"""Copies of an output's tables, put right where a run was killed while it sent them."""

from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq

from asset2sim.catalog.compact import MERGED
from asset2sim.catalog.history import history_files
from asset2sim.catalog.known import known_runs
from schemas.tables import TABLES


def mend_history(folder: Path) -> None:
    """Remove the files of runs that never came into ``runs``, and those that a merged file holds already."""
    runs = known_runs(folder)
    files = history_files(folder)
    merged = {file.parent: _runs_of(file) for file in files if file.name == MERGED}
    for file in files:
        if file.name != MERGED and (file.stem not in runs or file.stem in merged.get(file.parent, ())):
            file.unlink()


def is_torn(folder: Path) -> bool:
    """Whether ``assets`` holds rows of a run that is not in ``runs``: it is being sent, or was killed meanwhile."""
    assets = folder / "catalog" / TABLES["assets"].file
    return assets.is_file() and not _runs_of(assets) <= known_runs(folder)


def _runs_of(file: Path) -> set[str]:
    return set(pc.unique(pq.read_table(file, columns=["run_id"], partitioning=None)["run_id"]).to_pylist())
