"""VLM-IVW: every view asked about several times, invalid answers dropped, the rest fused."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from asset2sim.intake.origin import extract
from asset2sim.render import VIEW_NAMES
from schemas.request import ModelAnswer, ModelRequest
from schemas.vocabulary import FailureMode, Method, Status
from tests.assets import near, prior, sample, saying
from tests.methods_runs import LOOKING, run, settings_of

pytestmark = pytest.mark.system

IVW = settings_of(Method.IVW)
LAPTOP = sample("laptop_silver")
LAPTOP_FEATURES = extract(LAPTOP).features


def by_sample(reply: Callable[[int], ModelAnswer]) -> Callable[[ModelRequest], ModelAnswer]:
    return lambda request: reply(request.sample)


def said(scale: float, sigma: float) -> ModelAnswer:
    return ModelAnswer(content=json.dumps({"scale": scale, "sigmas": {"scale": sigma}}), calls=())


def test_25_calls_each_with_one_view_and_a_number_of_its_own(tmp_path: Path) -> None:
    settings = settings_of(Method.IVW, LOOKING)
    record, requests = run(LAPTOP, tmp_path, settings, saying({"scale": 0.2, "sigmas": {"scale": 0.1}}))
    assert len(requests) == len(record.calls) == 25 and {request.purpose for request in requests} == {"ivw"}
    assert [request.sample for request in requests] == list(range(1, 26))
    shown = [[image.label for image in request.images] for request in requests]
    looks = [[label for label in labels if label in VIEW_NAMES] for labels in shown]
    assert looks == [[name] for name in VIEW_NAMES for _ in range(5)]
    assert len({request.text for request in requests}) == 5, "the text says which view it is about"
    assert record.overlay is not None and near(record.overlay.scale, 0.2)


def test_the_fused_number_is_what_is_written(tmp_path: Path) -> None:
    record, _ = run(LAPTOP, tmp_path, IVW, by_sample(lambda n: said(0.2, 0.1) if n <= 20 else said(0.4, 0.05)))
    # 20 answers of weight 1/0.1² and 5 of weight 1/0.05²: (2000 · 0.2 + 2000 · 0.4) / 4000.
    assert record.overlay is not None and near(record.overlay.scale, 0.3)
    text = (tmp_path / "assets" / "laptop_silver" / "mobility.urdf").read_text()
    assert "asset2sim: scale 0.3;" in text
    assert record.overlay.notes == ("fused from 25 answers by inverse variance",)


def test_a_model_that_always_says_the_same_is_as_good_as_asked_once(tmp_path: Path) -> None:
    fused, requests = run(LAPTOP, tmp_path, IVW)
    once, _ = run(LAPTOP, tmp_path, settings_of(Method.DIRECT))
    assert len(requests) == 25 and fused.status is once.status is Status.OK
    assert fused.overlay is not None and once.overlay is not None
    for one, two in zip(fused.overlay.links, once.overlay.links, strict=True):
        assert near(one.mass_kg, two.mass_kg) and near(one.inertia, two.inertia) and one.material == two.material
    for left, right in zip(fused.overlay.joints, once.overlay.joints, strict=True):
        assert near(left.damping, right.damping) and near(left.initial_position, right.initial_position)
        assert left.holds == right.holds


def test_invalid_answers_are_dropped_and_counted(tmp_path: Path) -> None:
    broken = ModelAnswer(content='{"scale": 0.2', calls=())
    record, requests = run(LAPTOP, tmp_path, IVW, by_sample(lambda n: broken if n <= 12 else said(0.2, 0.1)))
    assert len(requests) == 25, "none is asked for again"
    (finding,) = [item for item in record.findings if item.code == "answers_dropped"]
    assert finding.value == 12.0 and "13 answers of 25" in finding.message and "not JSON" in finding.message
    assert [call.outcome for call in record.calls] == ["invalid_answer"] * 12 + ["ok"] * 13
    assert record.overlay is not None and near(record.overlay.scale, 0.2)


def test_asking_stops_once_half_cannot_be_valid(tmp_path: Path) -> None:
    broken = ModelAnswer(content="[]", calls=())
    record, requests = run(LAPTOP, tmp_path, IVW, by_sample(lambda n: broken if n % 4 else prior(requests_of(n))))
    assert record.failure_mode is FailureMode.NO_VALID_ESTIMATE and "half are needed" in record.reason
    # Answers 4, 8, 12 and 16 are valid; with the 13th broken one, 12 of 25 is all that could be had.
    assert len(requests) == len(record.calls) == 17 and not (tmp_path / "assets").exists()


def requests_of(sample_number: int) -> ModelRequest:
    return ModelRequest(purpose="ivw", system="", text="", sample=sample_number)


@pytest.mark.parametrize(
    ("answers", "asked", "mode"),
    [
        (lambda n: ModelAnswer(content=None, calls=(), error="HTTP 500"), 13, FailureMode.MODEL_ERROR),
        (lambda n: ModelAnswer(content=None, calls=(), error="spent", budget_spent=True), 1, FailureMode.BUDGET),
        (
            lambda n: said(0.2, 0.1) if n < 9 else ModelAnswer(content=None, calls=(), error="", budget_spent=True),
            9,
            FailureMode.BUDGET,
        ),
    ],
)
def test_failing_providers_and_spent_budgets_end_in_their_rows(
    tmp_path: Path, answers: Callable[[int], ModelAnswer], asked: int, mode: FailureMode
) -> None:
    record, requests = run(LAPTOP, tmp_path, IVW, by_sample(answers))
    assert (len(requests), record.failure_mode, len(record.calls)) == (asked, mode, asked)


def test_a_budget_that_ends_late_leaves_enough_to_fuse(tmp_path: Path) -> None:
    spent = ModelAnswer(content=None, calls=(), error="20 calls are spent", budget_spent=True)
    record, requests = run(LAPTOP, tmp_path, IVW, by_sample(lambda n: said(0.2, 0.1) if n <= 20 else spent))
    assert len(requests) == 21 and record.overlay is not None and near(record.overlay.scale, 0.2)
    (finding,) = [item for item in record.findings if item.code == "answers_dropped"]
    assert "20 answers of 25" in finding.message and "spent" in finding.message


def test_one_answer_in_degrees_does_not_turn_a_lid_over(tmp_path: Path) -> None:
    joint = next(joint for joint in LAPTOP_FEATURES.movable_joints if joint.upper is not None)
    assert joint.lower is not None and joint.upper is not None
    middle = (joint.lower + joint.upper) / 2.0

    def reply(number: int) -> ModelAnswer:
        position = 57.3 * middle + 1e3 if number == 1 else middle
        answer = {"scale": 0.2, "initial_joint_positions": {joint.name: position}}
        return ModelAnswer(content=json.dumps(answer), calls=())

    record, _ = run(LAPTOP, tmp_path, IVW, by_sample(reply))
    assert record.overlay is not None
    assert near(record.overlay.initial_positions[joint.name], (24.0 * middle + joint.upper) / 25.0)
