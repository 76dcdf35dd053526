"""Pages of the documentation that are made from the schemas: ``python -m lab.pages.reference FOLDER``
writes the dictionary of tables, the failure modes with cause and remedy, the findings, the settings and the checks."""

import csv
import sys
from collections.abc import Callable
from importlib import resources
from pathlib import Path

import pyarrow as pa

from asset2sim.catalog.text import NOTHING, markdown_table
from asset2sim.checks.declared_check import failure_guide, known_checks
from asset2sim.runs.settings_file import settings_text
from lab.pages.blocks import write_block
from lab.schemas.tables import JUDGED
from schemas.settings import Settings
from schemas.table import Table
from schemas.tables import PUBLISHED
from schemas.vocabulary import PAPER_FAILURE_MODES, RETRIED_MODES

MADE = "*Made by `make docs` from the schemas; do not edit.*"
DICTIONARY = """\
Every table is a Parquet file in `OUT/catalog`, `asset_history` a folder of them in `OUT/history`, `reviews` one in
`OUT/reviews`. Those of outer judges, `trials`, `probe_trials`, `learning`, `learning_curves`, `video_scores`,
`ratings` and `rating_keys`, are folders of files too, in OUT or in the folder of a comparison; they keep every
recording and rating, and `asset2sim ratings` reads the judges'. The same words are in the files' metadata and,
through `connect`, in DuckDB's comments: `SELECT column_name, comment FROM duckdb_columns()`. A column that is
*required* is never null; a number that was never measured is null, never 0."""
MODES = """\
The column `failure_mode` of the table `assets` says why an asset failed, `reason` says it in a sentence with numbers.
Modes with ↻ may be the machine's, the provider's or the day's fault: such assets are tried again in every run."""
FINDINGS = """\
The table `findings` says what each stage noticed or changed, with the link or joint, the number and its bound. Each
message says what to do; these are their codes."""
SETTINGS = """\
`asset2sim settings > settings.yaml` prints this; `--settings settings.yaml` reads it, as many or as few fields as it
states."""


def dictionary_page() -> str:
    """Every published table with its columns, types, units and descriptions, in Markdown."""
    tables = map(table_section, (PUBLISHED | JUDGED).values())
    return "\n\n".join(["# Data dictionary", MADE, DICTIONARY, *tables]) + "\n"


def table_section(table: Table) -> str:
    """One table: what a row is, its key, and a line per column."""
    rows = [
        (
            f"`{field.name}`" + ("" if field.nullable else " *required*"),
            type_name(field.type),
            field.metadata[b"unit"].decode() or NOTHING,
            field.metadata[b"description"].decode().replace("|", "\\|"),
        )
        for field in table.schema
    ]
    head = f"## {table.name}\n\n{table.description}: {table.grain}. Key: {', '.join(table.key)}."
    return f"{head}\n\n{markdown_table(('column', 'type', 'unit', 'what it is'), rows)}"


def type_name(kind: pa.DataType) -> str:
    """An Arrow type as its reader would call it."""
    if pa.types.is_list(kind):
        return f"list of {type_name(kind.value_type)}"
    names = {"string": "text", "double": "number", "int64": "whole number", "bool": "yes or no"}
    return names.get(str(kind), "time (UTC)" if pa.types.is_timestamp(kind) else str(kind))


def failures_page() -> str:
    """Every failure mode with the paper's name, cause and remedy; then every finding, in Markdown."""
    modes = [
        (
            f"`{mode.value}`" + (" ↻" if mode in RETRIED_MODES else ""),
            PAPER_FAILURE_MODES.get(mode, NOTHING),
            guide.cause,
            guide.remedy,
        )
        for mode, guide in failure_guide().items()
    ]
    findings = [(f"`{row['code']}`", row["meaning"]) for row in finding_rows()]
    return (
        "\n\n".join(
            [
                "# Failure modes and findings",
                MADE,
                MODES,
                markdown_table(("failure mode", "in the paper", "what was seen", "what to do"), modes),
                "## Findings",
                FINDINGS,
                markdown_table(("code", "what it says"), findings),
            ]
        )
        + "\n"
    )


def checks_table() -> str:
    """Table of every check and what must hold, as they declare it, in Markdown."""
    rows = [(check.name, check.done, check.holds) for check in known_checks()]
    return markdown_table(("test", "what is done", "what must hold"), rows)


def finding_rows() -> list[dict[str, str]]:
    """The findings that stages make: code and meaning, by code."""
    text = resources.files("lab.pages").joinpath("findings.csv").read_text(encoding="utf-8")
    return sorted(csv.DictReader(text.splitlines()), key=lambda row: row["code"])


def settings_page() -> str:
    """Every setting with its value, unit and reason, as the file that ``--settings`` reads, in Markdown."""
    return f"# Settings\n\n{MADE}\n\n{SETTINGS}\n\n```yaml\n{settings_text(Settings(), 'yaml').strip()}\n```\n"


PAGES: dict[str, Callable[[], str]] = {
    "dictionary.md": dictionary_page,
    "failures.md": failures_page,
    "settings.md": settings_page,
}

BLOCK = "docs"
"""Name of the block of ``checks.md``."""

if __name__ == "__main__":
    write_block(Path(sys.argv[1], "checks.md"), BLOCK, checks_table())
    for file, page in PAGES.items():
        Path(sys.argv[1], file).write_text(page(), encoding="utf-8")
