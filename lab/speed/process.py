"""Runs each measured part of the bench in a fresh process, which writes its numbers as JSON, and times simcheck."""

import contextlib
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from multiprocessing import forkserver
from pathlib import Path
from typing import TypeVar

from asset2sim.experiments.isolation.child import MEGABYTE
from lab.simcheck.checker import check_object, find_simcheck, refined_objects
from lab.speed.measured import CheckerTimes
from schemas.base import Frozen
from schemas.errors import Asset2SimError, UsageError

ENDING_S = 20.0
"""Time in which all that a run has started must end to be counted, s."""
LOG_TAIL_CHARS = 400
"""Characters of a program's last output that the error quotes if it wrote no numbers."""

Numbers = TypeVar("Numbers", bound=Frozen)


class BenchError(Asset2SimError):
    """A program of the bench ended without its numbers."""


def measure(
    kind: type[Numbers], module: str, words: Sequence[str], place: Path, extra: Mapping[str, str] | None = None
) -> Numbers:
    """Run ``python -m module RESULT STARTED *words`` and read its numbers from RESULT, ``place`` with ``.json``.
    STARTED is the monotonic clock before the process started, s; ``extra`` is added to its environment. What it prints
    goes to ``place`` with ``.log``. Raises BenchError, with the end of that log, if it wrote no numbers."""
    result, log = place.with_suffix(".json"), place.with_suffix(".log")
    place.parent.mkdir(parents=True, exist_ok=True)
    result.unlink(missing_ok=True)
    with log.open("wb") as stream:
        command = [sys.executable, "-m", module, str(result), repr(time.monotonic()), *words]
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=stream, stderr=stream, env={**os.environ, **(extra or {})}
        )
        try:
            code = process.wait()
        finally:
            if process.poll() is None:
                process.terminate()
                process.wait()
    if not result.is_file():
        said = log.read_text(encoding="utf-8", errors="replace").strip()[-LOG_TAIL_CHARS:] or "it said nothing"
        raise BenchError(f"{module} ended with exit code {code} and without numbers: {said} (see {log})")
    return kind.model_validate_json(result.read_text(encoding="utf-8"))


def peak_memory_mb() -> float:
    """The most resident memory that this process has had, MB. Linux's own record starts with the program, and
    ``getrusage`` counts what its parent had when it forked."""
    status = Path("/proc/self/status")
    if status.is_file():
        for line in status.read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) * 1024.0 / MEGABYTE
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / MEGABYTE


def cpu_s() -> float:
    """Processor time of this process so far, without its children's, s."""
    times = os.times()
    return times.user + times.system


def whole_cpu_s() -> float:
    """Processor time of this process and of all that it has started since ``adopt_orphans``, s, once that has ended."""
    # It lives as long as this process, else; what it forked ends a few seconds after its last work.
    forkserver._forkserver._stop()  # type: ignore[attr-defined]
    until = time.monotonic() + ENDING_S
    with contextlib.suppress(ChildProcessError):
        while time.monotonic() < until:
            if os.waitpid(-1, os.WNOHANG)[0] == 0:
                time.sleep(0.1)
    return sum(os.times()[:4])


def largest_mb() -> float:
    """The most resident memory that any process has had which this one started and that has ended, MB."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * unit / MEGABYTE


@contextlib.contextmanager
def one_core() -> Iterator[bool]:
    """Pin this thread, and the processes it starts in the block, to one core; yields whether the system supports it."""
    if not hasattr(os, "sched_setaffinity"):
        yield False
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield True
    finally:
        os.sched_setaffinity(0, before)


def machine() -> str:
    """The processor, how many cores of it may be used, and the memory, in one line."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8", errors="replace").splitlines() if info.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / MEGABYTE / 1024.0
    load = os.getloadavg()[0]
    return f"{names[0] if names else 'a processor'}, {cores} cores, {memory:.0f} GB, load {load:.1f} at the start"


def evenly_spaced(asset_ids: Sequence[str], count: int) -> tuple[str, ...]:
    """``count`` of a dataset's assets, evenly spaced in its order: of 150, every 7th makes 20."""
    step = max(1, len(asset_ids) // max(1, count))
    return tuple(asset_ids[::step][:count])


def time_checker(root: Path, out: Path, asset_ids: Sequence[str], tell: Callable[[str], None]) -> CheckerTimes:
    """Time simcheck on each refined object of OUT (free base, its two engines); ``tell`` gets a line for each object.
    ``root`` is the checkout, whose ``.venv-judge`` may hold simcheck. ``problem`` says if it is not installed."""
    try:
        simcheck = find_simcheck(root)
        objects = refined_objects(out, asset_ids)
    except UsageError as error:
        return CheckerTimes(problem=str(error))
    seconds, unfinished = {}, []
    for asset_id, urdf in objects.items():
        report = check_object(simcheck, asset_id, urdf)
        seconds[asset_id] = report.seconds
        if report.problem:
            unfinished.append(asset_id)
        tell(f"simcheck {asset_id}: {report.seconds:.1f} s {report.problem}")
    return CheckerTimes(seconds=seconds, unfinished=tuple(unfinished))
