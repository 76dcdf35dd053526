"""The questions with a catalog's answers, as Markdown."""

import sys
from importlib import resources
from pathlib import Path

import pandas as pd

from asset2sim.catalog.read import query
from asset2sim.catalog.text import NOTHING
from asset2sim.studies.readme.blocks import with_block

NAMES = ("modes", "changes", "calls", "slowest", "weak")
"""The questions, in the order in which they are asked."""
FOLDER = "asset2sim/studies/readme"


def question(name: str) -> tuple[str, str]:
    """The question in words, and its whole SQL file."""
    sql = resources.files("asset2sim.studies.readme").joinpath(f"{name}.sql").read_text(encoding="utf-8")
    return sql.splitlines()[0].removeprefix("-- "), sql


def answers_block(out: Path) -> str:
    """Every question with the answer of OUT's catalog. Raises UsageError where OUT has none."""
    parts = []
    for name in NAMES:
        words, sql = question(name)
        parts.append(f"{words} ([`{name}.sql`]({FOLDER}/{name}.sql))\n\n{markdown_table(query(out, sql))}")
    return "\n\n".join(parts)


def markdown_table(frame: pd.DataFrame) -> str:
    """A frame as a table, numbers to the right; a dash stands for null."""
    numeric = [pd.api.types.is_numeric_dtype(frame[name]) for name in frame.columns]
    lines = [[str(name) for name in frame.columns], ["---:" if right else "---" for right in numeric]]
    lines += [[_cell(value) for value in row] for row in frame.itertuples(index=False, name=None)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(value: object) -> str:
    if value is None or value is pd.NA or value != value:
        return NOTHING
    return f"{value:g}" if isinstance(value, float) else str(value).replace("|", "\\|")


BEGIN = "<!-- questions: begin (make questions) -->"
END = "<!-- questions: end -->"

if __name__ == "__main__":
    target = Path(sys.argv[2])
    text = with_block(target.read_text(encoding="utf-8"), answers_block(Path(sys.argv[1])), BEGIN, END)
    target.write_text(text, encoding="utf-8")
