"""One night over entries that only replay records, timed: ``python -m lab.flows.bench_night RESULT STARTED refine …``.
The flow, the terminal's summary included, is what ``asset2sim refine`` runs; only the pipeline is another."""

import sys
import time
from collections.abc import Sequence
from pathlib import Path

from asset2sim.runs.request import parse_request
from flows.command import check, ready
from lab.flows.bench_run import watch_tasks
from lab.speed.measured import FlowTimes
from lab.speed.process import cpu_s, peak_memory_mb
from lab.speed.replay import PIPELINE
from schemas.vocabulary import Status

MODULE = "lab.flows.bench_night"


def main(words: Sequence[str]) -> int:
    """Run one night and write its numbers."""
    result, started, *command = words
    request = check(parse_request(command))
    with ready(request):
        from flows.refine_dataset import refine_dataset
        from flows.show import print_summary

        tasks_s = watch_tasks()
        called = time.monotonic()
        done = refine_dataset(request.data, request.out, request.settings, pipeline=PIPELINE, found=request.found)
        ended = time.monotonic()
        print_summary(done)
    times = FlowTimes(
        workers=request.settings.run.workers,
        assets=len(done.records) + len(done.unchanged),
        ok=sum(record.status is Status.OK for record in done.records),
        unchanged=len(done.unchanged),
        startup_s=called - float(started),
        flow_s=ended - called,
        tasks_s=tasks_s,
        peak_memory_mb=peak_memory_mb(),
        cpu_s=cpu_s(),
    )
    Path(result).write_text(times.model_dump_json(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
