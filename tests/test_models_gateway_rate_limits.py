"""The gateway's ends: slow, endless and overlong answers, requests per minute and at once, and a stop; over HTTP."""

import gzip
import json
import multiprocessing
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest

from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.rate_limits import postpone_next_request, provider_name, slot, transaction, wait_for_turn
from asset2sim.models.gateway.session import open_gateway_session
from asset2sim.models.gateway.transport import MAX_ANSWER_BYTES
from schemas.request import ModelAnswer
from schemas.settings import ModelSettings
from tests import gateway
from tests.gateway import REQUEST
from tests.model_server import Reply, serve
from tests.processes import wait_until

pytestmark = [pytest.mark.system, pytest.mark.usefixtures("no_keys")]


def settings(api_base: str, **changes: object) -> ModelSettings:
    return gateway.settings(api_base, **{"cache": False, **changes})


@pytest.mark.parametrize("drip", ["body", "headers"])
@pytest.mark.parametrize("limit", ["call", "asset"])
def test_an_answer_that_never_ends_is_left_when_its_time_is_up(drip: str, limit: str, tmp_path: Path) -> None:
    with serve([Reply(drip=drip)]) as server:  # type: ignore[arg-type]
        wanted = settings(server.api_base, timeout_s=0.4, max_attempts=1)
        session = None
        if limit == "asset":
            wanted = settings(server.api_base, timeout_s=60.0, max_attempts=4)
            session = open_gateway_session(tmp_path, "run", "a", wanted, patience_s=0.4)
        answer = ask(REQUEST, wanted, session)
    assert len(answer.calls) == 1 and answer.calls[0].latency_s < 60.0
    assert answer.content is None and answer.error is not None and "within " in answer.error


@pytest.mark.parametrize("model", ["openai/scripted", "anthropic/scripted", "mistral/scripted", "hosted_vllm/scripted"])
def test_an_overlong_answer_is_refused_once_whatever_the_provider(model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ANTHROPIC_API_KEY", "MISTRAL_API_KEY"):
        monkeypatch.setenv(name, "test-key-0123456789")
    with serve([Reply("x" * 10_000_000)]) as server:
        answer = ask(REQUEST, settings(server.api_base, model=model))
    assert answer.content is None and len(answer.calls) == len(server.requests) == 1
    assert answer.error is not None and str(MAX_ANSWER_BYTES) in answer.error and len(answer.error) < 500


def test_an_answer_is_asked_for_uncompressed_and_a_bomb_is_not_opened() -> None:
    bomb = gzip.compress(b" " * 50_000_000)
    assert len(bomb) < MAX_ANSWER_BYTES
    with serve([Reply(raw=bomb, headers={"Content-Encoding": "gzip"})]) as server:
        answer = ask(REQUEST, settings(server.api_base))
    assert len(answer.calls) == 1 and answer.error is not None and "compressed" in answer.error


def test_a_lost_connection_and_a_broken_body_are_tried_again() -> None:
    for bad in (Reply("{}", drop=True), Reply(raw=b'{"choices": [{"message": {"con')):
        with serve([bad, Reply('{"a": 1}')]) as server:
            answer = ask(REQUEST, settings(server.api_base))
        assert answer.content == '{"a": 1}' and [call.outcome for call in answer.calls] == ["provider_error", "ok"]


def test_requests_are_spread_over_the_minute_across_threads(tmp_path: Path) -> None:
    with serve([Reply("{}")]) as server:
        wanted = settings(server.api_base, requests_per_minute=600.0)  # one every 0.1 s

        def one(number: int) -> ModelAnswer:
            return ask(REQUEST, wanted, open_gateway_session(tmp_path, "run", f"asset{number}", wanted))

        start = time.monotonic()
        with ThreadPoolExecutor(6) as pool:
            answers = list(pool.map(one, range(6)))
    assert all(answer.content == "{}" for answer in answers)
    # None is sent before its turn, however busy the machine is.
    assert len(server.times) == 6 and max(server.times) - start >= 0.5


def _take_turns(file: Path, count: int, log: Path, both_ready: Barrier) -> None:
    both_ready.wait(120.0)
    with log.open("w", encoding="utf-8") as lines:
        lines.write(f"{time.time()}\n")
        for _ in range(count):
            wait_for_turn(file, "here", 1200.0)  # one every 0.05 s
            lines.write(f"{time.time()}\n")


def test_turns_are_shared_by_processes(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    logs = [tmp_path / "first", tmp_path / "second"]
    file, both_ready = tmp_path / "ledger.sqlite", context.Barrier(2)
    processes = [context.Process(target=_take_turns, args=(file, 15, log, both_ready)) for log in logs]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert [process.exitcode for process in processes] == [0, 0]
    first, second = ([float(line) for line in log.read_text().split()] for log in logs)
    assert len(first) == len(second) == 1 + 15
    # From before the first turn to after the last of 30; with turns of its own, each would be done in half of that.
    assert max(first[-1], second[-1]) - min(first[0], second[0]) >= 29 * 0.05


def is_postponed(ledger: Path) -> bool:
    """Whether the next request to some provider is postponed."""
    if not ledger.exists():
        return False
    with transaction(ledger) as connection:
        return bool(connection.execute("SELECT count(*) FROM pace").fetchone() != (0,))


def test_one_workers_retry_after_holds_back_the_others(tmp_path: Path) -> None:
    limit = Reply("slow down", status=429, headers={"Retry-After": "0.6"})
    with serve([limit, Reply("{}")]) as server:
        wanted = settings(server.api_base)
        session = open_gateway_session(tmp_path, "run", "a", wanted)
        with ThreadPoolExecutor(1) as pool:
            first = pool.submit(ask, REQUEST, wanted, session)
            assert wait_until(lambda: is_postponed(session.ledger), 120.0)
            second = ask(REQUEST, wanted, open_gateway_session(tmp_path, "run", "b", wanted))
            assert first.result().content == second.content == "{}"
    assert min(server.times[1:]) - server.times[0] > 0.55


def test_a_provider_is_asked_so_many_questions_at_once(tmp_path: Path) -> None:
    with serve([Reply("{}", delay_s=0.5)]) as server:
        wanted = settings(server.api_base, concurrent_requests=2)
        with ThreadPoolExecutor(6) as pool:
            jobs = [
                pool.submit(ask, REQUEST, wanted, open_gateway_session(tmp_path, "run", str(i), wanted))
                for i in range(6)
            ]
            assert all(job.result().content == "{}" for job in jobs)
    assert server.at_once == 2


def test_each_server_has_its_own_places(tmp_path: Path) -> None:
    first, second = (settings(f"http://127.0.0.1:{port}/v1") for port in (8001, 8002))
    assert provider_name(first) != provider_name(second)
    with slot(tmp_path, provider_name(first), 1), slot(tmp_path, provider_name(second), 1):
        pass
    postpone_next_request(tmp_path / "ledger.sqlite", provider_name(first), 600.0)
    start = time.monotonic()
    wait_for_turn(tmp_path / "ledger.sqlite", provider_name(second), None)
    assert time.monotonic() - start < 300.0


@pytest.mark.parametrize("where", ["answer", "place", "turn", "retry"])
def test_a_stopped_run_waits_for_nothing(where: str, tmp_path: Path) -> None:
    stop = threading.Event()
    reply = Reply("later", status=429, headers={"Retry-After": "600"}) if where == "retry" else Reply(hang=True)
    with serve([reply]) as server:
        wanted = settings(server.api_base, timeout_s=600.0, concurrent_requests=1)
        session = open_gateway_session(tmp_path, "run", "a", wanted, stop.is_set)
        taken = slot(session.slots, provider_name(wanted), 1)
        if where == "place":
            taken.__enter__()
        if where == "turn":
            postpone_next_request(session.ledger, provider_name(wanted), 600.0)
        with ThreadPoolExecutor(1) as pool:
            job = pool.submit(ask, REQUEST, wanted, session)
            time.sleep(0.4)
            stop.set()
            answer = job.result(timeout=120.0)
        if where == "place":
            taken.__exit__(None, None, None)
    assert answer.content is None and answer.error is not None and "stopped" in answer.error


def test_what_the_server_is_sent_stays_json(tmp_path: Path) -> None:
    with serve([Reply("a lone \ud800 surrogate")]) as server:
        answer = ask(
            REQUEST, settings(server.api_base), open_gateway_session(tmp_path, "run", "a", settings(server.api_base))
        )
    assert answer.content == "a lone ? surrogate" and json.dumps(server.requests[0])
