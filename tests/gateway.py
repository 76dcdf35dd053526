"""Helpers of the gateway's tests: keys that are set or not, a question, and how it is asked of a server here."""

from collections.abc import Sequence

import pytest

from asset2sim.models.gateway.ask import ask
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import ModelSettings
from tests.model_server import ModelServer, Reply, Script, forget_refusals, serve

KEYS = ("OPENAI", "ANTHROPIC", "GEMINI", "GOOGLE", "OPENROUTER")
REQUEST = ModelRequest(purpose="synthesis", system="Answer in JSON.", text="What is it?")


@pytest.fixture
def no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    """Unset the keys of model providers: those of the user who runs the tests must not be used."""
    for name in (*(f"{key}_API_KEY" for key in KEYS), "OPENAI_API_BASE"):
        monkeypatch.delenv(name, raising=False)
    forget_refusals()


@pytest.fixture
def one_key(no_keys: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "test-key-0123456789")


def settings(api_base: str, **changes: object) -> ModelSettings:
    fields = {"model": "openai/scripted", "api_base": api_base, "timeout_s": 60.0, **changes}
    return ModelSettings.model_validate(fields)


def asked(
    replies: Sequence[Reply] | Script, request: ModelRequest = REQUEST, **changes: object
) -> tuple[ModelServer, ModelAnswer]:
    """One question to a server with these replies: the server, which is closed, and what came of it."""
    with serve(replies) as server:
        return server, ask(request, settings(server.api_base, **changes))
