"""The same work without orchestration: ``python -m lab.flows.bench_loop RESULT STARTED refine DATA --out OUT …``.

Assets are refined one after the other in this process, with model calls through the gateway as in a worker: no
Prefect, no Dask, no child process, no catalog. What a run's child process finds ready (imported engines, one thread,
LiteLLM loaded in its parent) is made ready here before the clock starts.
"""

import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from asset2sim.experiments.isolation.children import ONE_THREAD
from asset2sim.models.gateway.session import open_gateway_session
from asset2sim.runs.asking_attempt import ask_for_asset
from asset2sim.runs.check_request import check_request
from asset2sim.runs.request import RefineRequest, parse_request
from asset2sim.storage.objects import working_folder
from lab.speed.measured import LoopTimes
from lab.speed.process import BenchError, measure
from schemas.vocabulary import Status

MODULE = "lab.flows.bench_loop"
RUN_ID = "plain-loop"


def run_loop(words: Sequence[str], place: Path) -> LoopTimes:
    """Times of the loop over a command line's assets, in its own process; ``problem`` if a crash ended it."""
    at = _at(place.with_suffix(".json"))
    at.unlink(missing_ok=True)
    try:
        return measure(LoopTimes, MODULE, words, place, ONE_THREAD)
    except BenchError as error:
        died_at = at.read_text(encoding="utf-8") if at.is_file() else None
        return LoopTimes(assets=0, ok=0, loop_s=0.0, died_at=died_at, problem=str(error))


def loop(request: RefineRequest, at: Path) -> LoopTimes:
    """Refine every asset of a request in this process; the file ``at`` names the current one."""
    out = working_folder(request.out).resolve()
    found = check_request(request.data, out, request.settings, request.subset, request.asset_ids, request.limit)
    import asset2sim.experiments.isolation.preload  # noqa: F401
    from tasks.pipeline import refine_asset

    ok, started = 0, time.monotonic()
    for ref in found.refs:
        at.write_text(ref.asset_id, encoding="utf-8")
        books = open_gateway_session(out, RUN_ID, ref.asset_id, request.settings.model)
        ask = partial(ask_for_asset, settings=request.settings, books=books)
        ok += refine_asset(ref, out, request.settings, ask).status is Status.OK
    return LoopTimes(assets=len(found.refs), ok=ok, loop_s=time.monotonic() - started)


def main(words: Sequence[str]) -> int:
    """Run the loop and write its numbers."""
    result = Path(words[0])
    times = loop(parse_request(words[2:]), _at(result))
    result.write_text(times.model_dump_json(), encoding="utf-8")
    return 0


def _at(result: Path) -> Path:
    return result.with_suffix(".at")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
