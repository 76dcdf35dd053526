"""One command line of ``asset2sim``, timed: ``python -m lab.flows.bench_run RESULT STARTED refine DATA --out OUT``."""

import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from asset2sim.experiments.isolation.child import adopt_orphans
from asset2sim.runs.request import RefineRequest
from asset2sim.runs.result import RunResult
from flows.command import ready, run_command
from lab.speed.measured import FlowTimes
from lab.speed.process import cpu_s, largest_mb, peak_memory_mb, whole_cpu_s
from schemas.errors import UsageError
from schemas.vocabulary import Status

MODULE = "lab.flows.bench_run"


def main(words: Sequence[str]) -> int:
    """Run the command as ``asset2sim`` does, and write its numbers. Returns the exit code."""
    result, started, *command = words
    adopt_orphans()
    refine = partial(timed_refine, result=Path(result), started=float(started))
    code = run_command(command, refine=refine, nightly=_refuse)
    if Path(result).is_file():
        times = FlowTimes.model_validate_json(Path(result).read_text(encoding="utf-8"))
        whole = times.model_copy(update={"whole_cpu_s": whole_cpu_s(), "largest_mb": largest_mb()})
        Path(result).write_text(whole.model_dump_json(), encoding="utf-8")
    return code


def timed_refine(request: RefineRequest, result: Path, started: float) -> RunResult:
    """``flows.command.refine``, timed; ``started`` is the start of the process on the monotonic clock, s."""
    with ready(request) as flow:
        tasks_s = watch_tasks()
        called = time.monotonic()
        done = flow(request)
        ended = time.monotonic()
    times = FlowTimes(
        workers=request.settings.run.workers,
        assets=len(done.records) + len(done.unchanged),
        ok=sum(record.status is Status.OK for record in done.records),
        unchanged=len(done.unchanged),
        startup_s=called - started,
        flow_s=ended - called,
        tasks_s=tasks_s,
        peak_memory_mb=peak_memory_mb(),
        cpu_s=cpu_s(),
    )
    result.write_text(times.model_dump_json(), encoding="utf-8")
    return done


def watch_tasks() -> dict[str, float]:
    """Prefect task → seconds of its last run, which fills as the flow's tasks end."""
    from prefect import Task
    from prefect.client.schemas.objects import State, TaskRun

    import flows.refine_dataset as flow

    seconds: dict[str, float] = {}

    def note(task: Task[..., object], task_run: TaskRun, state: State) -> None:
        if task_run.start_time is not None:
            seconds[task.name] = (state.timestamp - task_run.start_time).total_seconds()

    for found in vars(flow).values():
        if isinstance(found, Task):
            found.on_completion(note)
    return seconds


def _refuse(request: RefineRequest) -> int:
    raise UsageError("the bench times 'refine'")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
