"""A pipeline that meets the fault in its asset's name before the real work, and the command that runs it.

``python -m tests.faulty refine DATA --out OUT …``, with ``FAULTY_TIME_LIMIT_S`` and ``FAULTY_MEMORY_LIMIT_MB`` in place
of the usual limits. An asset called ``<fault>`` or ``<fault>-…`` meets that fault, and after ``once-`` only the first
time.
"""

import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from schemas.asset import AssetRecord, AssetRef
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import Settings
from tests import crashers
from tests.processes import wait_until

NAME = "tests.faulty:refine"
Ask = Callable[[ModelRequest], ModelAnswer]


def refine(ref: AssetRef, out: Path, settings: Settings, *, ask: Ask) -> AssetRecord:
    """The fault that the asset is named for, and then the real pipeline, or none for an asset without a folder."""
    met = noted(out, ref.asset_id)
    name = ref.asset_id.removeprefix("once-")
    fault = FAULTS.get(name.partition("-")[0]) if name == ref.asset_id or met == 1 else None
    with sound_engines():
        if fault is not None:
            fault(out)
        if not Path(ref.path).is_dir():
            return crashers.no_pipeline(ref, out, settings, ask=ask)
        from tasks.pipeline import refine_asset

        return refine_asset(ref, out, settings, ask=ask)


def noted(out: Path, asset_id: str) -> int:
    """Note this process in ``OUT/met/<asset_id>``. Returns how many processes the asset has had."""
    file = out / "met" / asset_id
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("a", encoding="ascii") as stream:
        stream.write(f"{os.getpid()}\n")
    return len(processes(out, asset_id))


def processes(out: Path, asset_id: str) -> list[int]:
    """The processes that an asset has had so far, of which the last may be at work."""
    file = out / "met" / asset_id
    return [int(line) for line in file.read_text(encoding="ascii").split()] if file.exists() else []


def kill_fork_server(out: Path) -> None:
    """Kill the fork server, the parent of all assets' processes, once it has reported how ``once-sleepy`` ended."""

    def told() -> bool:
        met = processes(out, "once-sleepy")
        return bool(met) and not Path(f"/proc/{met[0]}").exists()

    wait_until(told, 15.0)
    time.sleep(1.0)
    os.kill(os.getppid(), signal.SIGKILL)


def fill_disk(out: Path, name: str = "junk") -> None:
    """Write until the disk takes no more, and leave it so."""
    with (out / name).open("wb", buffering=0) as file:
        while True:
            file.write(bytes(1 << 16))


def fill_disk_and_clear(out: Path) -> None:
    try:
        fill_disk(out, "brief junk")
    finally:
        (out / "brief junk").unlink()


@contextmanager
def sound_engines() -> Iterator[None]:
    """Undo after the block what a fault did to the engines: the process may be given another asset."""
    import asset2sim.checks.verify

    module: Any = asset2sim.checks.verify
    measure, run_checks = module.measure, module.run_checks
    try:
        yield
    finally:
        module.measure, module.run_checks = measure, run_checks


def crash_engine(out: Path) -> None:
    """Make the engine's own process, which this one starts to verify an asset, crash as engines do."""
    import asset2sim.checks.verify

    module: Any = asset2sim.checks.verify
    module.measure = module.run_checks = lambda *_, **__: crashers.segfault()


FAULTS: dict[str, Callable[[Path], object]] = {
    "segfault": lambda out: crashers.segfault(),
    "abort": lambda out: crashers.abort(),
    "hang": lambda out: crashers.hang_holding_the_interpreter(),
    "hungry": lambda out: crashers.eat_memory(3000),
    "raise": lambda out: crashers.raise_key_error(),
    "sleepy": lambda out: time.sleep(600.0),
    "slow": lambda out: time.sleep(1.0),
    "forkserver": kill_fork_server,
    "engine": crash_engine,
    "hog": fill_disk,
    "filler": fill_disk_and_clear,
}


def limited(settings: Settings) -> Settings:
    """The settings with the limits of the environment."""
    wanted = {
        "asset_time_limit_s": float(os.environ.get("FAULTY_TIME_LIMIT_S", settings.run.asset_time_limit_s)),
        "asset_memory_limit_mb": int(os.environ.get("FAULTY_MEMORY_LIMIT_MB", settings.run.asset_memory_limit_mb)),
    }
    return settings.model_copy(update={"run": settings.run.model_copy(update=wanted)})


def main() -> int:
    import flows.command
    import flows.refine_dataset

    module: Any = flows.refine_dataset
    work: Any = flows.refine_dataset
    flow = module.refine_dataset

    def refine_dataset(data: Path, out: Path, settings: Settings, *rest: Any, **more: Any) -> Any:
        return flow(data, out, limited(settings), *rest, pipeline=NAME, **more)

    module.refine_dataset = refine_dataset
    # MLflow takes more time than all the rest, and its file, undone on a full disk, would make room at any moment.
    module.log_run = work.prepare_mlflow = lambda *_: None
    return flows.command.main(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
