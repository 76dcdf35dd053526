"""The commands that read a catalog."""

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import pandas as pd
from rich import box
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.failures import (
    compare_runs,
    failure_breakdown,
    failures_by,
    find_run,
    render_comparison,
    render_failures,
    render_failures_by,
)
from asset2sim.catalog.read import query
from asset2sim.catalog.show import describe_asset
from asset2sim.catalog.text import NOTHING
from asset2sim.cli.console import output
from schemas.vocabulary import Grouping


def print_failures(
    out: Path | str,
    by: str = Grouping.FAILURE_MODE.value,
    since: datetime | None = None,
    compare: Sequence[str] | None = None,
) -> None:
    """The failures of the catalog in ``out``: the latest of each asset, all since a time, or two runs compared."""
    grouping = Grouping(by)
    if compare is not None:
        earlier, later = (find_run(out, name) for name in compare)
        output().print(render_comparison(compare_runs(out, earlier, later), earlier, later))
    elif since is None and grouping is Grouping.FAILURE_MODE:
        output().print(render_failures(failure_breakdown(out)))
    else:
        output().print(render_failures_by(failures_by(out, grouping, since), grouping, since))


def print_query(out: Path | str, sql: str, *, csv: bool) -> None:
    """The answer to a query over the tables of ``out``."""
    answer = query(out, sql)
    if csv:
        output().print(Text(answer.to_csv(index=False).rstrip("\n")), soft_wrap=True)
        return
    table = Table(box=box.SIMPLE_HEAD)
    for name in answer.columns:
        numeric = pd.api.types.is_numeric_dtype(answer[name])
        table.add_column(Text(str(name)), justify="right" if numeric else "left", overflow="fold")
    for row in answer.itertuples(index=False, name=None):
        table.add_row(*(_cell(value) for value in row))
    output().print(table)


def print_asset(out: Path | str, asset_id: str) -> None:
    """Everything that the catalog in ``out`` has on one asset."""
    output().print(describe_asset(out, asset_id))


def _cell(value: object) -> Text:
    if isinstance(value, float) and not pd.isna(value):
        return Text(f"{value:.6g}")
    missing = value is None or value is pd.NaT or (isinstance(value, float) and pd.isna(value)) or value is pd.NA
    return Text(NOTHING if missing else str(value))
