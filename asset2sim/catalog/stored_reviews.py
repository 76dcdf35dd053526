"""The files of the table of reviews: ``OUT/reviews/NAME.parquet``, and one without rows that the first run writes."""

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from asset2sim.catalog.enforce import conform
from asset2sim.catalog.own_files import write_own_file
from schemas.location import Location
from schemas.tables_reviews import REVIEWS

REVIEWS_FOLDER = REVIEWS.name
REVIEWS_PATTERN = f"{REVIEWS_FOLDER}/*.parquet"
"""The files, relative to OUT."""
EMPTY = "none.parquet"
"""The file without rows, by which readers know the columns before anybody has reviewed anything."""


def review_files(out: Path) -> list[Path]:
    """The files of reviews."""
    return sorted(out.glob(REVIEWS_PATTERN))


def make_reviews(out: Path) -> None:
    """Write the file without rows, where there is none."""
    if not (out / REVIEWS_FOLDER / EMPTY).exists():
        write_own_file(Location(out), REVIEWS, EMPTY, REVIEWS.schema.empty_table())


def stored_reviews(out: Path) -> pa.Table:
    """All reviews in today's schema, oldest first."""
    tables = [conform(REVIEWS, pq.read_table(path, partitioning=None), str(path)) for path in review_files(out)]
    whole = pa.concat_tables(tables) if tables else REVIEWS.schema.empty_table()
    return whole.sort_by([("reviewed_at", "ascending"), ("asset_id", "ascending")])
