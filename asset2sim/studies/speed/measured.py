"""What the bench is asked to measure, and the records that its processes exchange as JSON."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from pydantic import Field

from schemas.base import Frozen, NonNegative


class FlowTimes(Frozen):
    """One run of the flow in a process of its own, all in seconds of wall time unless a name says otherwise.

    ``startup_s`` is from the start of the process to the call of the flow: imports, and Prefect's server; ``flow_s``
    from that call to its result: planning, refining, publishing, report and MLflow. ``tasks_s`` maps a Prefect task's
    name to its share of it. Memory and processor time are of that process alone, without the assets' and the server's.
    """

    workers: int
    assets: int
    ok: int
    unchanged: int
    startup_s: NonNegative
    flow_s: NonNegative
    tasks_s: dict[str, float] = Field(default_factory=dict)
    peak_memory_mb: NonNegative
    cpu_s: NonNegative


class LoopTimes(Frozen):
    """Times of the same assets refined one after the other in one process. If that process died, ``died_at`` names the
    asset, ``problem`` the cause, and the times are invalid."""

    assets: int
    ok: int
    loop_s: NonNegative
    died_at: str | None = None
    problem: str = ""


class QueryTimes(Frozen):
    """A query over the history, asked again and again in one process, s; the first may find cold files."""

    rows: int
    files: int
    seconds: tuple[float, ...]
    what: str


class CheckerTimes(Frozen):
    """The independent checker over refined objects on one core, s of wall time each."""

    seconds: dict[str, float] = Field(default_factory=dict)
    unfinished: tuple[str, ...] = ()
    problem: str = ""
    """Why nothing was measured."""


class Measured(Frozen):
    """All results of one bench; None for a part that was not run."""

    machine: str
    one: FlowTimes | None = None
    two: FlowTimes | None = None
    loop: LoopTimes | None = None
    stages: dict[str, tuple[float, float]] = Field(default_factory=dict)
    """Stage → seconds over all assets, and the median of an asset, of the run with one worker."""
    again: FlowTimes | None = None
    synthetic: tuple[FlowTimes, ...] = ()
    """Unchanged runs over synthetic entries, few and many."""
    queries: tuple[QueryTimes, ...] = ()
    checked: CheckerTimes | None = None
    both: FlowTimes | None = None
    """The objects that simcheck checked, refined in the same two engines on one core."""


PARTS = ("rates", "unchanged", "synthetic", "history", "checker")


class BenchRequest(Frozen):
    """A dataset, a folder to work in, and how much to measure; the defaults are those of the acceptance."""

    data: Path
    work: Path
    limit: int | None = None
    entries: int = 10_000
    few: int = 1_000
    rows: int = 1_000_000
    objects: int = 20
    interact: bool = True
    parts: tuple[str, ...] = PARTS
    strict: bool = False


def parse_request(words: Sequence[str]) -> BenchRequest:
    """The request of a command line; exits with code 2 if it cannot be parsed."""
    default = BenchRequest(data=Path(), work=Path())
    parser = argparse.ArgumentParser(prog="python -m flows.bench", description="how fast a night is")
    add = parser.add_argument
    add("data", type=Path, metavar="DATA", help="the dataset")
    add("work", type=Path, metavar="WORK", help="a folder for everything that is made; bench.md and bench.json in it")
    add("--limit", type=int, metavar="N", help="only the dataset's first N objects")
    add("--entries", type=int, default=default.entries, metavar="N", help="synthetic entries (%(default)s)")
    add("--few", type=int, default=default.few, metavar="N", help="... against so many, for the memory (%(default)s)")
    add("--rows", type=int, default=default.rows, metavar="N", help="rows of history (%(default)s)")
    add("--objects", type=int, default=default.objects, metavar="N", help="objects to check (%(default)s)")
    add("--no-interaction", action="store_true", help="without interaction tests, to try the bench out")
    add("--only", action="append", choices=PARTS, help="measure this part; may be repeated")
    add("--strict", action="store_true", help="exit with 1 where a target is not met")
    chosen = parser.parse_args(words)
    return BenchRequest(
        data=chosen.data,
        work=chosen.work,
        limit=chosen.limit,
        entries=chosen.entries,
        few=chosen.few,
        rows=chosen.rows,
        objects=chosen.objects,
        interact=not chosen.no_interaction,
        parts=tuple(part for part in PARTS if part in chosen.only) if chosen.only else PARTS,
        strict=chosen.strict,
    )
