"""Budgets of a run and of an asset: what a call may take is held before it, and what it took is entered after it."""

import sqlite3
import time
import uuid
from dataclasses import dataclass
from pathlib import Path

from asset2sim.models.gateway.ledger import transaction
from asset2sim.models.gateway.prices import Amount
from schemas.errors import ModelError
from schemas.settings import ModelSettings

RUN = ""
"""The scope of the whole run; any other is an asset's id."""


class BudgetSpentError(ModelError):
    """A budget does not reach for one more call; the message names it, its limit, and what was spent."""


@dataclass(frozen=True)
class Limit:
    """The most that one scope may spend; None is no limit. ``option`` is how a user raises it."""

    scope: str
    name: str
    calls: int | None
    tokens: int | None
    usd: float | None

    @property
    def unlimited(self) -> bool:
        """Whether nothing is limited."""
        return self.calls is None and self.tokens is None and self.usd is None


@dataclass(frozen=True)
class Budget:
    """The limits that hold for one asset of one run, and the file in which all workers enter what they spend."""

    file: Path
    run_id: str
    asset_id: str
    limits: tuple[Limit, ...]


def budget_of(file: Path, run_id: str, asset_id: str, settings: ModelSettings) -> Budget:
    """The budget of an asset, with the limits that the settings set."""
    run = Limit(RUN, "the run's budget", settings.run_calls, settings.run_tokens, settings.run_usd)
    asset = Limit(
        asset_id, f"the budget of asset {asset_id}", settings.asset_calls, settings.asset_tokens, settings.asset_usd
    )
    return Budget(file, run_id, asset_id, tuple(limit for limit in (run, asset) if not limit.unlimited))


def hold(budget: Budget, expected: Amount, most: Amount, lease_s: float) -> str | None:
    """Hold what a call may take, and return the ticket to settle it with; None where others must settle first.

    A call may begin where what was spent and what it is ``expected`` to take stay within every limit, also if every
    other call in flight took the ``most`` it can: so a run overshoots by what its last call takes beyond the
    expected, however many workers it has. What is held for longer than ``lease_s`` belongs to a worker that died and
    counts as spent. Raises ``BudgetSpentError`` where waiting would not help, and ``sqlite3.Error`` or ``OSError``.
    """
    if not budget.limits:
        return ""
    now = time.time()
    with transaction(budget.file) as ledger:
        _enter_abandoned(ledger, budget.run_id, now)
        waits = False
        for limit in budget.limits:
            spent = _spent(ledger, budget.run_id, limit.scope)
            held, most_held = _held(ledger, budget.run_id, limit.scope)
            _refuse_beyond(limit, spent, held.calls, expected)
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


def check(budget: Budget, expected: Amount) -> None:
    """Raise ``BudgetSpentError`` as ``hold`` does, and hold nothing: asked before waiting for one's turn."""
    if budget.limits:
        with transaction(budget.file) as ledger:
            for limit in budget.limits:
                held, _ = _held(ledger, budget.run_id, limit.scope)
                _refuse_beyond(limit, _spent(ledger, budget.run_id, limit.scope), held.calls, expected)


def settle(budget: Budget, ticket: str, actual: Amount) -> None:
    """Enter what a call took, for the run and for the asset, in place of what was held for it."""
    if not budget.limits:
        return
    with transaction(budget.file) as ledger:
        if ledger.execute("DELETE FROM held WHERE ticket = ?", (ticket,)).rowcount:
            _enter(ledger, budget.run_id, budget.asset_id, actual)


def spent_so_far(budget: Budget, scope: str = RUN) -> Amount:
    """What was entered for a scope of the run; calls in flight are not in it."""
    with transaction(budget.file) as ledger:
        return _spent(ledger, budget.run_id, scope)


def _refuse_beyond(limit: Limit, spent: Amount, calls_held: int, expected: Amount) -> None:
    """Raise where the call cannot be made whatever those in flight take. Each of those is a call in any case."""
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
    """What is held for calls in flight: as expected, and at most."""
    row = ledger.execute(
        "SELECT count(*), total(tokens), total(usd), total(most_tokens), total(most_usd) FROM held "
        "WHERE run_id = ? AND ? IN ('', scope)",
        (run_id, scope),
    ).fetchone()
    calls, tokens, usd, most_tokens, most_usd = row
    return Amount(calls, int(tokens), usd), Amount(calls, int(most_tokens), most_usd)


def _enter(ledger: sqlite3.Connection, run_id: str, asset_id: str, actual: Amount) -> None:
    for scope in (RUN, asset_id):
        ledger.execute(
            "INSERT INTO spent VALUES (?, ?, ?, ?, ?) ON CONFLICT (run_id, scope) DO UPDATE SET "
            "calls = calls + excluded.calls, tokens = tokens + excluded.tokens, usd = usd + excluded.usd",
            (run_id, scope, actual.calls, actual.tokens, actual.usd),
        )


def _enter_abandoned(ledger: sqlite3.Connection, run_id: str, now: float) -> None:
    gone = ledger.execute(
        "SELECT ticket, scope, tokens, usd FROM held WHERE run_id = ? AND until < ?", (run_id, now)
    ).fetchall()
    for ticket, asset_id, tokens, usd in gone:
        ledger.execute("DELETE FROM held WHERE ticket = ?", (ticket,))
        _enter(ledger, run_id, asset_id, Amount(1, tokens, usd))
