"""Submit jobs as Dask futures, a bounded number in flight, and hand over each result as it comes."""

import uuid
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice

from distributed import Client, Future, as_completed
from distributed.client import FutureCancelledError

from asset2sim.runs.spread.job import Job, JobResult
from schemas.errors import Asset2SimError, UsageError

IN_FLIGHT_PER_THREAD = 2
"""Futures per worker thread: one at work, and one waiting so that no worker waits for the client."""

SCHEDULER_LOST = "scheduler-connection-lost"
"""Dask's reason on futures that it cancels because the scheduler was lost, even if it is back by now."""

RefineJob = Callable[[Job], JobResult]
InFlight = dict[Future[JobResult], Job]


@dataclass(frozen=True)
class LostJob:
    """A job without a result: its Dask worker was lost, for this ``reason``."""

    reason: str


class LostClusterError(Asset2SimError):
    """The scheduler went away in the middle of a run."""


def spread(
    client: Client,
    jobs: Iterable[Job],
    work: RefineJob,
    most: int,
    in_flight: InFlight,
    take: Callable[[Job, JobResult | LostJob], None],
) -> None:
    """Run every job, at most ``most`` of them submitted at a time, and call ``take`` with each as it ends.

    ``work`` turns every failure of an asset into a result, so a future that fails has lost its worker.
    ``in_flight`` holds the futures submitted and not taken, also after an exception: the caller cancels them.
    Raises ``UsageError`` as the work does and ``LostClusterError`` when the scheduler is gone.
    """
    waiting = iter(jobs)
    done: as_completed = as_completed()

    def submit(count: int) -> None:
        for job in islice(waiting, count):
            # A key of its own for each attempt: Dask would answer a second one with the first one's failure.
            key = f"refine-{job.ref.asset_id}-{uuid.uuid4().hex}"
            future = client.submit(work, job, pure=False, key=key)
            in_flight[future] = job
            done.add(future)

    submit(most)
    for future in done:
        take(in_flight[future], _collect(client, future))
        # Removed only once taken: an interruption may come in between.
        del in_flight[future]
        submit(1)


def _collect(client: Client, future: Future[JobResult]) -> JobResult | LostJob:
    """The future's answer, or why there is none."""
    try:
        done = future.result()
    except UsageError:
        raise
    except Exception as error:  # whatever Dask says of a lost worker: KilledWorker, CancelledError, CommClosedError, …
        if client.status != "running" or (isinstance(error, FutureCancelledError) and error.reason == SCHEDULER_LOST):
            raise LostClusterError("the Dask scheduler went away; what had finished is kept") from error
        future.release()
        return LostJob(f"{type(error).__name__}: {error}".splitlines()[0])
    # Or Dask would compute it again when the worker that holds the result is lost.
    future.release()
    assert isinstance(done, JobResult)
    return done
