"""One call of LiteLLM, with a time limit that holds whatever the provider does."""

import functools
import threading
import time
from typing import Any

from asset2sim.models.gateway.abilities import AttemptOptions, model_abilities
from asset2sim.models.gateway.chat_messages import answer_format, chat_messages
from asset2sim.models.gateway.environment import load_litellm, runs_without_key, unset_variables
from asset2sim.models.gateway.rate_limits import STOP_POLL_S, RunStoppedError, Stopped
from asset2sim.models.prior.answer import completion
from schemas.errors import ModelError
from schemas.model_names import is_prior
from schemas.request import ModelRequest
from schemas.settings import ModelSettings

GRACE_S = 0.5
"""Time beyond the limit in which the HTTP client may end by itself, s; then its thread is abandoned."""

_NO_KEY = "no-key-needed"


class ModelTimeoutError(ModelError):
    """No complete answer within the time limit; ``status_code`` is that of LiteLLM's timeouts."""

    status_code = 408


def attempt(request: ModelRequest, settings: ModelSettings, options: AttemptOptions, stopped: Stopped) -> Any:
    """LiteLLM's response, or one of its form; raises whatever LiteLLM raises, ``PriorError``, ``ModelTimeoutError`` and
    ``RunStoppedError``. HTTP clients restart their time limit with every byte received, so the call runs on a thread
    that is abandoned when its time is up. A model of this process is called directly."""
    if is_prior(settings.model):
        messages = chat_messages(request, options.images)
        return completion(settings.model, messages, bool(request.tools), request.sample)
    call = functools.partial(load_litellm().completion, **arguments(request, settings, options))
    results: list[Any] = []
    errors: list[BaseException] = []
    done = threading.Event()

    def work() -> None:
        try:
            results.append(call())
        except BaseException as error:
            errors.append(error)
        finally:
            done.set()

    threading.Thread(target=work, name="model-call", daemon=True).start()
    deadline = time.monotonic() + settings.timeout_s + GRACE_S
    while not done.wait(max(min(STOP_POLL_S, deadline - time.monotonic()), 0.0)):
        if stopped():
            raise RunStoppedError("the run was stopped")
        if time.monotonic() >= deadline:
            raise ModelTimeoutError(f"no complete answer after {settings.timeout_s:g} s")
    if errors:
        raise errors[0]
    return results[0]


def arguments(request: ModelRequest, settings: ModelSettings, options: AttemptOptions) -> dict[str, Any]:
    """Keyword arguments of LiteLLM's ``completion``."""
    most = model_abilities(settings.model).max_output_tokens
    found: dict[str, Any] = {
        "model": settings.model,
        "messages": chat_messages(request, options.images),
        "temperature": settings.temperature,
        "max_completion_tokens": min(settings.max_completion_tokens, most or settings.max_completion_tokens),
        "timeout": settings.timeout_s,
        "max_retries": 0,  # or the provider's own client would retry behind our back, uncounted
        "num_retries": 0,
        "drop_params": True,  # reasoning models refuse a temperature, for one
    }
    if request.sample > 0:
        found["seed"] = request.sample
    if request.tools:
        found["tools"] = [{"type": "function", "function": tool.model_dump()} for tool in request.tools]
        found["_skip_mcp_handler"] = True  # or LiteLLM imports a package that it does not depend on
    wanted = answer_format(request.answer_schema, request.purpose, options.answer_format)
    if wanted is not None:
        found["response_format"] = wanted
    if settings.api_base is not None:
        found["api_base"] = settings.api_base
        # The provider's client does not start without a key, which a local server ignores.
        if runs_without_key(settings) and unset_variables(settings.model):
            found["api_key"] = _NO_KEY
    return found
