"""Being told to stop by SIGTERM: the first counts, later ones cut nothing, and one that comes early waits.
A Ctrl-C counts wherever it comes."""

import asyncio
import gc
import importlib
import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from threading import Event, Timer, main_thread
from typing import TYPE_CHECKING, cast

import pytest
from distributed.batched import BatchedSend
from distributed.comm.core import CommClosedError

from asset2sim.experiments.cluster import open_client
from asset2sim.experiments.interrupt import lost_interrupts_repeated, sigterm_as_interrupt, sigterm_deferred
from schemas.settings import RunSettings

if TYPE_CHECKING:
    from tornado.ioloop import IOLoop


def stop() -> None:
    """SIGTERM to this process, handled before this returns."""
    os.kill(os.getpid(), signal.SIGTERM)


def test_the_first_is_ctrl_c_and_the_second_nothing() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with sigterm_as_interrupt():
        with pytest.raises(KeyboardInterrupt):
            stop()
        stop()
    assert signal.getsignal(signal.SIGTERM) is before


def test_one_that_comes_before_the_work_stops_it_and_one_after_it_nothing() -> None:
    before = signal.getsignal(signal.SIGTERM)
    with sigterm_deferred():
        stop()
        with pytest.raises(KeyboardInterrupt), sigterm_as_interrupt():
            raise AssertionError("the work must not begin")
        with sigterm_as_interrupt():
            pass
        stop()
    with sigterm_as_interrupt():
        pass
    assert signal.getsignal(signal.SIGTERM) is before


class InterruptedAsItGoes:
    """Ctrl-C comes while this is destroyed, where Python drops exceptions."""

    def __init__(self, error: bool = False) -> None:
        self.error = error

    def __del__(self) -> None:
        if self.error:
            raise ValueError("of a destructor")
        signal.raise_signal(signal.SIGINT)


def test_ctrl_c_in_a_destructor_comes_again_and_prints_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seen = list[object]()
    monkeypatch.setattr(sys, "unraisablehook", lambda lost: seen.append(lost.exc_value))
    with lost_interrupts_repeated():
        InterruptedAsItGoes()
        with pytest.raises(KeyboardInterrupt):
            time.sleep(60)
        InterruptedAsItGoes(error=True)
    assert [type(value) for value in seen] == [ValueError], "other errors are still told"
    InterruptedAsItGoes()
    assert [type(value) for value in seen] == [ValueError, KeyboardInterrupt], "and all, after the block"
    assert capsys.readouterr().err == ""


TRIES_A_LIBRARY = """
import signal, time
try:
    signal.raise_signal(signal.{name})
    time.sleep(0.2)
    THERE = True
except BaseException:
    THERE = False
"""


@pytest.mark.parametrize(("name", "block"), [("SIGINT", lost_interrupts_repeated), ("SIGTERM", sigterm_as_interrupt)])
def test_one_that_comes_in_an_import_waits_for_its_end(
    name: str, block: Callable[[], AbstractContextManager[None]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As trimesh tries scipy: what is interrupted there would be taken for a library that is not installed."""
    (tmp_path / f"tries_{name}.py").write_text(TRIES_A_LIBRARY.format(name=name), encoding="ascii")
    monkeypatch.syspath_prepend(tmp_path)
    with block():
        found = importlib.import_module(f"tries_{name}").THERE
        with pytest.raises(KeyboardInterrupt):
            time.sleep(60)
    assert found


def test_what_a_shell_starts_in_its_background_hears_ctrl_c() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with lost_interrupts_repeated(), pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.system
def test_connections_that_dask_forgot_or_waited_for_in_vain_are_no_errors(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def close_what_never_stops() -> None:
        stream = BatchedSend(interval=1)
        stream.comm = object()
        closed = asyncio.ensure_future(stream.close(timeout=0.01))
        await asyncio.wait([closed])
        del closed
        gc.collect()

    async def forget(error: Exception) -> None:
        asyncio.get_running_loop().create_future().set_exception(error)
        gc.collect()

    with open_client(RunSettings(workers=1), tmp_path):
        pass
    asyncio.run(forget(CommClosedError("closed")))
    asyncio.run(close_what_never_stops())
    assert not caplog.records
    asyncio.run(forget(ValueError("of another kind")))
    assert [record.name for record in caplog.records] == ["asyncio"]


@pytest.mark.system
def test_a_wait_that_ctrl_c_ends_before_dask_began_it_prints_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def never() -> None:
        await asyncio.sleep(60)

    def wait(busy: Event) -> None:
        busy.set()
        time.sleep(0.5)

    with open_client(RunSettings(workers=1), tmp_path) as client:
        busy = Event()
        cast("IOLoop", client.loop).add_callback(wait, busy)
        busy.wait()
        Timer(0.1, signal.pthread_kill, (main_thread().ident, signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt):
            client.sync(never)
        client.sync(asyncio.sleep, 0.0)
    assert not caplog.records
