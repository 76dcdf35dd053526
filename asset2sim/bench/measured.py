"""What the bench measures: plain numbers, which travel between its processes as JSON."""

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
    failed: int
    unchanged: int
    startup_s: NonNegative
    flow_s: NonNegative
    tasks_s: dict[str, float] = Field(default_factory=dict)
    peak_memory_mb: NonNegative
    cpu_s: NonNegative


class LoopTimes(Frozen):
    """The same assets one after the other in one process. ``died_at`` names the asset at which that process was lost,
    and ``problem`` how; the times are then of no use."""

    assets: int
    ok: int
    loop_s: NonNegative
    peak_memory_mb: NonNegative = 0.0
    cpu_s: NonNegative = 0.0
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
    """Everything that one bench measured; what it left out is None."""

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
    """The objects that the checker judged, refined in the same two engines on one core."""
