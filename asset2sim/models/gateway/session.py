"""State that the model calls of all assets share: the answer cache, budgets and rate limits."""

import contextlib
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from asset2sim.models.gateway import answer_cache, questions, rate_limits
from asset2sim.models.gateway.budget import (
    Amount,
    Budget,
    BudgetSpentError,
    budget_of,
    call_amount,
    check_budget,
    price_of,
    record_spent,
    reserve,
)
from asset2sim.models.gateway.rate_limits import Stopped, never_stopped, provider_name, sleep
from schemas.model_names import is_prior
from schemas.request import ModelRequest
from schemas.settings import ModelSettings

LEASE_MARGIN_S = 30.0
"""Time beyond a request's limit after which its worker must have died, s."""
RESERVATION_POLL_S = 0.05
"""Interval at which a call that waits for budget tries again, s."""


@dataclass(frozen=True)
class GatewaySession:
    """The answer cache (None: off), the budget, and the files that all workers share. Made once per attempt at an
    asset, on the worker; ``stopped`` tells whether the run was stopped, which ends every wait. ``recordings`` is the
    folder from which those of recorded models count."""

    answers: Path | None
    budget: Budget
    ledger: Path
    slots: Path
    stopped: Stopped = never_stopped
    recordings: Path = Path()
    asked: Counter[tuple[str, str]] = field(default_factory=Counter)
    questions: Path | None = None
    """The folder in which questions are kept for people; None: they are not."""
    patience_s: float = math.inf
    """Most time that models may take over the asset's answers, s; waiting for a turn does not count."""
    answering_s: list[float] = field(default_factory=list)
    """Time that each answer took so far, s."""

    @property
    def patience_left_s(self) -> float:
        """Time that is left for answers, s."""
        return self.patience_s - sum(self.answering_s)

    def count_question(self, model: str, purpose: str) -> int:
        """The number of this question among those that the asset asked a model for a purpose, from 1 on."""
        self.asked[model, purpose] += 1
        return self.asked[model, purpose]


def open_gateway_session(
    out: Path,
    run_id: str,
    asset_id: str,
    settings: ModelSettings,
    stopped: Stopped = never_stopped,
    recordings: Path = Path(),
    patience_s: float = math.inf,
) -> GatewaySession:
    """The shared state for one asset of a run that writes to ``out``; files are made when they are needed."""
    answers = out / answer_cache.FOLDER if settings.cache else None
    ledger = out / rate_limits.LEDGER
    budget = budget_of(ledger, run_id, asset_id, settings)
    return GatewaySession(
        answers,
        budget,
        ledger,
        slots=out / rate_limits.SLOTS,
        stopped=stopped,
        recordings=recordings,
        questions=out / questions.FOLDER,
        patience_s=patience_s,
    )


@dataclass
class CallPermit:
    """Permission for one attempt: the amount expected, and the amount taken, which the caller sets."""

    expected: Amount = field(default_factory=lambda: Amount(calls=1))
    actual: Amount = field(default_factory=lambda: Amount(calls=1))


@contextlib.contextmanager
def call_permit(
    session: GatewaySession | None, request: ModelRequest, settings: ModelSettings, with_images: bool
) -> Iterator[CallPermit]:
    """Wait for permission to ask once: for budget, for the rate limit and for a free slot at the provider. Raises
    ``BudgetSpentError``, ``RunStoppedError``, and ``sqlite3.Error`` or ``OSError`` where the shared files cannot be
    used. Nothing is limited without a session; a model in this process has no rate limit."""
    if session is None:
        yield CallPermit()
        return
    with contextlib.ExitStack() as stack:
        ticket = _priced(session, request, settings, with_images)
        check_budget(session.budget, ticket.expected)
        if not is_prior(settings.model):
            provider = provider_name(settings)
            free_slot = rate_limits.slot(session.slots, provider, settings.concurrent_requests, session.stopped)
            stack.enter_context(free_slot)
            rate_limits.wait_for_turn(session.ledger, provider, settings.requests_per_minute, session.stopped)
        number = _held(
            session, ticket.expected, call_amount(request, settings, with_images, math.inf), settings.timeout_s
        )
        try:
            yield ticket
        finally:
            record_spent(session.budget, number, ticket.actual)


def delay_provider_calls(session: GatewaySession | None, settings: ModelSettings, seconds: float) -> None:
    """Delay all workers' next request to the provider by this many seconds."""
    if session is not None:
        rate_limits.postpone_next_request(session.ledger, provider_name(settings), seconds)


def pause(session: GatewaySession | None, seconds: float) -> None:
    """Sleep, unless the run is stopped meanwhile: then ``RunStoppedError``."""
    sleep(seconds, never_stopped if session is None else session.stopped)


def _priced(session: GatewaySession, request: ModelRequest, settings: ModelSettings, with_images: bool) -> CallPermit:
    limits = session.budget.limits
    if not limits:
        return CallPermit()
    if any(limit.usd is not None for limit in limits) and price_of(settings) is None:
        raise BudgetSpentError("a budget in USD cannot be kept for it: LiteLLM knows no price; give one in tokens")
    return CallPermit(expected=call_amount(request, settings, with_images))


def _held(session: GatewaySession, expected: Amount, most: Amount, timeout_s: float) -> str:
    while (number := reserve(session.budget, expected, most, timeout_s + LEASE_MARGIN_S)) is None:
        sleep(RESERVATION_POLL_S, session.stopped)
    return number
