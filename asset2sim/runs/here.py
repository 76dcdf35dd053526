"""Single objects on this machine, each in a killable child: no scheduler, no catalog, no report."""

import uuid
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from asset2sim.experiments.isolation import stop_children
from asset2sim.experiments.isolation.children import warm_up
from asset2sim.runs.asking_attempt import attempt_asset
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import UsageError
from schemas.settings import Settings

NEEDS_PIPELINE = ("model.run_calls", "model.run_tokens", "model.run_usd", "run.gate", "run.hook", "run.keep_days",
                  "run.max_new_failures", "run.min_success", "run.scheduler")  # fmt: skip
"""Settings that only a run over a dataset follows."""


def each_here(
    attempt: Callable[[AssetRef], AssetRecord], refs: Sequence[AssetRef], owner: str, pipeline: str, workers: int
) -> list[AssetRecord]:
    """The record of each asset, in their order, so many ``workers`` at a time. Ctrl-C stops the children that belong to
    ``owner``."""
    warm_up(pipeline)
    pool = ThreadPoolExecutor(workers)
    try:
        return list(pool.map(attempt, refs))
    except KeyboardInterrupt:
        stop_children(owner)
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def refine_here(refs: Sequence[AssetRef], out: Path, settings: Settings, pipeline: str) -> list[AssetRecord]:
    """The record of each asset refined into ``out/assets`` by ``pipeline`` (``module:function``), in their order.
    Raises UsageError for settings that only a run follows."""
    stated = settings.model_dump(exclude_defaults=True)
    asked = [name for name in NEEDS_PIPELINE if name.partition(".")[2] in stated.get(name.partition(".")[0], {})]
    if asked:
        raise UsageError(f"{', '.join(asked)}: runs over a dataset follow them; pip install 'asset2sim[pipeline]'")
    out, run_id = out.absolute(), uuid.uuid4().hex

    def attempt(ref: AssetRef) -> AssetRecord:
        return attempt_asset(ref, out, settings, pipeline, run_id, lambda calls: None, fresh=False).record

    return each_here(attempt, refs, str(out), pipeline, settings.run.workers)
