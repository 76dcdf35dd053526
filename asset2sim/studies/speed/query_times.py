"""How long the breakdown of failures takes: ``python -m … query_times RESULT STARTED OUT GROUPING``."""

import sys
import time
from collections.abc import Sequence
from pathlib import Path

from asset2sim.catalog.failures import failures_by
from asset2sim.catalog.history import history_files
from asset2sim.catalog.read import query
from asset2sim.studies.speed.history_rows import FIRST_NIGHT
from asset2sim.studies.speed.measured import QueryTimes
from schemas.vocabulary import Grouping

MODULE = "asset2sim.studies.speed.history_rows"
TIMES = 6
"""Runs of the query: the first, and five for a median."""


def time_query(out: Path, grouping: Grouping, times: int = TIMES) -> QueryTimes:
    """Times of ``times`` runs of the query for failures over the whole history of OUT."""
    import duckdb

    assert duckdb.__version__
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
