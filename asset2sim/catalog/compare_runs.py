"""Two runs held against each other: what broke, what got mended, what came and went (``compare_runs.sql``)."""

from importlib import resources
from pathlib import Path

import pandas as pd
from rich import box
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.read import query, read_table
from asset2sim.catalog.text import NOTHING
from schemas.errors import UnknownChoiceError, UsageError

LATEST, PREVIOUS = "latest", "previous"
"""Names of the last run, and of the one before it over the same dataset with the same method and model."""
CHANGES = ("broke", "fails otherwise", "mended", "came", "went")
"""What can become of an asset from one run to another, what one looks for first in front."""
_STYLES = {"broke": "bold red", "fails otherwise": "red", "mended": "green"}
_SAME = ("dataset", "method", "model")


def compare_runs(out: Path | str, earlier: str, later: str) -> pd.DataFrame:
    """A row per asset that ended otherwise in ``later`` than in ``earlier``.

    Columns are as ``compare_runs.sql`` names them. Runs go by id, by the beginning of one, or as ``latest`` and
    ``previous``. Raises UsageError for a run that is not there, or of which there are several.
    """
    sql = resources.files("asset2sim.catalog").joinpath("compare_runs.sql").read_text(encoding="utf-8")
    return query(out, sql, (find_run(out, earlier), find_run(out, later)))


def find_run(out: Path | str, name: str) -> str:
    """The id of the run that a user names. Raises UsageError."""
    runs = read_table(out, "runs").sort_values(["started_at", "run_id"])
    if name in (LATEST, PREVIOUS):
        latest = runs.iloc[-1]
        if name == LATEST:
            return str(latest["run_id"])
        like = runs[(runs[list(_SAME)] == latest[list(_SAME)]).all(axis=1)]
        if len(like) < 2:
            raise UsageError(f"run {latest['run_id']} is the first over its dataset with its method and model")
        return str(like.iloc[-2]["run_id"])
    ids = [str(run_id) for run_id in runs["run_id"]]
    found = [name] if name in ids else [run_id for run_id in ids if name and run_id.startswith(name)]
    if len(found) > 1:
        raise UsageError(f"'{name}' is the beginning of {len(found)} runs: {', '.join(found[-5:])}; write more of it")
    if not found:
        raise UnknownChoiceError("run", name, [LATEST, PREVIOUS, *ids[-28:]])
    return found[0]


def render_comparison(found: pd.DataFrame, earlier: str, later: str) -> Table:
    """For the terminal: what broke first. Assets that only one run had are counted; those that failed are named."""
    counts = found["change"].value_counts()
    told = ", ".join(f"{counts[change]} {change}" for change in CHANGES if change in counts) or "nothing changed"
    table = Table(
        box=box.SIMPLE_HEAD, title=f"From {earlier} to {later}: {told}", title_justify="left", title_style="bold"
    )
    for name in ("change", "asset", "category", "before", "after", "reason"):
        table.add_column(name, overflow="fold")
    for row in found.to_dict("records"):
        before, after = (NOTHING if pd.isna(row[name]) else str(row[name]) for name in ("before", "after"))
        if row["change"] not in ("came", "went") or {before, after} - {"none", NOTHING}:
            change = Text(str(row["change"]), style=_STYLES.get(str(row["change"]), ""))
            reason = Text(NOTHING if pd.isna(row["reason"]) else str(row["reason"]))
            table.add_row(change, Text(str(row["asset_id"])), Text(str(row["category"])), before, after, reason)
    return table
