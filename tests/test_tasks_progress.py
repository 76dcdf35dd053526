"""What a stage raises: an error of reading an asset is a finding of the stage, another one the program's own."""

import errno
import os
import time
from collections import defaultdict
from functools import partial
from random import Random

import pytest

from asset2sim.engines.child import in_child
from asset2sim.models.ask_overlay import SynthesisError
from schemas.errors import AssetError
from schemas.vocabulary import Engine, FailureMode, Stage
from tasks.progress import Progress, StageResult


def running(stage: Stage, error: Exception) -> None:
    def fail() -> StageResult:
        raise error

    Progress().run(stage, fail)


@pytest.mark.parametrize(
    "error",
    [
        IndexError("list index out of range"), RecursionError("too deep"),
        UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"), ValueError("Out of range float values\nare"),
        ZeroDivisionError("division by zero"), AttributeError("'NoneType' object has no attribute 'get'"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("stage", [Stage.EXTRACT, Stage.VALIDATE, Stage.APPLY])
def test_an_error_of_its_numbers_fails_the_asset_for_good(stage: Stage, error: Exception) -> None:
    with pytest.raises(AssetError) as caught:
        running(stage, error)
    assert (caught.value.mode, caught.value.code) == (FailureMode.UNREADABLE_ASSET, "internal_error")
    said = str(caught.value)
    assert stage.value in said and type(error).__name__ in said and "\n" not in said and "report" in said


def test_a_file_that_cannot_be_opened_fails_the_asset_for_good() -> None:
    with pytest.raises(AssetError, match="Permission denied"):
        running(Stage.EXTRACT, PermissionError(13, "Permission denied", "a.obj"))


@pytest.mark.parametrize(
    ("stage", "error"),
    [
        (Stage.MEASURE, IndexError("x")),
        (Stage.SYNTHESIZE, ValueError("x")),
        (Stage.EXTRACT, MemoryError()),
        (Stage.EXTRACT, OSError(errno.EMFILE, "Too many open files")),
        (Stage.APPLY, PermissionError(13, "Permission denied", "out")),
        (Stage.APPLY, OSError(errno.ENOSPC, "No space left on device")),
        (Stage.EXTRACT, AssetError(FailureMode.MISSING_MESH, "missing_mesh", "x")),
        (Stage.VALIDATE, SynthesisError(FailureMode.BUDGET, "budget", "x", ())),
    ],
)
def test_other_errors_stay_what_they_are(stage: Stage, error: Exception) -> None:
    with pytest.raises(type(error)) as caught:
        running(stage, error)
    assert caught.value is error


@pytest.mark.system
def test_processor_time_is_that_of_the_stage_and_of_its_children_without_waiting() -> None:
    """The waits and the child's second are long beside what a busy machine adds."""
    progress = Progress()

    def work() -> StageResult:
        busy(0.1)
        time.sleep(1.5)
        assert in_child(Engine.PYBULLET, partial(busy, 1.0), time_limit_s=60.0).problem is None
        return StageResult()

    progress.run(Stage.EXTRACT, work)
    own, progress.processor_s = progress.processor_s, defaultdict(float)
    assert set(own) == {Stage.EXTRACT} and 1.05 < own[Stage.EXTRACT] < 2.5
    progress.run(Stage.REFINE, work)
    assert 0.08 < progress.processor_s[Stage.REFINE] < 0.95, "what its engines do is to measure"
    assert 0.95 < progress.processor_s[Stage.MEASURE] < 2.0


def test_a_stage_that_takes_no_processor_time_takes_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """However much of it the process and its children took before: a rounded sum of the four is never negative."""
    clocks_s = [tick / 100.0 for tick in range(1, 4000, 7)]
    random = Random(1)
    for _ in range(500):
        now = os.times_result((*random.choices(clocks_s, k=4), 0.0))
        monkeypatch.setattr("os.times", partial(lambda value: value, now))
        progress = Progress()
        progress.run(Stage.EXTRACT, StageResult)
        assert progress.processor_s == {Stage.EXTRACT: 0.0}


def busy(seconds: float) -> None:
    """Take so much processor time."""
    start = time.process_time()
    while time.process_time() < start + seconds:
        pass
