"""All assets of a run, refined on a cluster: what finished, and why it stopped if it did."""

import logging
import threading
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from distributed import Client

from asset2sim.fanout.cluster import open_client
from asset2sim.fanout.interrupt import terminated_as_interrupted
from asset2sim.fanout.progress import progress
from asset2sim.fanout.spread import LostClusterError, spread
from asset2sim.fanout.worker import PIPELINE, refine_on_worker
from asset2sim.isolation import accept_children, stop_children
from asset2sim.isolation.asset import failed_record
from asset2sim.isolation.server import warm_up
from asset2sim.models.lite import load_litellm
from asset2sim.run_result import INTERRUPTED
from schemas.asset import AssetRecord, AssetRef, Unchanged
from schemas.settings import Settings
from schemas.vocabulary import FailureMode

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Refined:
    """The records of the assets that finished, in the dataset's order; ``stopped`` says why that is not all of them,
    and ``unchanged`` which there was no need to refine."""

    records: tuple[AssetRecord, ...]
    stopped: str | None
    unchanged: tuple[Unchanged, ...] = ()


def as_it_is(record: AssetRecord) -> AssetRecord:
    """The record."""
    return record


def refine_all(
    refs: Sequence[AssetRef],
    out: Path,
    settings: Settings,
    pipeline: str = PIPELINE,
    run_id: str | None = None,
    finished: Callable[[AssetRecord], AssetRecord] = as_it_is,
) -> Refined:
    """Refine every asset into ``out`` (absolute), on the cluster of ``settings.run``.

    ``run_id`` names the run whose budget the model calls count towards; None is a run of its own.
    ``finished`` is called with each record as it comes in; what it answers is the record from there on.
    Ctrl-C, SIGTERM and the loss of the cluster end it early, with no child process left and with the records so far.
    """
    if not refs:
        return Refined((), None)
    records: list[AssetRecord] = []
    stopped: str | None = None
    accept_children(str(out))
    warm_up()
    if settings.run.scheduler is None:
        threading.Thread(target=load_litellm, daemon=True).start()
    client_of_run = open_client(settings.run)
    with terminated_as_interrupted(), client_of_run as client, progress(len(refs)) as report:
        work = partial(
            refine_on_worker, out=out, settings=settings, pipeline=pipeline, run_id=run_id or uuid.uuid4().hex
        )
        try:
            for record in spread(client, refs, work, partial(_lost, settings=settings)):
                records.append(finished(record))
                report(record)
        except KeyboardInterrupt:
            stopped = INTERRUPTED
            _stop(client, out, settings)
        except LostClusterError as error:
            stopped = str(error)
    place = {ref.asset_id: number for number, ref in enumerate(refs)}
    return Refined(tuple(sorted(records, key=lambda record: place[record.ref.asset_id])), stopped)


def _lost(ref: AssetRef, reason: str, settings: Settings) -> AssetRecord:
    return failed_record(ref, settings, FailureMode.ENGINE_CRASH, reason)


def _stop(client: Client, out: Path, settings: Settings) -> None:
    """Kill this run's children, here or on the workers of another's cluster, which must accept a later run's again."""
    if settings.run.scheduler is None:
        stop_children(str(out))
        return
    try:
        client.run(stop_children, str(out))
        client.run(accept_children, str(out))
    except (OSError, TimeoutError) as error:
        logger.warning("cannot stop the workers (%s); what they still do ends with its time limit", error)
