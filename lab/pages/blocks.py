"""Generated blocks of the documentation, each between two markers that name it. ``python -m lab.pages.blocks NAME OUT
PAGE`` writes one of those that are made of a refined sample dataset."""

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Generic, TypeVar

import pandas as pd

from asset2sim.catalog.read import latest_rows, query
from asset2sim.catalog.text import NOTHING, markdown_table
from lab.pages.stamp import SOURCES, new_stamp
from schemas.errors import DONE, UsageError, exit_code_of
from schemas.extensions import object_at

QUESTIONS = ("modes", "changes", "calls", "slowest", "weak")
"""Example questions to a catalog, in their order: an SQL file each, whose first line is the question in words."""
FOLDER = "lab/pages"
Found = TypeVar("Found")


def markers(name: str) -> tuple[str, str]:
    """The lines before and after a block, which ``make`` of the same name writes."""
    return f"<!-- {name}: begin (make {name}) -->", f"<!-- {name}: end -->"


def with_block(text: str, name: str, block: str) -> str:
    """A page's text with the block between its markers. Raises UsageError where they are not there."""
    begin, end = markers(name)
    if begin not in text or end not in text:
        raise UsageError(f"the page lacks the lines '{begin}' and '{end}'; put them where the block belongs")
    before, rest = text.split(begin, 1)
    return f"{before}{begin}\n\n{block}\n\n{end}{rest.split(end, 1)[1]}"


def check_page(page: Path, name: str) -> None:
    """Raise UsageError for a missing page, or one without the block's markers."""
    if not page.is_file():
        raise UsageError(f"no page at {page}")
    with_block(page.read_text(encoding="utf-8"), name, "")


def block_of(text: str, name: str) -> str | None:
    """The block that stands between its markers in a page's text; None where there is none."""
    begin, end = markers(name)
    return text.split(begin, 1)[1].split(end, 1)[0].strip() if begin in text and end in text else None


def write_block(page: Path, name: str, block: str) -> None:
    """Put the block between its markers in the file, one that is measured with its stamp. Raises UsageError where they
    are not there."""
    if name in SOURCES:
        block = f"{block.strip()}\n\n{new_stamp(name, block).line}"
    page.write_text(with_block(page.read_text(encoding="utf-8"), name, block), encoding="utf-8")


class Pages(Generic[Found]):
    """Blocks of one name on several pages, each made of the same findings; a page that is None is left out. Raises
    UsageError for a page that is not there or lacks the markers, before anything is found."""

    def __init__(self, name: str, blocks: Mapping[Path | None, Callable[[Found], str]]) -> None:
        self.name = name
        self.blocks = {page: block for page, block in blocks.items() if page is not None}
        for page in self.blocks:
            check_page(page, name)

    def write(self, found: Found) -> None:
        """Put each block between its markers."""
        for page, block in self.blocks.items():
            write_block(page, self.name, block(found))


def summary_block(out: Path) -> str:
    """The latest run's assets as a table, and a line of totals."""
    rows, measured = latest_rows(out, "assets", "measurements")
    engines = measured.groupby("asset_id")["passed"].agg(["sum", "count"])
    headings = (
        "asset", "category", "verdict", "scale", "mass kg", "Φ mm", "drift mm", "drift rad", "engines", "calls", "s"
    )  # fmt: skip
    table = markdown_table(headings, [asset_cells(row, engines) for _, row in rows.iterrows()])
    good = int((rows["status"] == "ok").sum())
    total = f"{good} of {len(rows)} ok; the others are planted defects, each with its cause in `findings`."
    return f"`make flow`, the sample dataset:\n\n{table}\n\n{total}"


def asset_cells(row: "pd.Series[str]", engines: pd.DataFrame) -> list[str]:
    """One asset as a row of the table; a dash where nothing was measured. ``engines`` holds, by asset, in how many
    engines it passed (``sum``) and was measured (``count``)."""

    def cell(name: str, form: str, factor: float = 1.0) -> str:
        return NOTHING if pd.isna(row[name]) else format(factor * float(row[name]), form)

    measured = row["asset_id"] in engines.index
    return [
        str(row["asset_id"]),
        str(row["category"]),
        str(row["status"] if row["status"] == "ok" else row["failure_mode"]),
        cell("scale", ".3f"),
        cell("mass_kg", ".2f"),
        cell("penetration_mm", ".2f"),
        cell("drift_m", ".3f", 1e3),
        cell("drift_rad", ".4f"),
        "{sum} of {count}".format(**engines.loc[row["asset_id"]]) if measured else NOTHING,
        cell("queries", ".0f"),
        cell("seconds_total", ".1f"),
    ]


def question(name: str) -> tuple[str, str]:
    """The question in words, and its whole SQL file."""
    sql = resources.files("lab.pages").joinpath(f"{name}.sql").read_text(encoding="utf-8")
    return sql.splitlines()[0].removeprefix("-- "), sql


def questions_block(out: Path) -> str:
    """Every question with the answer of OUT's catalog. Raises UsageError where OUT has none."""
    parts = []
    for name in QUESTIONS:
        words, sql = question(name)
        parts.append(f"{words} (`{FOLDER}/{name}.sql`)\n\n{frame_table(query(out, sql))}")
    return "\n\n".join(parts)


def frame_table(frame: pd.DataFrame) -> str:
    """A frame as a Markdown table, numbers to the right; a dash stands for null."""
    right = [place for place, name in enumerate(frame.columns) if pd.api.types.is_numeric_dtype(frame[name])]
    rows = [[_cell(value) for value in row] for row in frame.itertuples(index=False, name=None)]
    return markdown_table([str(name) for name in frame.columns], rows, right)


def _cell(value: object) -> str:
    if value is None or value is pd.NA or value != value:
        return NOTHING
    return f"{value:g}" if isinstance(value, float) else str(value)


BLOCKS = {
    "summary": "lab.pages.blocks:summary_block",
    "questions": "lab.pages.blocks:questions_block",
    "loaders": "lab.loaders.loader_table:loaders_block",
    "held": "lab.loaders.held_table:held_block",
}
"""Block → the function that makes it of an OUT."""


def main(words: Sequence[str]) -> int:
    """Run one command line, ``NAME OUT PAGE``, and return its exit code."""
    name, out, page = words

    def make() -> int:
        check_page(Path(page), name)
        write_block(Path(page), name, object_at(BLOCKS[name])(Path(out)))
        return DONE

    return exit_code_of(name, make)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
