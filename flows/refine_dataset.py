"""Refine a dataset: discover, refine, publish, log, report."""

import sys
from pathlib import Path

from prefect import flow

from asset2sim.catalog.lock import lock_output
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.running import begin_run, end_run
from asset2sim.catalog.store import check_catalog
from asset2sim.disk import named_full_disk
from asset2sim.fanout.worker import PIPELINE
from asset2sim.run_result import RunResult
from schemas.settings import Settings
from tasks.align import align, find_references
from tasks.discover import discover
from tasks.log_run import log_run
from tasks.opaque import opaque
from tasks.plan import plan
from tasks.publish import publish
from tasks.refine_assets import refine_assets
from tasks.report import find_previous, report


@flow(name="refine-dataset", persist_result=False)
def refine_dataset(
    data: Path,
    out: Path,
    settings: Settings | None = None,
    subset: str | None = None,
    asset_ids: tuple[str, ...] = (),
    limit: int | None = None,
    pipeline: str = PIPELINE,
) -> RunResult:
    """Refine the chosen assets of ``data`` into ``out``, as far as they changed, and publish what came of it; see
    ``RunResult``.

    An asset that fails is a row. Raises ``UsageError`` for a request that cannot be met, before anything is written.
    """
    data, out, settings = Path(data).resolve(), Path(out).resolve(), settings or Settings()
    refs = discover(data, out, settings, subset, asset_ids, limit)
    references = find_references(data)
    # Only a run over all of a dataset can tell what left it.
    whole = subset is None and not asset_ids and limit is None
    present = frozenset(ref.asset_id for ref in refs) if whole else None
    with named_full_disk(out), lock_output(out):
        check_catalog(out)
        started = start_run(settings, str(data), subset)
        died = begin_run(out, started)
        todo = plan(opaque(refs), opaque(references), out, settings, pipeline, started.run_id)
        refined = refine_assets(opaque(refs), opaque(todo), out, settings, started.run_id, pipeline)
        refined = align(opaque(refined), opaque(references))
        run = finish_run(started, "interrupted" if refined.stopped else "finished")
        previous = find_previous(out, run, opaque(present))
        publish(out, run, opaque(refined), opaque(present))
        end_run(out)
        told = report(out, run, opaque(refined), opaque(previous), len(refs), died)
        # Whoever presses Ctrl-C wants out: MLflow alone takes seconds.
        warning = None if refined.stopped else log_run(out, run, opaque(refined), opaque(told.changes))
    warnings = (*told.warnings, *((warning,) if warning else ()))
    return RunResult(out, run, refined.records, refined.stopped, warnings, refined.unchanged, told.path, told.changes)


if __name__ == "__main__":
    from flows.command import main

    sys.exit(main(["refine", *sys.argv[1:]]))
