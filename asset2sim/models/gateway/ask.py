"""One question to any model, through LiteLLM: cached, retried and counted; failures are returned, not raised."""

import hashlib
import re
import sqlite3
import time
from dataclasses import dataclass
from typing import Any

from asset2sim.models.gateway import abilities, provider_errors
from asset2sim.models.gateway.abilities import AttemptOptions
from asset2sim.models.gateway.answer_cache import StoredAnswer, answer_file, answer_key, read_answer, store_answer
from asset2sim.models.gateway.budget import Amount, BudgetSpentError, cost_usd
from asset2sim.models.gateway.chat_messages import downscaled
from asset2sim.models.gateway.environment import listed, missing_variables
from asset2sim.models.gateway.litellm_call import attempt
from asset2sim.models.gateway.questions import keep_question
from asset2sim.models.gateway.rate_limits import RunStoppedError, never_stopped
from asset2sim.models.gateway.recorded import RecordingError, UnrecordedError, find_answer
from asset2sim.models.gateway.session import GatewaySession, call_permit, delay_provider_calls, pause
from schemas.model_names import is_recorded, model_for, recorded_folder, settings_for
from schemas.request import ModelAnswer, ModelCall, ModelRequest, ToolCall
from schemas.secret import redact, redact_answer
from schemas.settings import ModelSettings

LEAST_WAIT_S = 1.0
"""Least time for an answer, s, however much of the asset's time others took."""
_TITLE = re.compile(r"Prompt: (.{1,100})\n")


def ask(request: ModelRequest, settings: ModelSettings, session: GatewaySession | None = None) -> ModelAnswer:
    """The answer of the model that the settings name for the request's purpose, with a ``ModelCall`` per attempt.

    A recorded model answers from its folder, at what the answer once cost; no budget holds for it. Any other answer in
    the cache of ``session`` is returned at no cost. Otherwise the model is asked at most
    ``max_attempts`` times, again only where the provider answers 429, 5xx or not at all, after a jittered wait. Where a
    server refuses images or an answer format as such (400, 415, 422), it is asked once more without, beyond those
    attempts. Every failure comes back as ``error``, one line that names the model, the cause and the remedy; a spent
    budget as ``budget_spent`` too.
    """
    settings = settings_for(settings, model_for(settings, request.purpose))
    if session is not None and session.questions is not None:
        keep_question(session.questions, prompt_hash(request), request)
    if is_recorded(settings.model):
        return _recorded(request, settings, session)
    start = time.monotonic()
    sees = abilities.model_abilities(settings.model).images
    if sees:
        request = downscaled(request, settings.image_side_px)
    answers = None if session is None else session.answers
    if answers is None:
        return _ask_provider(request, settings, session)
    key = answer_key(request, settings, sees)
    stored = read_answer(answers, key)
    if stored is not None:
        call = _call(request, settings, time.monotonic() - start, "cached")
        call = call.model_copy(update={"answer_file": answer_file(key)})
        return ModelAnswer(
            content=stored.content, calls=(call,), tool_calls=stored.tool_calls, without_images=stored.without_images
        )
    answer = _ask_provider(request, settings, session)
    if answer.content or answer.tool_calls:
        last = answer.calls[-1]
        kept = StoredAnswer(
            model=settings.model,
            purpose=request.purpose,
            prompt=prompt_title(request),
            prompt_hash=prompt_hash(request),
            content=answer.content,
            tool_calls=answer.tool_calls,
            without_images=answer.without_images,
            prompt_tokens=last.prompt_tokens,
            completion_tokens=last.completion_tokens,
            cost_usd=last.cost_usd,
        )
        store_answer(answers, key, kept)
        last = last.model_copy(update={"answer_file": answer_file(key)})
        answer = answer.model_copy(update={"calls": (*answer.calls[:-1], last)})
    return answer


def prompt_title(request: ModelRequest) -> str | None:
    """Name and version of the prompt, as its first line has them; None for a text without."""
    found = _TITLE.match(request.system)
    return found.group(1) if found else None


def _recorded(request: ModelRequest, settings: ModelSettings, session: GatewaySession | None) -> ModelAnswer:
    """The recorded answer to the next question of the request's purpose, as a call that took what is recorded."""
    start = time.monotonic()
    try:
        if session is None:
            raise RecordingError("recorded answers are of assets, and no asset is asked about")
        number = session.count_question(settings.model, request.purpose)
        folder = session.recordings / recorded_folder(settings.model)
        found = find_answer(folder, session.budget.asset_id, request, number)
    except RecordingError as error:
        message, missing = f"model '{settings.model}': {error}", isinstance(error, UnrecordedError)
        return ModelAnswer(content=None, calls=(), error=message, unrecorded=missing)
    origin = found.origin
    spent = {
        "prompt_tokens": origin.prompt_tokens or 0,
        "completion_tokens": origin.completion_tokens or 0,
        "cost_usd": origin.cost_usd or 0.0,
        "answer_file": found.file,
        "answered_by": origin.model,
    }
    call = _call(request, settings, time.monotonic() - start, "ok").model_copy(update=spent)
    other = None
    if found.purpose != request.purpose:
        other = f"{found.file} was given to the question for {found.purpose}, and is asked now for {request.purpose}"
    elif origin.prompt_hash not in (None, prompt_hash(request)):
        other = f"{found.file} answers another question ({origin.prompt}) than is asked now ({prompt_title(request)})"
    return ModelAnswer(
        content=found.content,
        calls=(call,),
        tool_calls=found.tool_calls,
        without_images=origin.without_images,
        other_question=other,
    )


def prompt_hash(request: ModelRequest) -> str:
    """Sixteen hexadecimal digits of the SHA-256 over system part and text."""
    text = f"{request.system}\0{request.text}"
    return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()[:16]


def _ask_provider(request: ModelRequest, settings: ModelSettings, session: GatewaySession | None) -> ModelAnswer:
    calls: list[ModelCall] = []
    spent = False
    try:
        return _with_retries(request, settings, session, calls)
    except BudgetSpentError as error:
        reason, spent = str(error), True
    except RunStoppedError as error:
        reason = str(error)
    except (OSError, sqlite3.Error) as error:
        reason = f"the files through which workers agree cannot be used: {redact(str(error))}"
    message = f"model '{settings.model}': {reason}"
    return ModelAnswer(content=None, calls=tuple(calls), error=message, budget_spent=spent)


def _with_retries(
    request: ModelRequest, settings: ModelSettings, session: GatewaySession | None, calls: list[ModelCall]
) -> ModelAnswer:
    """The answer, or why there is none; every attempt is added to ``calls``, also where this raises."""
    options = abilities.first_attempt_options(request, settings)
    refusals: list[tuple[AttemptOptions, AttemptOptions, Exception]] = []
    tries = 0
    while True:
        if session is not None and session.patience_left_s < settings.timeout_s:
            settings = settings.model_copy(update={"timeout_s": max(session.patience_left_s, LEAST_WAIT_S)})
        tried = _try_once(request, settings, session, options)
        if session is not None:
            session.answering_s.append(tried.call.latency_s)
        calls.append(tried.call.model_copy(update={"attempt": len(calls) + 1}))
        if tried.error is None:
            for before, after, error in refusals:
                abilities.remember_refusal(before, after, error, settings)
            return _answer(tried.response, request, settings, options, calls)
        less = abilities.without_refused(options, tried.error, settings)
        if less is not None:
            refusals.append((options, less, tried.error))
            options = less
            continue
        tries += 1
        if session is not None and session.patience_left_s <= 0.0:
            tries = settings.max_attempts
        failure = _failure(tried.error, settings, len(calls), tries)
        if failure is not None:
            return ModelAnswer(content=None, calls=tuple(calls), error=failure)
        _wait(tried.error, settings, session, tries)


@dataclass(frozen=True)
class _Tried:
    """One attempt: its ``ModelCall``, and LiteLLM's response or the provider's exception."""

    call: ModelCall
    response: Any = None
    error: Exception | None = None


def _try_once(
    request: ModelRequest, settings: ModelSettings, session: GatewaySession | None, options: AttemptOptions
) -> _Tried:
    with call_permit(session, request, settings, options.images) as ticket:
        start = time.monotonic()
        try:
            response = attempt(request, settings, options, never_stopped if session is None else session.stopped)
        except RunStoppedError:
            ticket.actual = ticket.expected
            raise
        except Exception as error:
            if provider_errors.may_be_billed(error):
                ticket.actual = ticket.expected
            return _Tried(_call(request, settings, time.monotonic() - start, "provider_error"), error=error)
        said = _content(response) or (request.tools and _tool_calls(response))
        call = _call(request, settings, time.monotonic() - start, "ok" if said else "provider_error", response)
        ticket.actual = Amount(1, call.prompt_tokens + call.completion_tokens, call.cost_usd)
        return _Tried(call, response=response)


def _failure(error: Exception, settings: ModelSettings, calls: int, tries: int) -> str | None:
    """Error message after the last attempt, one line; None where another attempt may help."""
    missing = missing_variables(settings)
    if missing:
        # Some providers' clients report this as a server fault, which it is not.
        return f"model '{settings.model}': no key; set {listed(missing)} in the environment or in .env"
    if tries >= settings.max_attempts or not provider_errors.is_worth_retrying(error):
        return provider_errors.describe(error, settings, calls)
    return None


def _wait(error: Exception, settings: ModelSettings, session: GatewaySession | None, tries: int) -> None:
    seconds = provider_errors.retry_delay_s(error, tries)
    if provider_errors.retry_after_s(error) is not None:
        delay_provider_calls(session, settings, seconds)
    pause(session, seconds)


def _answer(
    response: Any, request: ModelRequest, settings: ModelSettings, options: AttemptOptions, calls: list[ModelCall]
) -> ModelAnswer:
    content, tool_calls = _content(response), _tool_calls(response)
    if content is None and (not tool_calls or not request.tools):
        return ModelAnswer(content=None, calls=tuple(calls), error=_no_content_error(response, settings, tool_calls))
    wanted = tool_calls if request.tools else ()
    return ModelAnswer(content=content, calls=tuple(calls), tool_calls=wanted, without_images=options.refusal)


def _first_choice(response: Any) -> Any:
    return next(iter(getattr(response, "choices", None) or ()), None)


def _content(response: Any) -> str | None:
    content = getattr(getattr(_first_choice(response), "message", None), "content", None)
    return _sendable(content) if isinstance(content, str) and content.strip() else None


def _tool_calls(response: Any) -> tuple[ToolCall, ...]:
    calls = getattr(getattr(_first_choice(response), "message", None), "tool_calls", None) or ()
    return tuple(
        ToolCall(
            call_id=_sendable(str(call.id or f"call_{number}")),
            name=_sendable(str(call.function.name or "")),
            arguments=_sendable(str(call.function.arguments or "")),
        )
        for number, call in enumerate(calls)
    )


def _sendable(text: str) -> str:
    """The text without our API keys, and without lone surrogates, which cannot be encoded."""
    return redact_answer(text).encode("utf-8", "replace").decode("utf-8")


def _no_content_error(response: Any, settings: ModelSettings, tool_calls: tuple[ToolCall, ...]) -> str:
    if tool_calls:
        names = ", ".join(call.name[:40] for call in tool_calls[:3])
        return f"model '{settings.model}': asked for tools that nobody offered ({names}); choose another model"
    reason = str(getattr(_first_choice(response), "finish_reason", "none given"))
    remedy = "raise max_completion_tokens" if reason == "length" else "try again, or choose another model"
    return f"model '{settings.model}': answered nothing (finish reason: {redact(reason)}); {remedy}"


def _call(
    request: ModelRequest, settings: ModelSettings, latency_s: float, outcome: str, response: Any = None
) -> ModelCall:
    usage = getattr(response, "usage", None)
    return ModelCall(
        purpose=request.purpose,
        model=settings.model,
        attempt=1,
        prompt_tokens=int(getattr(usage, "prompt_tokens", 0) or 0),
        completion_tokens=int(getattr(usage, "completion_tokens", 0) or 0),
        cost_usd=0.0 if response is None else cost_usd(response, settings.model),
        latency_s=latency_s,
        cached=outcome == "cached",
        outcome=outcome,
        prompt_hash=prompt_hash(request),
    )
