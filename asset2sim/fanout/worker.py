"""What a Dask worker does with one asset: a child process for the work, this process for the model calls."""

import uuid
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from asset2sim.catalog.storage.cache import working_folder
from asset2sim.isolation.asset import Attempt, attempt_in_child
from asset2sim.isolation.stopping import is_stopped
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import Books, open_books
from asset2sim.remote.worker import with_files
from schemas.asset import AssetRef
from schemas.request import ModelAnswer, ModelCall, ModelRequest
from schemas.settings import ModelSettings, Settings
from schemas.vocabulary import Method

PIPELINE = "asset2sim.pipeline:refine_asset"
"""The pipeline by name, so that neither the flow nor a worker imports the engines: only the children do."""


def _forget(calls: Iterable[ModelCall]) -> None:
    return None


def attempt_asset(
    ref: AssetRef,
    out: Path | str,
    settings: Settings,
    pipeline: str = PIPELINE,
    run_id: str | None = None,
    made: Callable[[Iterable[ModelCall]], None] = _forget,
    fresh: bool = False,
) -> Attempt:
    """One attempt at one asset, in a child process, into OUT, a folder or a URL; the model calls are made here, and
    ``made`` is told of them. A ``fresh`` child has refined nothing before."""
    folder, owner = working_folder(out), str(out)
    stopped = partial(is_stopped, owner)
    books = open_books(folder, run_id or uuid.uuid4().hex, ref.asset_id, settings.model, stopped)

    def ask_and_tell(request: ModelRequest) -> ModelAnswer:
        answer = ask_for_asset(request, settings, books)
        made(answer.calls)
        return answer

    def attempt(local: AssetRef) -> Attempt:
        return attempt_in_child(pipeline, local, folder, settings, ask_and_tell, owner, fresh)

    return with_files(ref, out, settings, attempt)


def ask_for_asset(request: ModelRequest, settings: Settings, books: Books) -> ModelAnswer:
    """The answer to one of an asset's questions, asked as its method wants it asked."""
    return ask(request, asked_with(settings, request.purpose), books)


def asked_with(settings: Settings, purpose: str) -> ModelSettings:
    """How a purpose is asked: repeats of one question, whose spread is what they are asked for, at a temperature."""
    if purpose == Method.IVW:
        return settings.model.model_copy(update={"temperature": settings.methods.ivw_temperature})
    return settings.model
