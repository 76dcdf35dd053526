"""Dask in processes of its own: ``dask scheduler`` and ``dask worker`` as started by hand, or a cluster that exists
before the run."""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import dask
from distributed import Client, LocalCluster

from tests.assets import ROOT
from tests.processes import free_port

Program = subprocess.Popen[bytes]


@dataclass(frozen=True)
class Programs:
    """How to start Dask's programs: the scheduler's port, the environment, and the log file."""

    port: int
    environment: dict[str, str]
    log: Path

    @property
    def address(self) -> str:
        return f"tcp://127.0.0.1:{self.port}"


def programs(environment: dict[str, str], folder: Path) -> Programs:
    return Programs(free_port(), environment, folder / "dask.log")


def start_scheduler(with_: Programs) -> Program:
    return _start(with_, "scheduler", "--host", "127.0.0.1", "--port", str(with_.port))


def start_workers(with_: Programs, count: int) -> Program:
    return _start(with_, "worker", with_.address, "--nthreads", "1", "--nworkers", str(count))


def _start(with_: Programs, *words: str) -> Program:
    environment = {**with_.environment, "DASK_DISTRIBUTED__WORKER__DAEMON": "False", "PYTHONPATH": str(ROOT)}
    with with_.log.open("ab") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *words, "--no-dashboard"],
            cwd=with_.log.parent, env=environment, stdout=log, stderr=log, start_new_session=True,
        )  # fmt: skip


def await_workers(address: str, workers: int, limit_s: float) -> None:
    """Wait until a scheduler with so many workers is there, as one client: a new one each time costs a busy machine."""
    with Client(address, timeout=limit_s) as client:
        client.wait_for_workers(workers, timeout=limit_s)


def worker_of(child: int) -> int:
    """The process of the Dask worker whose fork server made this child."""
    return _parent(_parent(child))


def _parent(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[1])


def process_cluster(daemon: bool, **environment: str) -> LocalCluster:
    """A cluster of one worker process; a ``daemon`` may not have children."""
    with dask.config.set({"distributed.worker.daemon": daemon, "distributed.scheduler.allowed-failures": 0}):
        return LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            silence_logs=60,
            env=environment,
        )
