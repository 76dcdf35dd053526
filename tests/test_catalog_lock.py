"""One run at a time on an output URL: the second is refused, a dead one's place is taken, a lost one is noticed."""

import json
import os
import platform
import time
from pathlib import Path

import pytest

from asset2sim.storage import lock
from asset2sim.storage.lock import Holder, LostLockError, lock_url
from schemas.errors import UsageError
from tests.object_store import Store
from tests.processes import wait_until


@pytest.fixture
def note(tmp_path: Path) -> Path:
    return tmp_path / "note"


def holder(store: Store) -> Holder:
    return Holder(**json.loads(store.files.cat_file(f"{store.url}/out/.lock")))


def leave(store: Store, age_s: float) -> None:
    """The lock of a run on another machine that was last alive so long ago."""
    text = json.dumps({"token": "t", "process": 77, "host": "far", "time": time.time() - age_s})
    store.files.pipe_file(f"{store.url}/out/.lock", text.encode())


@pytest.mark.system
def test_the_second_run_is_refused_and_told_by_whom(store: Store, note: Path) -> None:
    out = f"{store.url}/out"
    with lock_url(out, note) as check:
        check()
        told = rf"process {os.getpid()} on {platform.node()}\) is writing to {out}"
        with pytest.raises(UsageError, match=told), lock_url(out, note.with_name("another")):
            raise AssertionError("two runs hold it")
        assert holder(store).process == os.getpid()
        with lock_url(f"{out}2", note):
            pass
    assert store.keys(out) == []
    with lock_url(out, note):
        pass


def test_a_dead_runs_lock_is_taken_over_once_it_is_stale(store: Store, note: Path) -> None:
    out = f"{store.url}/out"
    leave(store, lock.STALE_S - 30.0)
    with pytest.raises(UsageError, match=r"process 77 on far.* counts for nothing in (29|30) s"), lock_url(out, note):
        raise AssertionError("it may be alive")
    leave(store, lock.STALE_S + 1.0)
    with lock_url(out, note) as check:
        check()
        assert holder(store).host == platform.node()
    store.files.pipe_file(f"{out}/.lock", b"somebody's note")
    with lock_url(out, note):
        assert holder(store).host == platform.node()


def test_a_killed_runs_lock_is_taken_over_at_once_where_it_ran(store: Store, note: Path) -> None:
    out = f"{store.url}/out"
    leave(store, 1.0)
    note.write_text("another's")
    with pytest.raises(UsageError, match="process 77 on far"), lock_url(out, note):
        raise AssertionError("it may be alive")
    note.write_text("t")
    with lock_url(out, note):
        assert note.read_text() == holder(store).token != "t"


def test_of_two_that_come_for_a_dead_ones_place_one_gets_it(
    store: Store, note: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = f"{store.url}/out"
    leave(store, lock.STALE_S + 1.0)
    read = lock._read

    def overtaken(place: str) -> tuple[Holder, str]:
        found = read(place)
        monkeypatch.setattr(lock, "_read", read)
        leave(store, 0.0)
        return found

    monkeypatch.setattr(lock, "_read", overtaken)
    with pytest.raises(UsageError, match="is just starting"), lock_url(out, note):
        raise AssertionError("two runs hold it")
    assert holder(store).host == "far"


def test_a_living_run_renews_its_lock_and_notices_its_loss(store: Store, note: Path) -> None:
    out = f"{store.url}/out"
    with lock_url(out, note, renew_s=0.05) as check:
        first = holder(store)
        assert wait_until(lambda: holder(store).time > first.time + 0.1, 5.0) and holder(store).token == first.token
        check()
        leave(store, 0.0)

        def lost() -> bool:
            try:
                check()
            except LostLockError:
                return True
            return False

        assert wait_until(lost, 5.0)
    assert holder(store).host == "far", "what the other holds is not removed"


def test_a_bucket_that_is_not_there_is_a_mistake_in_one_line(store: Store, note: Path) -> None:
    with pytest.raises(UsageError, match="check the address") as told, lock_url("s3://no-such-bucket/out", note):
        raise AssertionError
    assert "\n" not in str(told.value)
