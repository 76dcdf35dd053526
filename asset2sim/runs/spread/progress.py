"""Progress of a run on standard error: a bar on a terminal, elsewhere a line every ``LINE_EVERY_S``, which names the
assets at work and the slowest."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn
from rich.text import Text

from schemas.asset import AssetRecord
from schemas.errors import first_words, printable
from schemas.vocabulary import Status

LINE_EVERY_S = 15.0
"""Time between two lines where there is no terminal, s."""
MAX_NAMED = 4
"""Assets at work that a line names; the longest at work first."""


@dataclass
class Report:
    """Progress of a run: call it with each last record. ``show`` is told of every record."""

    total: int
    show: Callable[["Report"], None] = lambda _: None
    started: float = field(default_factory=time.monotonic)
    done: int = 0
    failed: int = 0
    slowest: tuple[float, str] = (0.0, "")
    at_work: dict[str, float] = field(default_factory=dict)
    ended: set[str] = field(default_factory=set)
    waiting: set[str] = field(default_factory=set)

    def begun(self, asset_id: str) -> None:
        """Note that a worker begins an asset, for the first or second time."""
        # The cluster's word of a quick asset may come after its record.
        if asset_id not in self.ended:
            self.at_work[asset_id] = time.monotonic()
            self.waiting.discard(asset_id)

    def waits(self, asset_id: str) -> None:
        """Note an asset whose first attempt died, and that waits for its second."""
        self.at_work.pop(asset_id, None)
        self.waiting.add(asset_id)

    def __call__(self, record: AssetRecord) -> None:
        """Note an asset's last record."""
        self.done += 1
        self.failed += record.status is Status.FAILED
        self.ended.add(record.ref.asset_id)
        self.waiting.discard(record.ref.asset_id)
        began = self.at_work.pop(record.ref.asset_id, None)
        if began is not None:
            self.slowest = max(self.slowest, (time.monotonic() - began, record.ref.asset_id))
        self.show(self)

    def line(self) -> str:
        """The progress in one line."""
        now = time.monotonic()
        parts = [f"refined {self.done} of {self.total} assets, {self.failed} failed, {now - self.started:.0f} s"]
        if names := self.names_at_work():
            parts.append(f"at work: {names}")
        if self.waiting:
            parts.append(f"{len(self.waiting)} to be tried once more")
        if self.slowest[1]:
            parts.append(f"slowest: {self.slowest[1]} ({self.slowest[0]:.0f} s)")
        return printable("; ".join(parts))

    def names_at_work(self) -> str:
        """The assets at work, each with how long, s."""
        now = time.monotonic()
        working = sorted(self.at_work.copy().items(), key=lambda item: item[1])
        return first_words([f"{name} ({now - began:.0f} s)" for name, began in working], MAX_NAMED)


@contextmanager
def progress(total: int) -> Iterator[Report]:
    """A report to call with each finished record."""
    console = Console(stderr=True)
    # Where colours are forced (a notebook, a build server's log) rich takes any file for a terminal.
    with _bar(console, total) if console.is_terminal and console.file.isatty() else _lines(total) as report:
        yield report


@contextmanager
def _bar(console: Console, total: int) -> Iterator[Report]:
    done = (SpinnerColumn(), TextColumn("refining"), BarColumn(), MofNCompleteColumn())
    rest = (TextColumn("{task.fields[failed]} failed"), TimeRemainingColumn(), _AtWork(Report(total)))
    with Progress(*done, *rest, console=console, transient=True) as bar:
        task = bar.add_task("refining", total=total, failed=0)
        rest[-1].report = report = Report(total, lambda now: bar.update(task, completed=now.done, failed=now.failed))
        yield report


class _AtWork(TextColumn):
    """The column that names the assets at work."""

    def __init__(self, report: Report) -> None:
        super().__init__("")
        self.report = report

    def render(self, task: object) -> Text:
        """The names as they are now."""
        return Text(printable(self.report.names_at_work()))


@contextmanager
def _lines(total: int) -> Iterator[Report]:
    report, ended = Report(total), threading.Event()

    def tell() -> None:
        sys.stderr.write(f"{report.line()}\n")
        sys.stderr.flush()

    def keep_telling() -> None:
        while not ended.wait(LINE_EVERY_S):
            tell()

    # A thread: an asset that takes minutes, or hangs, is what a reader of the log wants to know of.
    teller = threading.Thread(target=keep_telling, name="asset2sim-progress", daemon=True)
    teller.start()
    try:
        yield report
    finally:
        ended.set()
        teller.join()
        tell()
