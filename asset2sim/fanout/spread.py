"""Assets to futures and back: a bounded number in flight, records as they finish, the lost tried once more alone."""

import time
import uuid
from collections.abc import Callable, Iterator, Sequence

from distributed import Client, Future, as_completed

from asset2sim.fanout.cluster import concurrency
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import Asset2SimError, UsageError

IN_FLIGHT_PER_THREAD = 2
"""Futures per worker thread: one at work, and one waiting so that no worker waits for the client."""

QUIET_S = 1.0
"""After an interruption, time without another finished future after which no more are waited for, s."""

Work = Callable[[AssetRef], AssetRecord]


class LostClusterError(Asset2SimError):
    """The scheduler went away in the middle of a run."""


def spread(
    client: Client, refs: Sequence[AssetRef], work: Work, fail: Callable[[AssetRef, str], AssetRecord]
) -> Iterator[AssetRecord]:
    """The record of every asset, in the order in which they finish.

    ``work`` answers with a record for everything that can happen to an asset, so a future that fails has lost its
    worker: the asset is tried once more when nothing else runs, and ``fail(ref, reason)`` is its record if that is
    lost too. Raises ``UsageError`` as the work does and ``LostClusterError`` when the scheduler is gone. Leaving the
    iterator early cancels what is still in flight.
    """
    waiting = iter(refs)
    at_work: dict[Future[AssetRecord], AssetRef] = {}
    lost: list[AssetRef] = []
    done: as_completed = as_completed()

    def submit_next() -> None:
        ref = next(waiting, None)
        if ref is not None:
            future = _submit(client, work, ref)
            at_work[future] = ref
            done.add(future)

    try:
        for _ in range(IN_FLIGHT_PER_THREAD * concurrency(client)):
            submit_next()
        for future in done:
            # Only what has been collected is taken out: an interruption may come while the record is being fetched.
            record, _ = _collect(client, future)
            ref = at_work.pop(future)
            submit_next()
            if record is None:
                lost.append(ref)
            else:
                yield record
    except KeyboardInterrupt:
        yield from _already_finished(client, at_work)
        raise
    finally:
        if at_work:
            client.cancel(list(at_work), force=True)
    for ref in lost:
        record, reason = _collect(client, _submit(client, work, ref))
        yield record if record is not None else fail(ref, f"its Dask worker was lost twice: {reason}")


def _already_finished(client: Client, at_work: dict[Future[AssetRecord], AssetRef]) -> list[AssetRecord]:
    """What has finished and was only waiting to be fetched; taken out of ``at_work``.

    The word that a future is done may itself be on its way, so this ends when none has come for ``QUIET_S``.
    """
    records: list[AssetRecord] = []
    quiet_since = time.monotonic()
    while at_work and time.monotonic() - quiet_since < QUIET_S:
        for future in [future for future in at_work if future.status == "finished"]:
            record, _ = _collect(client, future)
            del at_work[future]
            if record is not None:
                records.append(record)
            quiet_since = time.monotonic()
        time.sleep(QUIET_S / 10.0)
    return records


def _submit(client: Client, work: Work, ref: AssetRef) -> Future[AssetRecord]:
    # A key of its own for each attempt: Dask would answer a second one with the first one's failure.
    return client.submit(work, ref, pure=False, key=f"refine-{ref.asset_id}-{uuid.uuid4().hex}")


def _collect(client: Client, future: Future[AssetRecord]) -> tuple[AssetRecord | None, str]:
    """The future's record, or None and why there is none."""
    try:
        record = future.result()
    except UsageError:
        raise
    except Exception as error:  # whatever Dask says of a lost worker: KilledWorker, CancelledError, CommClosedError, …
        if client.status != "running":
            raise LostClusterError("the Dask scheduler went away; what had finished is kept") from error
        future.release()
        return None, f"{type(error).__name__}: {error}".splitlines()[0]
    # Or Dask would compute it again when the worker that holds the result is lost.
    future.release()
    assert isinstance(record, AssetRecord)
    return record, ""
