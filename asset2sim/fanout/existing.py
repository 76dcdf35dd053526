"""A Dask cluster that is there already: joining it, its workers looked at first, and coming back to it."""

import contextlib
import hashlib
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from distributed import Client
from distributed.diagnostics.plugin import WorkerPlugin
from distributed.worker import Worker

from asset2sim.isolation.server import refuse_daemon
from asset2sim.isolation.stopping import accept_children, stop_children
from asset2sim.remote.cache import working_folder
from schemas.errors import UsageError
from schemas.location import is_url

CONNECT_LIMIT_S = 10.0
"""Time in which a scheduler must answer, s."""
RETURN_LIMIT_S = 60.0
"""Time in which a scheduler that went away must be back at its address, with a worker, s: a service manager restarts
both within seconds, a machine that starts again takes longer than anybody should wait for it."""
RETURN_POLL_S = 1.0
"""Time between two attempts to find it, s."""
SIGN = ".cache/sign"
"""A file under the output folder by which workers show that it is theirs too; a URL is everybody's."""


class StopChildren(WorkerPlugin):
    """Has a worker's children killed when the worker ends, as it does when its scheduler goes: nobody waits for what
    they do, and a later worker may work on the same assets. So are those that an earlier run has left there."""

    def __init__(self, out: Path | str) -> None:
        self.out = out
        self.name = f"asset2sim-{hashlib.sha256(str(out).encode(errors='surrogateescape')).hexdigest()[:16]}"

    def setup(self, worker: Worker) -> None:
        """The worker is there, or the run has just begun."""
        accept_children(str(working_folder(self.out)))

    def teardown(self, worker: Worker) -> None:
        """The worker goes, or another run takes this plugin's place."""
        stop_children(str(working_folder(self.out)))


@contextmanager
def join_cluster(address: str, out: Path | str, patience_s: float = 0.0) -> Iterator[Client]:
    """A client of the cluster at ``address``, closed after the block; its workers may have children for ``out``.

    Waits for ``patience_s`` for a scheduler that has a worker. Raises ``UsageError`` where there is none, or where its
    workers cannot do the work.
    """
    with _connect(address, time.monotonic() + patience_s) as client:
        _check_workers(client, address, out)
        plugin = StopChildren(out)
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
    if is_url(out):
        return
    sign, text = Path(out) / SIGN, uuid.uuid4().hex
    try:
        sign.parent.mkdir(parents=True, exist_ok=True)
        sign.write_text(text, encoding="ascii")
    except OSError:  # a disk that is full; who cannot write there for good has been refused already
        return
    try:
        _ask_all(client, "cannot tell what is in the output folder ({})", refuse_other_folder, str(sign), text)
    finally:
        with contextlib.suppress(OSError):
            sign.unlink()


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


def _ask_all(client: Client, words: str, question: object, *args: object) -> None:
    answers = client.run(question, *args, on_error="return")
    for worker, answer in answers.items():
        if isinstance(answer, UsageError):
            raise UsageError(f"worker {worker}: {answer}")
        if isinstance(answer, Exception):
            raise UsageError(f"worker {worker} {words.format(answer)}")
