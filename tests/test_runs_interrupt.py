"""Being told to stop by SIGTERM: the first counts, later ones cut nothing, and one that comes early waits."""

import os
import signal

import pytest

from asset2sim.runs.interrupt import sigterm_as_interrupt, sigterm_deferred


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
