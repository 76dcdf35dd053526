"""Quick runs of one method for tests: in one engine, with a model that records its requests."""

from collections.abc import Callable
from pathlib import Path

from schemas.asset import AssetRecord, AssetRef
from schemas.request import ModelAnswer, ModelCall, ModelRequest
from schemas.settings import EngineSettings, MethodSettings, ModelSettings, Settings, ViewSettings
from schemas.vocabulary import Engine, Method
from tasks.pipeline import refine_asset
from tests.assets import prior
from tests.factories import make_call

LOOKING = ModelSettings(model="openai/scripted", image_side_px=64)
"""A model that accepts images, so that views are rendered for it."""


def settings_of(method: Method, model: ModelSettings | None = None, queries: int = 5) -> Settings:
    return Settings(
        method=method,
        methods=MethodSettings(ivw_queries=queries),
        model=model or ModelSettings(),
        views=ViewSettings(width=32, height=32, write=False),
        engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
    )


class Listener:
    """Answers by ``reply``, and keeps every request; every answer costs one call."""

    def __init__(self, reply: Callable[[ModelRequest], ModelAnswer] = prior) -> None:
        self.reply = reply
        self.requests: list[ModelRequest] = []

    def __call__(self, request: ModelRequest) -> ModelAnswer:
        self.requests.append(request)
        return self.reply(request).model_copy(update={"calls": (call(request),)})


def call(request: ModelRequest) -> ModelCall:
    return make_call(purpose=request.purpose, latency_s=float(request.sample))


def run(ref: AssetRef, out: Path, settings: Settings, reply: Callable[[ModelRequest], ModelAnswer] = prior) -> (
    tuple[AssetRecord, list[ModelRequest]]
):  # fmt: skip
    """The record of one asset and every request that was made for it."""
    listener = Listener(reply)
    return refine_asset(ref, out, settings, listener), listener.requests
