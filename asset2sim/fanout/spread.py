"""Assets to futures and back: a bounded number in flight, records as they finish, the lost tried once more alone."""

import uuid
from collections.abc import Callable, Iterator, Sequence

from distributed import Client, Future, as_completed

from asset2sim.fanout.cluster import concurrency
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import Asset2SimError, UsageError

IN_FLIGHT_PER_THREAD = 2
"""Futures per worker thread: one at work, and one waiting so that no worker waits for the client."""

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
            ref = at_work.pop(future)
            record, _ = _collect(client, future)
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
    """What has finished and was only waiting to be fetched; taken out of ``at_work``."""
    finished = [future for future in at_work if future.status == "finished"]
    collected = [_collect(client, future)[0] for future in finished]
    for future in finished:
        del at_work[future]
    return [record for record in collected if record is not None]


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
        return None, f"{type(error).__name__}: {error}".splitlines()[0]
    finally:
        # Or Dask would compute it again when the worker that holds the result is lost.
        future.release()
    assert isinstance(record, AssetRecord)
    return record, ""
