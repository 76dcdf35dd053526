"""Progress of a run on standard error: a bar on a terminal, elsewhere a line every ``LINE_EVERY_S``."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

from schemas.asset import AssetRecord
from schemas.vocabulary import Status

LINE_EVERY_S = 15.0
"""Time between two lines where there is no terminal, s."""

Report = Callable[[AssetRecord], None]


@contextmanager
def progress(total: int) -> Iterator[Report]:
    """A function to call with each finished record."""
    console = Console(stderr=True)
    with _bar(console, total) if console.is_terminal else _lines(total) as report:
        yield report


@contextmanager
def _bar(console: Console, total: int) -> Iterator[Report]:
    done = (SpinnerColumn(), TextColumn("refining"), BarColumn(), MofNCompleteColumn())
    rest = (TextColumn("{task.fields[failed]} failed"), TimeRemainingColumn(), TextColumn("{task.fields[last]}"))
    with Progress(*done, *rest, console=console, transient=True) as bar:
        task = bar.add_task("refining", total=total, failed=0, last="")
        failed = 0

        def report(record: AssetRecord) -> None:
            nonlocal failed
            failed += record.status is Status.FAILED
            bar.update(task, advance=1, failed=failed, last=record.ref.asset_id)

        yield report


@contextmanager
def _lines(total: int) -> Iterator[Report]:
    done = failed = 0
    started = last = time.monotonic()

    def report(record: AssetRecord) -> None:
        nonlocal done, failed, last
        done += 1
        failed += record.status is Status.FAILED
        now = time.monotonic()
        if now - last >= LINE_EVERY_S or done == total:
            last = now
            sys.stderr.write(f"refined {done} of {total} assets, {failed} failed, {now - started:.0f} s\n")
            sys.stderr.flush()

    yield report
