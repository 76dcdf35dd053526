"""Outputs whose tables are damaged, and queries that want more than the tables."""

from collections.abc import Callable, Sequence
from pathlib import Path

from asset2sim.catalog.write import write_run
from schemas.errors import DONE, FAILED
from tests.factories import make_record
from tests.hostile.case import Case, Place
from tests.hostile.tiny import Write
from tests.test_catalog_history import night

READERS = {
    "query": ("query", "SELECT count(*) FROM assets"),
    "show": ("show", "a"),
    "failures": ("failures",),
    "view": ("view", "a"),
}
"""Commands that read the tables."""
DAMAGE: dict[str, Callable[[Path], object]] = {
    "cut": lambda path: path.write_bytes(path.read_bytes()[:-100]),
    "empty": lambda path: path.write_bytes(b""),
    "text": lambda path: path.write_text("asset_id,mass_kg\na,1\n"),
    "folder": lambda path: path.rename(path.with_suffix(".old")).with_suffix(".parquet").mkdir(),
}
"""What befalls a table's file."""
REFUSED = (
    "COPY (SELECT 1) TO 'OUT/new.csv'",
    "COPY assets TO 'OUT/catalog/assets.parquet'",
    "EXPLAIN ANALYZE COPY assets TO 'OUT/new.csv'",
    "COPY (PIVOT assets ON failure_mode) TO 'OUT/new.csv'",
    "EXPORT DATABASE 'OUT/new'",
    "ATTACH 'OUT/new.db'",
    "SELECT * FROM read_text('DATA/../outside/secret.txt')",
    "SELECT * FROM read_csv('OUT/../outside/*')",
    "SELECT * FROM glob('/*')",
    "INSTALL httpfs",
    "SELECT * FROM range(1000000000000)",
)
"""Queries that read or write other files than the tables."""


def cases() -> Sequence[Case]:
    """The cases."""
    damaged = [
        Case(f"{what}_{name}", _output(what), says="assets.parquet", line=(*words, "--out", "OUT"), code=FAILED)
        for what in DAMAGE
        for name, words in READERS.items()
    ]
    queries = [
        Case(f"query_{number:02}", _output(), says="the query failed", line=("query", sql, "--out", "OUT"))
        for number, sql in enumerate(REFUSED)
    ]
    allowed = ("query", REFUSED[0], "--allow-files", "--out", "OUT")
    pivoted = ("query", "PIVOT (SELECT failure_mode, 1 AS n FROM assets) ON failure_mode USING sum(n)", "--out", "OUT")
    return [
        *damaged,
        *queries,
        Case("query_allowed", _output(), line=allowed, code=DONE),
        Case("query_pivot", _output(), says="none", line=pivoted, code=DONE),
        Case("show_markup", _output(), says="[red]boxy", line=("show", "[red]boxy", "--out", "OUT"), code=DONE),
    ]


def _output(what: str = "") -> Write:
    """An output of two assets, to whose largest table something happened."""

    def write(place: Place) -> None:
        write_run(place.out, night(1), [make_record("a"), make_record("[red]boxy")])
        if what:
            DAMAGE[what](place.out / "catalog" / "assets.parquet")

    return write
