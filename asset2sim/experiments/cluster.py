"""The Dask cluster of a run: inside this process by default, or an existing one, which is verified and rejoined."""

import contextlib
import hashlib
import logging
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import dask
from distributed import Client, LocalCluster
from distributed.comm.core import CommClosedError
from distributed.diagnostics.plugin import WorkerPlugin
from distributed.worker import Worker

from asset2sim.experiments.isolation.children import refuse_daemon
from asset2sim.experiments.isolation.supervise import accept_children, stop_children
from asset2sim.storage.objects import StoreError, read_object, remove_objects, write_object
from schemas.errors import UsageError
from schemas.location import Location
from schemas.settings import RunSettings

CONNECT_LIMIT_S = 10.0
"""Time in which a scheduler must answer, s."""
RETURN_LIMIT_S = 60.0
"""Time in which a lost scheduler must be back at its address, with a worker, s: a service manager restarts both within
seconds; a machine that reboots takes longer than is worth waiting for."""
RETURN_POLL_S = 1.0
"""Time between two attempts to reach the scheduler, s."""
SIGN = ".cache/sign"
"""File under the output folder by which workers prove that they see the same folder."""


class StopChildren(WorkerPlugin):
    """Dask plugin that kills a worker's children when the worker ends, as it does when its scheduler goes: a later
    worker may refine the same assets. Children that an earlier run left there are killed as well."""

    def __init__(self, owner: str) -> None:
        self.owner = owner
        self.name = f"asset2sim-{hashlib.sha256(owner.encode(errors='surrogateescape')).hexdigest()[:16]}"

    def setup(self, worker: Worker) -> None:
        """Accept children of the owner: the worker started, or the run began."""
        accept_children(self.owner)

    def teardown(self, worker: Worker) -> None:
        """Kill the owner's children: the worker ends, or another run replaces this plugin."""
        stop_children(self.owner)


@contextmanager
def join_cluster(address: str, out: Path | str, patience_s: float = 0.0) -> Iterator[Client]:
    """A client of the cluster at ``address``, closed after the block; its workers may have children for ``out``. Waits
    for ``patience_s`` for a scheduler with a worker. Raises ``UsageError`` for none, or unfit workers."""
    with _connect(address, time.monotonic() + patience_s) as client:
        _check_workers(client, address, out)
        plugin = StopChildren(str(out))
        client.register_plugin(plugin)
        try:
            yield client
        finally:
            if client.status == "running":
                with contextlib.suppress(OSError, TimeoutError):
                    client.unregister_worker_plugin(plugin.name)


def _connect(address: str, until: float) -> Client:
    while True:
        try:
            client = Client(address, timeout=CONNECT_LIMIT_S)
        except (OSError, ValueError, TimeoutError) as error:
            if time.monotonic() >= until:
                raise UsageError(
                    f"no Dask scheduler answers at {address}; start one with `dask scheduler`, or leave --scheduler out"
                ) from error
        else:
            if client.nthreads() or time.monotonic() >= until:
                return client
            client.close()
        time.sleep(RETURN_POLL_S)


def _check_workers(client: Client, address: str, out: Path | str) -> None:
    if not client.nthreads():
        raise UsageError(
            f"the scheduler at {address} has no workers; start some with "
            f"`DASK_DISTRIBUTED__WORKER__DAEMON=False dask worker {address} --nthreads 1`"
        )
    _ask_all(client, "cannot run Asset2Sim ({}); install the project where workers start", refuse_daemon)
    sign, text = Location(out).below(SIGN), uuid.uuid4().hex
    try:
        _write(sign, text)
    except (OSError, StoreError):  # a full disk; a folder that is never writable has been refused before
        return
    try:
        question = refuse_other_store if sign.is_url else refuse_other_folder
        _ask_all(client, "cannot tell what is in the output folder ({})", question, str(sign), text)
    finally:
        with contextlib.suppress(OSError, StoreError):
            remove_objects([sign]) if sign.is_url else sign.folder.unlink()


def refuse_other_folder(sign: str, text: str) -> None:
    """Raise ``UsageError`` on a worker that does not see the output folder which the run sees."""
    try:
        found = Path(sign).read_text(encoding="ascii")
    except OSError:
        found = ""
    if found != text:
        raise UsageError(
            f"it does not see the output folder {Path(sign).parents[1]} of this machine, through which results return; "
            "put it on a file system that all share, under the same path"
        )


def refuse_other_store(sign: str, text: str) -> None:
    """Raise ``UsageError`` on a worker that does not find at the output's URL what the run put there."""
    try:
        found = read_object(sign).decode(errors="replace")
    except StoreError as error:
        raise UsageError(
            f"it cannot read the output's store ({error}); start it with the credentials and the endpoint in its "
            "environment, as this run has them"
        ) from error
    if found != text:
        raise UsageError(f"it finds something else at {sign}; give it the endpoint that this run has")


def _write(sign: Location, text: str) -> None:
    if sign.is_url:
        write_object(sign, text.encode())
        return
    sign.folder.parent.mkdir(parents=True, exist_ok=True)
    sign.folder.write_text(text, encoding="ascii")


def _ask_all(client: Client, words: str, question: object, *args: object) -> None:
    answers = client.run(question, *args, on_error="return")
    for worker, answer in answers.items():
        if isinstance(answer, UsageError):
            raise UsageError(f"worker {worker}: {answer}")
        if isinstance(answer, Exception):
            raise UsageError(f"worker {worker} {words.format(answer)}")


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
