"""Budgets of a run and of an asset, and what a call costs: estimated, reserved before it, and recorded after it."""

import functools
import sqlite3
import time
import uuid
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asset2sim.models.gateway.environment import load_litellm, runs_without_key
from asset2sim.models.gateway.rate_limits import transaction
from schemas.errors import ModelError
from schemas.model_names import is_local, is_prior
from schemas.request import ModelRequest
from schemas.settings import ModelSettings

CHARACTERS_PER_TOKEN = 3
"""Characters of a prompt per estimated token: English has 4, JSON with numbers down to 2.5."""
PIXELS_PER_TOKEN = 750
"""Pixels of an image per estimated token, as Anthropic bills them; others bill fewer tokens."""
EXPECTED_ANSWER_TOKENS = 2000
"""Estimated tokens of an answer: an overlay of 20 links has 1500."""


@dataclass(frozen=True)
class Amount:
    """Calls, tokens (prompt and answer together) and USD."""

    calls: int = 0
    tokens: int = 0
    usd: float = 0.0


@dataclass(frozen=True)
class Price:
    """USD per token of the prompt and of the answer."""

    prompt_usd: float
    answer_usd: float


def price_of(settings: ModelSettings) -> Price | None:
    """The price of ``settings.model``: zero where it runs in this process, is recorded, or is on a local server and
    not in LiteLLM's list; None where it is not known."""
    listed = Price(0.0, 0.0) if is_local(settings.model) else _listed_price(settings.model)
    return Price(0.0, 0.0) if listed is None and runs_without_key(settings) else listed


@functools.lru_cache(maxsize=64)
def _listed_price(model: str) -> Price | None:
    try:
        info: dict[str, Any] = dict(load_litellm().get_model_info(model))
        prompt, answer = info.get("input_cost_per_token"), info.get("output_cost_per_token")
        return None if prompt is None or answer is None else Price(float(prompt), float(answer))
    except Exception:  # whatever LiteLLM raises of a name that it does not know
        return None


def call_amount(
    request: ModelRequest, settings: ModelSettings, with_images: bool, answer_tokens: float = EXPECTED_ANSWER_TOKENS
) -> Amount:
    """Estimated amount of one call for this request, whose answer has at most so many tokens and as are allowed."""
    answer_tokens = int(min(answer_tokens, settings.max_completion_tokens))
    turns = sum(len(turn.content) + sum(len(call.arguments) for call in turn.tool_calls) for turn in request.turns)
    tools = sum(len(tool.description) + len(str(tool.parameters)) for tool in request.tools)
    text = len(request.system) + len(request.text) + turns + tools
    images = len(request.images) + sum(len(turn.images) for turn in request.turns) if with_images else 0
    prompt_tokens = text // CHARACTERS_PER_TOKEN + images * settings.image_side_px**2 // PIXELS_PER_TOKEN
    price = price_of(settings) or Price(0.0, 0.0)
    usd = prompt_tokens * price.prompt_usd + answer_tokens * price.answer_usd
    return Amount(calls=1, tokens=prompt_tokens + answer_tokens, usd=usd)


def cost_usd(response: Any, model: str) -> float:
    """Cost of a call by LiteLLM's price list, USD; 0 where the price is unknown."""
    if is_prior(model):
        return 0.0
    try:
        return float(load_litellm().completion_cost(completion_response=response, model=model))
    except Exception:  # whatever LiteLLM raises of a name that it does not know
        return 0.0


RUN_SCOPE = ""
"""The scope of the whole run; any other is an asset's id."""


class BudgetSpentError(ModelError):
    """A budget does not allow one more call; the message names it, its limit, and what was spent."""


@dataclass(frozen=True)
class Limit:
    """The most that one scope may spend; None is no limit. ``name`` is its name in messages."""

    scope: str
    name: str
    calls: int | None
    tokens: int | None
    usd: float | None


@dataclass(frozen=True)
class Budget:
    """The limits that hold for one asset of one run, and the file in which all workers record what they spend."""

    file: Path
    run_id: str
    asset_id: str
    limits: tuple[Limit, ...]


def budget_of(file: Path, run_id: str, asset_id: str, settings: ModelSettings) -> Budget:
    """The budget of an asset, with the limits that the settings set."""
    run = Limit(RUN_SCOPE, "the run's budget", settings.run_calls, settings.run_tokens, settings.run_usd)
    name = f"the budget of asset {asset_id}"
    asset = Limit(asset_id, name, settings.asset_calls, settings.asset_tokens, settings.asset_usd)
    limits = tuple(item for item in (run, asset) if (item.calls, item.tokens, item.usd) != (None, None, None))
    return Budget(file, run_id, asset_id, limits)


def reserve(budget: Budget, expected: Amount, most: Amount, lease_s: float) -> str | None:
    """Reserve what a call may take and return the reservation's id; None where calls in flight must end first.

    A call may begin if the amount spent plus its ``expected`` amount stays within every limit, even if every other
    call in flight takes the ``most`` it can. So a run exceeds a limit at most by what its last call takes beyond the
    expected, with any number of workers. A reservation older than ``lease_s`` belongs to a dead worker and
    counts as spent. Raises ``BudgetSpentError`` where waiting would not help, and ``sqlite3.Error`` or ``OSError``.
    """
    if not budget.limits:
        return ""
    now = time.time()
    with transaction(budget.file) as ledger:
        _charge_expired_reservations(ledger, budget.run_id, now)
        waits = False
        for limit in budget.limits:
            spent = _spent(ledger, budget.run_id, limit.scope)
            held, most_held = _held(ledger, budget.run_id, limit.scope)
            _raise_if_over_limit(limit, spent, held.calls, expected)
            waits = waits or _exceeds(limit, spent, most_held, expected)
        if waits:
            return None
        ticket = uuid.uuid4().hex
        ledger.execute(
            "INSERT INTO held VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            (ticket, budget.run_id, budget.asset_id, expected.tokens, expected.usd, most.tokens, most.usd,
             now + lease_s),
        )  # fmt: skip
        return ticket


def check_budget(budget: Budget, expected: Amount) -> None:
    """Raise ``BudgetSpentError`` as ``reserve`` does, and reserve nothing: for before the wait for the rate limit."""
    if budget.limits:
        with transaction(budget.file) as ledger:
            for limit in budget.limits:
                held, _ = _held(ledger, budget.run_id, limit.scope)
                _raise_if_over_limit(limit, _spent(ledger, budget.run_id, limit.scope), held.calls, expected)


def record_spent(budget: Budget, ticket: str, actual: Amount) -> None:
    """Record what a call took, for the run and for the asset, in place of its reservation."""
    if budget.limits:
        with transaction(budget.file) as ledger:
            if ledger.execute("DELETE FROM held WHERE ticket = ?", (ticket,)).rowcount:
                _enter(ledger, budget.run_id, budget.asset_id, actual)


def _raise_if_over_limit(limit: Limit, spent: Amount, calls_held: int, expected: Amount) -> None:
    """Raise ``BudgetSpentError`` for a call beyond a limit; calls in flight count as calls, not with tokens or USD."""
    calls = spent.calls + calls_held
    if limit.calls is not None and calls + 1 > limit.calls:
        made = f"{calls} made" if calls else "none may be made"
        raise BudgetSpentError(f"{limit.name} of {limit.calls} model calls is spent: {made}")
    if limit.tokens is not None and spent.tokens + expected.tokens > limit.tokens:
        raise BudgetSpentError(
            f"{limit.name} of {limit.tokens} tokens is spent: {spent.tokens} used in {spent.calls} calls, and one more "
            f"takes about {expected.tokens}"
        )
    if limit.usd is not None and expected.usd > 0.0 and spent.usd + expected.usd > limit.usd:
        raise BudgetSpentError(
            f"{limit.name} of {limit.usd:g} USD is spent: {spent.usd:.4f} USD in {spent.calls} calls, and one more "
            f"costs about {expected.usd:.4f} USD"
        )


def _exceeds(limit: Limit, spent: Amount, held: Amount, expected: Amount) -> bool:
    tokens, usd = spent.tokens + held.tokens + expected.tokens, spent.usd + held.usd + expected.usd
    return (limit.tokens is not None and tokens > limit.tokens) or (
        limit.usd is not None and expected.usd > 0.0 and usd > limit.usd
    )


def _spent(ledger: sqlite3.Connection, run_id: str, scope: str) -> Amount:
    row = ledger.execute(
        "SELECT calls, tokens, usd FROM spent WHERE run_id = ? AND scope = ?", (run_id, scope)
    ).fetchone()
    return Amount(*row) if row else Amount()


def _held(ledger: sqlite3.Connection, run_id: str, scope: str) -> tuple[Amount, Amount]:
    """The amount reserved for calls in flight: expected, and at most."""
    row = ledger.execute(
        "SELECT count(*), total(tokens), total(usd), total(most_tokens), total(most_usd) FROM held "
        "WHERE run_id = ? AND ? IN ('', scope)",
        (run_id, scope),
    ).fetchone()
    calls, tokens, usd, most_tokens, most_usd = row
    return Amount(calls, int(tokens), usd), Amount(calls, int(most_tokens), most_usd)


def _enter(ledger: sqlite3.Connection, run_id: str, asset_id: str, actual: Amount) -> None:
    for scope in (RUN_SCOPE, asset_id):
        ledger.execute(
            "INSERT INTO spent VALUES (?, ?, ?, ?, ?) ON CONFLICT (run_id, scope) DO UPDATE SET "
            "calls = calls + excluded.calls, tokens = tokens + excluded.tokens, usd = usd + excluded.usd",
            (run_id, scope, actual.calls, actual.tokens, actual.usd),
        )


def _charge_expired_reservations(ledger: sqlite3.Connection, run_id: str, now: float) -> None:
    gone = ledger.execute(
        "SELECT ticket, scope, tokens, usd FROM held WHERE run_id = ? AND until < ?", (run_id, now)
    ).fetchall()
    for ticket, asset_id, tokens, usd in gone:
        ledger.execute("DELETE FROM held WHERE ticket = ?", (ticket,))
        _enter(ledger, run_id, asset_id, Amount(1, tokens, usd))
