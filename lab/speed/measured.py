"""Requests to the bench, and the records that its processes exchange as JSON."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

from pydantic import Field
from pydantic_settings import CliDualFlag, CliPositionalArg, CliToggleFlag
from typing_extensions import TypeAliasType

from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.option_types import Listed, N
from schemas.base import Frozen, NonNegative


class FlowTimes(Frozen):
    """One run of the flow in a process of its own, all in seconds of wall time unless a name says otherwise.

    ``startup_s`` is from the start of the process to the call of the flow: imports, and Prefect's server; ``flow_s``
    from that call to its result: planning, refining, publishing, report and MLflow. ``tasks_s`` maps a Prefect task's
    name to its share of it. Memory and ``cpu_s`` are of that process alone, without the assets' and the server's;
    ``whole_cpu_s`` is the processor time of all that it started, too, and ``largest_mb`` the most memory of any one of
    these processes, 0 where they were not waited for.
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
    whole_cpu_s: NonNegative = 0.0
    largest_mb: NonNegative = 0.0


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


class BenchMeasurements(Frozen):
    """All results of one bench; None for a part that was not run."""

    machine: str
    one: FlowTimes | None = None
    two: FlowTimes | None = None
    loop: LoopTimes | None = None
    stages: dict[str, tuple[float, float]] = Field(default_factory=dict)
    """Stage → seconds over all assets, and the median of an asset, of the run with one worker."""
    cold: FlowTimes | None = None
    """A run as users have it: without caches, in every engine, with views and report."""
    cold_assets_s: dict[str, tuple[float, ...]] = Field(default_factory=dict)
    """Category → processor time of each asset of that, s."""
    cold_two: FlowTimes | None = None
    """The same with two workers."""
    alone: FlowTimes | None = None
    """The same of one object alone: what a run costs whatever it refines."""
    alone_s: NonNegative = 0.0
    """Processor time of that object, s."""
    again: FlowTimes | None = None
    synthetic: tuple[FlowTimes, ...] = ()
    """Unchanged runs over synthetic entries, few and many."""
    nights: tuple[FlowTimes, ...] = ()
    """Nights that refined synthetic entries, few and many."""
    queries: tuple[QueryTimes, ...] = ()
    checked: CheckerTimes | None = None
    both: FlowTimes | None = None
    """The objects that simcheck checked, refined in the same two engines on one core."""


Part = Literal["cold", "rates", "unchanged", "synthetic", "night", "history", "checker"]
PARTS: tuple[Part, ...] = get_args(Part)
NAMES = TypeAliasType("NAMES", tuple[Part, ...])


class BenchRequest(Options):
    """Measure how fast a night is; the defaults are those of the acceptance."""

    data: CliPositionalArg[Path] = Field(description="the dataset")
    work: CliPositionalArg[Path] = Field(
        description="a folder for everything that is made; bench.md and bench.json in it"
    )
    limit: N | None = Field(None, description="only N of the dataset's objects, evenly spaced")
    entries: N = Field(10_000, description="synthetic entries")
    few: N = Field(1_000, description="... against so many, for the memory")
    left: CliToggleFlag[bool] = Field(
        False, description="nights that take up what a killed one had finished: no process is started, so much faster"
    )
    rows: N = Field(1_000_000, description="rows of history")
    objects: N = Field(20, description="objects to check")
    interaction: CliDualFlag[bool] = Field(True, description="interaction tests; without them to try the bench out")
    only: Listed[NAMES] = Field((), description=f"measure this part; may be repeated: {', '.join(PARTS)}")
    strict: CliToggleFlag[bool] = Field(False, description="exit with 1 where a target is not met")

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts to measure, in the bench's order."""
        return tuple(part for part in PARTS if part in (self.only or PARTS))


def parse_request(words: Sequence[str]) -> BenchRequest:
    """The request that a command line states. Raises UsageError."""
    return parse(BenchRequest, words, "python -m lab.flows.bench")
