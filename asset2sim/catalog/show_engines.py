"""Tables of one asset's results per engine, for the terminal: verdicts, joint efforts and overlapping links."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich import box
from rich.console import RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.text import NOTHING, number

Row = Mapping[str, Any]
TESTS = ("drop", "nudge", "jam", "hold", "release", "reset")
"""The interaction checks in the order of the columns."""


def engine_tables(own: Mapping[str, Sequence[Row]]) -> list[RenderableType]:
    """A table of engines, one of joint efforts, and one of overlapping pairs, as far as there are rows."""
    parts: list[RenderableType] = []
    if own.get("measurements"):
        parts.append(_engines(own["measurements"], own["interactions"]))
    efforts = [row for row in own.get("interactions", ()) if row["test"] in ("opening", "closing")]
    if efforts:
        parts.append(_efforts(efforts))
    if own.get("link_overlaps"):
        parts.append(_overlaps(own["link_overlaps"]))
    return parts


def _engines(measured: Sequence[Row], tests: Sequence[Row]) -> Table:
    table = number_table("Engines", ("engine", "verdict", "Φ mm", "drift m", "drift rad", *TESTS, "s"), left=2)
    for row in measured:
        own = [test for test in tests if test["engine"] == row["engine"] and test["passed"] is not None]
        verdict = Text("ok", style="green") if row["passed"] else Text(row["failure_mode"], style="bold red")
        table.add_row(
            f"{row['engine']} {row['engine_version']}",
            verdict,
            *(number(row[name]) for name in ("penetration_mm", "drift_m", "drift_rad")),
            *(_passed([test for test in own if test["test"] == name]) for name in TESTS),
            f"{row['seconds']:.2f}",
        )
    return table


def _passed(tests: Sequence[Row]) -> Text:
    if not tests:
        return Text(NOTHING, style="dim")
    passed = sum(bool(test["passed"]) for test in tests)
    return Text(f"{passed}/{len(tests)}", style="green" if passed == len(tests) else "bold red")


def _efforts(rows: Sequence[Row]) -> Table:
    """The least efforts in the first engine that measured them: they agree between engines within a few per cent."""
    first = rows[0]["engine"]
    table = number_table(
        f"Least effort that moves a joint, in {first} (N·m, or N for sliders)", ("joint", "open", "close"), 1
    )
    joints = dict.fromkeys(row["subject"] for row in rows if row["engine"] == first)
    found = {(row["subject"], row["test"]): row["value"] for row in rows if row["engine"] == first}
    for joint in joints:
        table.add_row(escape(joint), *(number(found.get((joint, test))) for test in ("opening", "closing")))
    return table


def _overlaps(rows: Sequence[Row]) -> Table:
    table = number_table(
        "Links that overlap in the initial state", ("link", "link", "cause", "seen", "deepest mm"), left=4
    )
    for row in rows:
        seen = "not seen by default: parent and child" if row["related"] else "by every engine"
        table.add_row(escape(row["link_a"]), escape(row["link_b"]), row["cause"], seen, number(row["depth_mm"]))
    return table


def number_table(title: str, headings: Iterable[str], left: int) -> Table:
    """A table whose first ``left`` columns are text and whose others are numbers."""
    table = Table(
        title=f"\n{title}", title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="left" if index < left else "right", overflow="fold")
    return table
