"""``make bench``: DATA WORK [--limit N]. Runs ``asset2sim refine`` without caches, in every engine, with views and
report: of one object alone, with one worker, with two, and once more with nothing changed. Prints the table of it, and
writes it into WORK/bench.md.

Each run is a process of its own, ``python -m lab.flows.bench --timed RESULT refine …``, which counts all that it
started.
"""

import contextlib
import os
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from multiprocessing import forkserver
from pathlib import Path

from pydantic import Field
from pydantic_settings import CliPositionalArg

from asset2sim.catalog.read import read_table
from asset2sim.catalog.text import output
from asset2sim.experiments.isolation.child import MEGABYTE, adopt_orphans
from asset2sim.intake.dataset import load_dataset
from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.option_types import N
from flows import command
from lab.speed.bench_figures import BenchRun, Used, bench_markdown
from schemas.errors import DONE, Asset2SimError, exit_code_of
from schemas.vocabulary import Engine

PROGRAM = "python -m lab.flows.bench"
TIMED = "--timed"
ENDING_S = 20.0
"""Time in which all that a run has started must end to be counted, s."""
KIB_PER_MB = MEGABYTE / 1024.0


class BenchRequest(Options):
    """Measure what refining a dataset takes."""

    data: CliPositionalArg[Path] = Field(description="the dataset")
    work: CliPositionalArg[Path] = Field(description="a folder for everything that is made; bench.md in it")
    limit: N | None = Field(None, description="only N of the dataset's objects, evenly spaced")


def evenly_spaced(asset_ids: Sequence[str], count: int) -> tuple[str, ...]:
    """``count`` of a dataset's assets, evenly spaced in its order: of 150, every 7th makes 20."""
    step = max(1, len(asset_ids) // max(1, count))
    return tuple(asset_ids[::step][:count])


def machine() -> str:
    """How many cores may be used, the memory, and the load, in one line."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return f"{len(os.sched_getaffinity(0))} cores, {memory:.0f} GB, load {os.getloadavg()[0]:.1f} at the start"


def run(request: BenchRequest, out: Path, workers: int, ids: Sequence[str]) -> BenchRun:
    """One run of the command in a process of its own. Raises Asset2SimError, which names its log, if it fails."""
    result, log = out.with_suffix(".json"), out.with_suffix(".log")
    words = ["refine", str(request.data), "--out", str(out), "--workers", str(workers)]
    words += ["--engines", ",".join(Engine), "--assets", ",".join(ids)]
    with log.open("wb") as stream:
        command = [sys.executable, "-m", "lab.flows.bench", TIMED, str(result), *words]
        code = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=stream, stderr=stream).returncode
    if code:
        raise Asset2SimError(f"asset2sim {' '.join(words)} ended with exit code {code}; see {log}")
    last = read_table(out, "runs").sort_values("started_at").iloc[-1]
    used = Used.model_validate_json(result.read_text(encoding="utf-8"))
    return BenchRun(workers, used, last, read_table(out, "assets"))


def timed(result: Path, words: Sequence[str]) -> int:
    """Run a command of ``asset2sim`` and write what it and all that it started used. Returns its exit code."""
    adopt_orphans()
    code = command.main(words)
    # It lives as long as this process, else; what it forked ends a few seconds after its last work.
    forkserver._forkserver._stop()  # type: ignore[attr-defined]
    until = time.monotonic() + ENDING_S
    with contextlib.suppress(ChildProcessError):
        while time.monotonic() < until:
            if os.waitpid(-1, os.WNOHANG)[0] == 0:
                time.sleep(0.1)
    driver, others = (resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    used = Used(processor_s=sum(os.times()[:4]), driver_mb=driver / KIB_PER_MB, largest_mb=others / KIB_PER_MB)
    result.write_text(used.model_dump_json(), encoding="utf-8")
    return code


def bench(request: BenchRequest) -> int:
    """Measure, print the table and write it. Raises UsageError for a dataset that cannot be read."""
    ids = [ref.asset_id for ref in load_dataset(request.data)]
    ids = list(evenly_spaced(ids, request.limit or len(ids)))
    request.work.mkdir(parents=True, exist_ok=True)
    began_on = machine()
    runs = {}
    for name, workers, some in (("alone", 1, ids[:1]), ("one", 1, ids), ("two", 2, ids)):
        shutil.rmtree(request.work / name, ignore_errors=True)
        runs[name] = run(request, request.work / name, workers, some)
    again = run(request, request.work / "two", 2, ids)
    text = f"Measured on {began_on}.\n\n{bench_markdown(runs['alone'], runs['one'], runs['two'], again)}\n"
    (request.work / "bench.md").write_text(text, encoding="utf-8")
    output().print(text, soft_wrap=True)
    return DONE


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    if words[:1] == [TIMED]:
        return timed(Path(words[1]), words[2:])
    return exit_code_of("bench", lambda: bench(parse(BenchRequest, words, PROGRAM)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
