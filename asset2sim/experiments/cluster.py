"""The Dask cluster of a run: inside this process by default, or an existing one."""

import logging
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import dask
from distributed import Client, LocalCluster
from distributed.comm.core import CommClosedError

from asset2sim.experiments.existing_cluster import join_cluster
from schemas.settings import RunSettings

_CONFIG = {
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": False,
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.tick.limit": "60s",
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}
"""Dask does not watch memory: records are small, and the children, which use the memory, have a limit of their own.
Ticks are rare and may be late, since LiteLLM's import holds the interpreter; that and no profiling bring Dask's idle
cost from 3 % of a core to 1 %. No HTTP pages are served.
"""

_TALKATIVE = ("distributed", "distributed.client")
"""Dask's loggers to silence: the second has its own level."""

LOOPBACK = "127.0.0.1:0"
"""Dashboard address, which Dask opens even without pages: any free port, on this machine only."""


@contextmanager
def open_client(run: RunSettings, out: Path | str, patience_s: float = 0.0) -> Iterator[Client]:
    """A client of the cluster that ``run`` asks for, closed after the block; an existing one: see ``join_cluster``.

    The local cluster's workers are threads of this process: each waits for a child process, which holds the engines
    and is the only thing that may crash. Against worker processes that saves 1.3 s of start-up, 4 ms an asset, and
    LiteLLM's import (5 s and 180 MB) in each. Raises ``UsageError`` for a scheduler that cannot be used.
    """
    if run.scheduler is None:
        with (
            _quiet_dask(),
            dask.config.set(_CONFIG),
            tempfile.TemporaryDirectory(prefix="asset2sim-") as scratch,
            LocalCluster(
                n_workers=run.workers,
                threads_per_worker=1,
                processes=False,
                dashboard_address=LOOPBACK,
                worker_dashboard_address=LOOPBACK,
                memory_limit=0,
                local_directory=scratch,
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client
    else:
        with _quiet_dask(), join_cluster(run.scheduler, out, patience_s) as client:
            yield client


def concurrency(client: Client) -> int:
    """How many assets the cluster works on at once; at least 1."""
    threads: dict[str, int] = client.nthreads()
    return max(1, sum(threads.values()))


def _no_fault_of_ours(record: logging.LogRecord) -> bool:
    """Whether a log record is about anything but a connection that Dask closed, on a busy machine without the second in
    which the other side should have seen it (``TimeoutError``), or a wait that Ctrl-C ended before Dask had begun it:
    its ``sync`` then cancels a future that is not there yet."""
    error = record.exc_info[1] if record.exc_info else None
    early = isinstance(error, NameError) and "'future'" in str(error)
    return not (early or isinstance(error, CommClosedError | TimeoutError))


@contextmanager
def _quiet_dask() -> Iterator[None]:
    """Silence Dask within the block: it logs every connection, and warns about those that it closes itself. What its
    event loop tells later is silenced for good."""
    for name in ("asyncio", "tornado.application"):
        logging.getLogger(name).addFilter(_no_fault_of_ours)
    before = {name: logging.getLogger(name).level for name in _TALKATIVE}
    for name in _TALKATIVE:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
