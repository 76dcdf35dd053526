"""Attempts at assets in child processes, whose questions this process asks its models: one, or several at once."""

import uuid
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

from asset2sim.experiments.isolation.children import warm_up
from asset2sim.experiments.isolation.supervise import each_in_threads, is_stopped
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import open_gateway_session
from asset2sim.runs.asset_attempt import AssetAttempt, attempt_in_child
from asset2sim.runs.remote.transfer import run_with_local_files, with_local_packages
from asset2sim.storage.objects import working_folder
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import UsageError
from schemas.location import Location
from schemas.request import ModelAnswer, ModelCall, ModelRequest
from schemas.settings import ModelSettings, Settings
from schemas.vocabulary import Method


def attempt_asset(
    ref: AssetRef,
    out: Path | str,
    settings: Settings,
    pipeline: str,
    run_id: str,
    made: Callable[[Iterable[ModelCall]], None],
    fresh: bool,
    recordings: str = "",
) -> AssetAttempt:
    """Attempt one asset in a child process, into ``out``, a folder or a URL. Model calls are made in this process and
    passed to ``made``. A ``fresh`` child has refined nothing before; ``recordings``: see ``GatewaySession``."""
    folder, owner = working_folder(out), str(out)
    stopped = partial(is_stopped, owner)
    patience_s = settings.run.asset_time_limit_s
    books = open_gateway_session(folder, run_id, ref.asset_id, settings.model, stopped, Path(recordings), patience_s)

    def ask_and_tell(request: ModelRequest) -> ModelAnswer:
        answer = ask(request, ask_settings(settings, request.purpose, request.sample), books)
        made(answer.calls)
        return answer

    attempt = partial(
        attempt_in_child,
        pipeline,
        out=folder,
        settings=with_local_packages(settings),
        ask=ask_and_tell,
        owner=owner,
        fresh=fresh,
    )
    place = Location(out)
    if place.is_url or Location(ref.path).is_url:
        return run_with_local_files(ref, place, settings, attempt)
    return attempt(ref)


def ask_settings(settings: Settings, purpose: str, sample: int = 0) -> ModelSettings:
    """Model settings of a question: one that is repeated to measure the spread has a temperature."""
    if purpose == Method.IVW:
        return settings.model.model_copy(update={"temperature": settings.methods.ivw_temperature})
    if sample > 0:
        return settings.model.model_copy(update={"temperature": settings.doubt.sample_temperature})
    return settings.model


NEEDS_PIPELINE = ("model.run_calls", "model.run_tokens", "model.run_usd", "run.gate", "run.hook", "run.keep_days",
                  "run.max_new_failures", "run.min_success", "run.scheduler")  # fmt: skip
"""Settings that only a run over a dataset follows."""


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

    warm_up(pipeline)
    return each_in_threads(attempt, refs, str(out), settings.run.workers)
