"""``asset2sim doctor``: what works here."""

from pathlib import Path

from rich import box
from rich.table import Table
from rich.text import Text

from asset2sim.cli.console import output
from asset2sim.runs.doctor import Check, examine
from schemas.settings import ModelSettings


def print_doctor(out: Path | str, model: ModelSettings) -> bool:
    """Print every check; returns whether all that is needed works."""
    checks = examine(out, model)
    table = Table(box=box.SIMPLE_HEAD, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for check in checks:
        table.add_row(_verdict(check), check.name, Text(check.detail))
    output().print(table)
    return all(check.ok for check in checks if check.needed)


def _verdict(check: Check) -> Text:
    if check.ok:
        return Text("ok", style="green")
    return Text("broken", style="bold red") if check.needed else Text("note", style="yellow")
