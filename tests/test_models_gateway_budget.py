"""Budgets of a run and an asset in calls, tokens and USD, alone and with many workers at once; over real HTTP."""

import multiprocessing
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from asset2sim.models.gateway.abilities import check_model
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.budget import (
    EXPECTED_ANSWER_TOKENS,
    Amount,
    BudgetSpentError,
    budget_of,
    call_amount,
    check_budget,
    record_spent,
    reserve,
)
from asset2sim.models.gateway.session import open_gateway_session
from schemas.errors import UsageError
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import ModelSettings
from tests import gateway
from tests.gateway import REQUEST
from tests.model_server import Reply, serve, spent_so_far

pytestmark = [pytest.mark.system, pytest.mark.usefixtures("one_key")]

PRICED = "openai/gpt-4o"
"""2.5 and 10 USD per million tokens, by LiteLLM's list."""


def settings(api_base: str, **changes: object) -> ModelSettings:
    return gateway.settings(api_base, **{"cache": False, **changes})


def numbered(number: int) -> ModelRequest:
    return REQUEST.model_copy(update={"text": f"question {number}"})


def test_a_run_budget_in_calls_holds_for_all_assets_and_says_so(tmp_path: Path) -> None:
    with serve([Reply("{}")]) as server:
        wanted = settings(server.api_base, run_calls=3)
        answers = [ask(REQUEST, wanted, open_gateway_session(tmp_path, "run", f"asset{i}", wanted)) for i in range(5)]
        other_run = ask(REQUEST, wanted, open_gateway_session(tmp_path, "next run", "asset0", wanted))
    assert [answer.budget_spent for answer in answers] == [False, False, False, True, True]
    assert other_run.content == "{}" and len(server.requests) == 4
    refused = answers[-1]
    assert refused.content is None and refused.calls == ()
    assert refused.error == "model 'openai/scripted': the run's budget of 3 model calls is spent: 3 made"


def test_attempts_count(tmp_path: Path) -> None:
    with serve([Reply("down", status=500, headers={"Retry-After": "0"})]) as server:
        wanted = settings(server.api_base, asset_calls=2, max_attempts=4)
        answer = ask(REQUEST, wanted, open_gateway_session(tmp_path, "run", "chair", wanted))
        other = ask(
            REQUEST, wanted.model_copy(update={"max_attempts": 1}), open_gateway_session(tmp_path, "run", "box", wanted)
        )
    assert answer.budget_spent and len(answer.calls) == 2 and len(server.requests) == 3
    assert answer.error is not None and "the budget of asset chair of 2 model calls is spent: 2 made" in answer.error
    assert not other.budget_spent and other.error is not None and "500" in other.error


def test_a_budget_in_tokens_counts_what_the_provider_reports(tmp_path: Path) -> None:
    with serve([Reply("{}", prompt_tokens=3000, completion_tokens=1000)]) as server:
        wanted = settings(server.api_base, run_tokens=10_000)
        session = open_gateway_session(tmp_path, "run", "a", wanted)
        answers = [ask(REQUEST, wanted, session) for _ in range(4)]
    assert [answer.budget_spent for answer in answers] == [False, False, True, True]
    assert answers[-1].error is not None
    assert "the run's budget of 10000 tokens is spent: 8000 used in 2 calls, and one more takes about" in (
        answers[-1].error
    )
    assert spent_so_far(session.budget) == Amount(2, 8000, 0.0) == spent_so_far(session.budget, "a")


def test_no_money_means_no_call_to_a_model_that_costs_and_says_why(tmp_path: Path) -> None:
    with serve([Reply("{}")]) as server:
        wanted = settings(server.api_base, model=PRICED, run_usd=0.0)
        answer = ask(REQUEST, wanted, open_gateway_session(tmp_path, "run", "a", wanted))
        assert server.requests == [] and answer.calls == () and answer.budget_spent
        assert answer.error is not None
        for words in (PRICED, "the run's budget of 0 USD is spent: 0.0000 USD in 0 calls", "one more costs about 0.02"):
            assert words in answer.error
        free = settings(server.api_base, run_usd=0.0, asset_usd=0.0)
        assert ask(REQUEST, free, open_gateway_session(tmp_path, "run", "a", free)).content == "{}"
    prior = ModelSettings(run_usd=0.0)
    assert not ask(REQUEST, prior, open_gateway_session(tmp_path, "run", "a", prior)).budget_spent


def test_what_a_call_costs_is_what_the_budget_loses(tmp_path: Path) -> None:
    with serve([Reply("{}", prompt_tokens=100_000, completion_tokens=10_000)]) as server:
        wanted = settings(server.api_base, model=PRICED, run_usd=0.71)
        session = open_gateway_session(tmp_path, "run", "a", wanted)
        answers = [ask(REQUEST, wanted, session) for _ in range(4)]
    assert [answer.budget_spent for answer in answers] == [False, False, True, True]
    assert spent_so_far(session.budget).usd == pytest.approx(2 * (0.25 + 0.1))


def test_a_price_that_nobody_knows_is_refused_before_anything_runs(tmp_path: Path) -> None:
    unknown = ModelSettings(model="openai/in-house", api_base="https://models.example.org/v1", run_usd=1.0)
    with pytest.raises(UsageError, match=r"openai/in-house.*no price.*--budget-tokens"):
        check_model(unknown)
    check_model(unknown.model_copy(update={"run_usd": None, "run_tokens": 1000}))
    check_model(settings("http://127.0.0.1:9/v1", run_usd=1.0))
    check_model(ModelSettings(run_usd=1.0))
    answer = ask(REQUEST, unknown, open_gateway_session(tmp_path, "run", "a", unknown))
    assert answer.budget_spent and answer.calls == () and answer.error is not None and "no price" in answer.error


@pytest.mark.parametrize(("limit", "most"), [({"run_calls": 7}, 7), ({"run_tokens": 60_000}, 17)])
def test_many_workers_do_not_overshoot(limit: dict[str, int], most: int, tmp_path: Path) -> None:
    with serve([Reply("{}", prompt_tokens=3000, completion_tokens=500, delay_s=0.02)]) as server:
        wanted = settings(server.api_base, max_completion_tokens=4000, **limit)

        def one(number: int) -> ModelAnswer:
            return ask(numbered(number), wanted, open_gateway_session(tmp_path, "run", f"asset{number}", wanted))

        with ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(one, range(24)))
    # 3,500 tokens a call: after 16 calls 56,000 are used, and one more is reckoned with 2,009.
    asked = [answer for answer in answers if not answer.budget_spent]
    assert len(asked) == len(server.requests) == most and all(answer.content == "{}" for answer in asked)


def test_a_call_in_flight_is_waited_for_not_counted_against_the_next(tmp_path: Path) -> None:
    budget = budget_of(tmp_path / "ledger.sqlite", "run", "a", ModelSettings(run_tokens=10_000))
    ticket = reserve(budget, Amount(1, 3000), Amount(1, 9000), 60.0)
    assert ticket is not None
    assert reserve(budget, Amount(1, 3000), Amount(1, 9000), 60.0) is None  # the first may yet use 9,000
    check_budget(budget, Amount(1, 3000))  # and yet the budget is not spent
    record_spent(budget, ticket, Amount(1, 500))
    second = reserve(budget, Amount(1, 3000), Amount(1, 9000), 60.0)
    assert second is not None
    record_spent(budget, second, Amount(1, 8000))
    with pytest.raises(BudgetSpentError, match="8500 used in 2 calls"):
        reserve(budget, Amount(1, 3000), Amount(1, 9000), 60.0)


def test_what_a_dead_worker_held_counts_as_spent(tmp_path: Path) -> None:
    budget = budget_of(tmp_path / "ledger.sqlite", "run", "a", ModelSettings(run_tokens=10_000))
    assert reserve(budget, Amount(1, 3000), Amount(1, 9000), 0.05) is not None
    time.sleep(0.1)
    assert reserve(budget, Amount(1, 3000), Amount(1, 9000), 60.0) is not None
    assert spent_so_far(budget) == Amount(1, 3000, 0.0)


def test_a_ticket_is_settled_once(tmp_path: Path) -> None:
    budget = budget_of(tmp_path / "ledger.sqlite", "run", "a", ModelSettings(run_calls=5))
    ticket = reserve(budget, Amount(1), Amount(1), 60.0)
    assert ticket is not None
    record_spent(budget, ticket, Amount(1, 10))
    record_spent(budget, ticket, Amount(1, 10))
    assert spent_so_far(budget) == Amount(1, 10, 0.0)


def _spend(file: Path, count: int) -> None:
    budget = budget_of(file, "run", "a", ModelSettings(run_calls=40))
    for _ in range(count):
        try:
            ticket = reserve(budget, Amount(1), Amount(1), 60.0)
        except BudgetSpentError:
            return
        assert ticket is not None
        record_spent(budget, ticket, Amount(1, 5, 0.25))


def test_processes_share_a_ledger(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    file = tmp_path / "ledger.sqlite"
    processes = [context.Process(target=_spend, args=(file, 30)) for _ in range(2)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert [process.exitcode for process in processes] == [0, 0]
    assert spent_so_far(budget_of(file, "run", "a", ModelSettings(run_calls=1))) == Amount(40, 200, 10.0)


def test_a_timeout_may_have_been_billed_and_counts_as_expected(tmp_path: Path) -> None:
    with serve([Reply(hang=True)]) as server:
        wanted = settings(server.api_base, model=PRICED, timeout_s=0.3, max_attempts=1, run_usd=1.0)
        session = open_gateway_session(tmp_path, "run", "a", wanted)
        answer = ask(REQUEST, wanted, session)
    assert not answer.budget_spent and answer.calls[0].cost_usd == 0.0
    expected = call_amount(REQUEST, wanted, False)
    assert spent_so_far(session.budget) == expected
    assert expected.tokens == EXPECTED_ANSWER_TOKENS + (15 + 11) // 3 and 0.02 < expected.usd < 0.021


def test_files_that_cannot_be_used_are_an_answer_not_an_exception(tmp_path: Path) -> None:
    (tmp_path / ".cache").mkdir()
    (tmp_path / ".cache" / "ledger.sqlite").write_text("this is not a database, and was never one" * 50)
    with serve([Reply("{}")]) as server:
        wanted = settings(server.api_base, run_calls=1)
        answer = ask(REQUEST, wanted, open_gateway_session(tmp_path, "run", "a", wanted))
    assert server.requests == [] and not answer.budget_spent
    assert answer.error is not None and "files through which workers agree" in answer.error
