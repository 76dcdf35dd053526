"""The failure-mode breakdown, from one documented query on the Parquet files (``failures.sql``)."""

from importlib import resources
from pathlib import Path

import pandas as pd
from rich import box
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.read import query
from schemas.model_names import described


def failure_breakdown(out: Path | str) -> pd.DataFrame:
    """A row per method, model and failure mode, ``none`` first; columns as ``failures.sql`` names them.

    Raises UsageError where OUT has no catalog.
    """
    sql = resources.files("asset2sim.catalog").joinpath("failures.sql").read_text(encoding="utf-8")
    return query(out, sql)


def render_failures(breakdown: pd.DataFrame) -> Table:
    """The breakdown as a table for the terminal; method and model only where there is more than one pair of them."""
    pairs = sorted(set(zip(breakdown["method"], breakdown["model"], strict=True)))
    several = len(pairs) > 1
    title = f"Failure modes: {pairs[0][0]}, {described(pairs[0][1])}" if len(pairs) == 1 else "Failure modes"
    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left", title_style="bold")
    for name in ("method", "model") if several else ():
        table.add_column(name)
    table.add_column("failure mode", no_wrap=True)
    table.add_column("in the paper")
    table.add_column("assets", justify="right", no_wrap=True)
    table.add_column("share %", justify="right", no_wrap=True)
    table.add_column("causes")
    table.add_column("for example")
    for row in breakdown.to_dict("records"):
        passed = row["failure_mode"] == "none"
        examples = [str(asset) for asset in row["example_asset_ids"]]
        more = ", …" if row["assets"] > len(examples) else ""
        cells: list[str | Text] = [
            Text("none (ok)" if passed else str(row["failure_mode"]), style="green" if passed else "red"),
            _text(row["paper_failure_mode"]),
            str(row["assets"]),
            f"{row['share_percent']:.1f}",
            _text(row["causes"]),
            ", ".join(examples) + more,
        ]
        table.add_row(*((str(row["method"]), described(str(row["model"]))) if several else ()), *cells)
    return table


def _text(value: object) -> str:
    return value if isinstance(value, str) else "–"
