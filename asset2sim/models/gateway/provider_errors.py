"""Classification of a provider's errors: whether to retry, how long to wait, and the message for the user."""

import random
import re
import time
from collections.abc import Iterator
from email.utils import parsedate_to_datetime
from typing import Any

from asset2sim.models.gateway.environment import key_variable, listed, unset_variables
from schemas.errors import UnreadableAnswerError, shortened
from schemas.secret import REDACTED, redact, redacted_address, secret_parts
from schemas.settings import ModelSettings

BACKOFF_FIRST_S = 0.5
"""Mean of the first wait, s; every further one is twice as long."""
BACKOFF_LONGEST_S = 60.0
"""Longest wait, s, whatever the provider asks for: rate limits are mostly counted per minute."""
CAUSE_LENGTH = 300
"""Characters kept of what the provider said."""
MAX_CHAIN = 20
"""Longest chain of causes of an exception that is followed: a chain may be a ring."""

_CLASS_NAMES = re.compile(r"^(?:(?:litellm\.)?\w*(?:Error|Exception|Timeout)(?::| -) )+")


def status_of(error: BaseException) -> int | None:
    """The HTTP status that a LiteLLM exception stands for, if any."""
    status = getattr(error, "status_code", None)
    return status if isinstance(status, int) else None


def is_worth_retrying(error: BaseException) -> bool:
    """True for rate limits, timeouts, server faults and lost connections; False where asking again cannot help."""
    if "insufficient_quota" in str(error) or unreadable_answer(error) is not None:
        return False
    status = status_of(error)
    return status is not None and (status in (408, 429) or status >= 500)


def may_be_billed(error: BaseException) -> bool:
    """Whether the provider may have answered and billed the tokens although no answer was received."""
    return status_of(error) == 408 or unreadable_answer(error) is not None


def unreadable_answer(error: BaseException) -> UnreadableAnswerError | None:
    """The ``UnreadableAnswerError`` among an exception's causes; None without one."""
    return next((item for item in _chain(error) if isinstance(item, UnreadableAnswerError)), None)


def _chain(error: BaseException) -> Iterator[BaseException]:
    """The exception and those that led to it."""
    item: BaseException | None = error
    for _ in range(MAX_CHAIN):
        if item is None:
            return
        yield item
        item = item.__cause__ or item.__context__


def retry_delay_s(error: BaseException, attempt: int) -> float:
    """Seconds to wait after this attempt, the first being 1: what ``Retry-After`` asks, else exponential; jittered."""
    asked = retry_after_s(error)
    if asked is not None:
        # Jitter is only added: a retry before the time that was asked for would be refused.
        return min(asked + random.uniform(0.0, BACKOFF_FIRST_S / 2.0), BACKOFF_LONGEST_S)
    return min(BACKOFF_FIRST_S * 2.0 ** (attempt - 1), BACKOFF_LONGEST_S) * random.uniform(0.5, 1.5)


def retry_after_s(error: BaseException) -> float | None:
    """The provider's ``Retry-After`` in seconds from now, stated as number or date; None if there is none usable."""
    text = _header(error, "retry-after")
    if text is None:
        return None
    try:
        seconds = float(text)
    except ValueError:
        try:
            seconds = parsedate_to_datetime(text).timestamp() - time.time()
        except ValueError:
            return None
    return max(seconds, 0.0) if seconds == seconds else None


def _header(error: BaseException, name: str) -> str | None:
    response = getattr(error, "response", None)
    for headers in (getattr(error, "litellm_response_headers", None), getattr(response, "headers", None)):
        value: Any = headers.get(name) if headers is not None else None
        if value is not None:
            return str(value)
    return None


def describe(error: BaseException, settings: ModelSettings, attempts: int) -> str:
    """One line: the model, what went wrong, and what to do about it."""
    tries = f" ({attempts} attempts)" if attempts > 1 else ""
    refused = unreadable_answer(error)
    if refused is not None:
        return f"model '{settings.model}': {refused}{tries}"
    said = cause(error)
    for part in secret_parts(settings.api_base):
        said = said.replace(part, REDACTED)
    return f"model '{settings.model}': {_cause_and_remedy(error, settings)}{tries}; provider said: {said}"


def _cause_and_remedy(error: BaseException, settings: ModelSettings) -> str:
    status = status_of(error)
    place = f" at {redact(redacted_address(settings.api_base))}" if settings.api_base else ""
    if status in (401, 403):
        unset = unset_variables(settings.model)
        if unset:
            return f"the provider{place} wants a key ({status}): set {listed(unset)} in the environment"
        where = f"the key in {variable}" if (variable := key_variable(settings.model)) else "the provider's key"
        return f"the provider{place} refused the key ({status}): check {where} and what it may use"
    if status == 402 or "insufficient_quota" in str(error):
        return f"the account has no credit left ({status}): top it up, or choose another model"
    if status == 404:
        return f"not found{place} (404): check the model's name and api_base"
    if status == 429:
        return "rate limit (429): use fewer workers, wait, or raise max_attempts"
    if status == 408:
        limit = "raise timeout_s (or --asset-timeout)"
        return f"no answer{place} within {settings.timeout_s:.3g} s: {limit}, or choose a faster model"
    if _is_connection_failure(error):
        return f"could not be reached{place}: check the network and api_base"
    if status is not None and status >= 500:
        return f"the provider{place} failed ({status}): try again later"
    if status is not None:
        return f"the request was refused ({status}): choose another model, or look at what the provider said"
    return "the call failed"


def _is_connection_failure(error: BaseException) -> bool:
    names = [type(seen).__name__ for seen in _chain(error)]
    lost = any("connect" in name.lower() and "APIConnectionError" not in name for name in names)
    return lost or "Connection error" in str(error)


def cause(error: BaseException) -> str:
    """The exception's own message on one line, shortened and without secrets."""
    text = re.sub(r"Traceback \(most recent call last\).*", "", str(error), flags=re.DOTALL)
    text = _CLASS_NAMES.sub("", redact(" ".join(text.split())))
    return shortened(text, CAUSE_LENGTH)
