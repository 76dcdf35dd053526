"""What the arm is to do: the paper's eleven tasks, a task for any other object, and what trials say of methods."""

import math
from pathlib import Path

import pandas as pd
import pytest

from asset2sim.gym.arm.tasks import PAPER, Task, Verb, is_near, joint_of, target_of, tasks_of
from asset2sim.gym.subject import BAG
from lab.flows.record_motion import trials_block
from lab.options import RecordMotionOptions
from lab.schemas.tables import TRIALS
from lab.trials.figures import method_figures, task_rows
from lab.trials.physical_judge import FAULTS
from lab.trials.study import motion_folder
from schemas.errors import UsageError
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.support import Support, SupportKind
from schemas.vocabulary import Source
from tests.factories import make_joint, make_link


def overlay(*joints: JointPhysics, asset_id: str = "thing") -> PhysicsOverlay:
    return PhysicsOverlay(
        asset_id=asset_id, scale=1.0, scale_source=Source.USER, contact_friction=0.5, links=(make_link("base"),),
        joints=joints,
    )  # fmt: skip


def test_the_paper_has_eleven_tasks_with_its_nine_objects() -> None:
    assert len(PAPER) == 9 and sum(map(len, PAPER.values())) == 11
    assert tasks_of(overlay(asset_id="103275")) == PAPER["103275"]


def test_of_other_objects_what_is_open_is_closed_and_what_is_closed_is_opened() -> None:
    ajar, shut = make_joint("ajar", initial_position=0.4), make_joint("shut", initial_position=0.0)
    (close,) = tasks_of(overlay(shut, ajar))
    assert close.verb is Verb.CLOSE and joint_of(close, overlay(shut, ajar)) == ajar and target_of(close, ajar) == 0.0
    (pull,) = tasks_of(overlay(shut))
    assert pull.verb is Verb.OPEN and target_of(pull, shut) == pytest.approx(1.0 / 3.0)
    (lift,) = tasks_of(overlay())
    assert lift.verb is Verb.GRASP and joint_of(lift, overlay(ajar)) is None


def test_what_a_spring_holds_open_is_pressed() -> None:
    sprung = make_joint("lid", initial_position=0.4).model_copy(update={"stiffness": 0.5})
    (press,) = tasks_of(overlay(sprung))
    assert press.verb is Verb.PRESS and target_of(press, sprung) == 0.0


def test_what_a_spring_holds_shut_is_pressed_and_judged_before_it_comes_back() -> None:
    key = make_joint("key", "prismatic", 0.0).model_copy(update={"stiffness": 50.0, "upper": 0.01, "open": 0.01})
    (press,) = tasks_of(overlay(key))
    assert press.verb is Verb.PRESS and target_of(press, key) == 0.01
    door = make_joint("door", initial_position=0.0)
    (pull,) = tasks_of(overlay(key, door))
    assert pull.verb is Verb.OPEN and joint_of(pull, overlay(key, door)) == door, "what stays open is opened"


def test_the_largest_part_decides_and_of_equals_the_first() -> None:
    button = make_joint("button", "prismatic", 0.0).model_copy(update={"effective_inertia": 0.005})
    drawer = make_joint("drawer", "prismatic", 0.0).model_copy(update={"effective_inertia": 2.0})
    door = make_joint("door", initial_position=0.0).model_copy(update={"effective_inertia": 0.3})
    twin = drawer.model_copy(update={"name": "twin"})
    assert joint_of(Task("open", Verb.OPEN), overlay(button, drawer, door)) == door
    assert joint_of(Task("open", Verb.OPEN), overlay(button, drawer, twin)) == drawer
    knob = make_joint("knob", initial_position=0.5).model_copy(update={"effective_inertia": 1e-4})
    shut = overlay(knob, door)
    (pull,) = tasks_of(shut)
    assert pull.verb is Verb.OPEN and joint_of(pull, shut) == door, "a knob that is turned is no door that stands open"


SPRUNG = {"stiffness": 9.0, "holds": False}


@pytest.mark.parametrize(
    ("joint", "verb", "target"),
    [
        (make_joint("lid", "continuous", 0.0), Verb.TURN, math.pi / 4.0),
        (make_joint("reel").model_copy(update={"lower": -60.0, "upper": 60.0, "closed": -60.0, "open": 60.0,
                                               "initial_position": 0.0}), Verb.TURN, math.pi / 4.0),
        (make_joint("spout").model_copy(update={"lower": -1.5, "upper": 1.5, "closed": 1.5, "open": -1.5,
                                                "initial_position": 0.0}), Verb.TURN, -math.pi / 4.0),
        (make_joint("door", initial_position=0.5).model_copy(update={"stiffness": 4.0, "holds": True}),
         Verb.CLOSE, 0.0),
        (make_joint("lever", initial_position=0.0).model_copy(update=SPRUNG), Verb.PRESS, 1.0),
        (make_joint("cap", "prismatic", 0.0).model_copy(update={"upper": 0.02, "open": 0.02}), Verb.OPEN, 0.02),
        (make_joint("drawer", "prismatic", 0.0).model_copy(update={"upper": 0.3, "open": 0.3}), Verb.OPEN, 0.1),
    ],
    ids=lambda value: value.name if isinstance(value, JointPhysics) else None,
)  # fmt: skip
def test_what_is_done_with_a_part_follows_from_its_ends_its_spring_and_where_it_starts(
    joint: JointPhysics, verb: Verb, target: float
) -> None:
    (task,) = tasks_of(overlay(joint))
    assert task.verb is verb and joint_of(task, overlay(joint)) == joint
    assert target_of(task, joint) == pytest.approx(target)


def test_what_hardly_moves_rolls_or_hangs_is_no_task_of_its_own() -> None:
    button = make_joint("button", "prismatic", 0.0).model_copy(update=SPRUNG | {"upper": 0.001, "open": 0.001})
    wheel = make_joint("joint_1", "continuous", 0.0).model_copy(update={"label": "wheel"})
    bail = make_joint("joint_2", initial_position=0.7).model_copy(update={"label": "handle", "holds": False})
    for joint in (button, wheel, bail):
        assert [task.verb for task in tasks_of(overlay(joint))] == [Verb.GRASP], joint.name
    heavy = overlay(wheel).model_copy(update={"links": (make_link("base").model_copy(update={"mass_kg": 6.0}),)})
    assert tasks_of(heavy) == (), "a cart is not lifted"
    fixed = overlay(wheel).model_copy(update={"support": Support(kind=SupportKind.FIXED)})
    assert tasks_of(fixed)[0].verb is Verb.TURN, "a valve's wheel is turned"


def test_what_is_fixed_and_has_nothing_to_move_has_no_task() -> None:
    fixed = overlay().model_copy(update={"support": Support(kind=SupportKind.FIXED)})
    assert tasks_of(fixed) == () and tasks_of(overlay())[0].verb is Verb.GRASP


@pytest.mark.parametrize(("start", "end"), [(-1.51, 1.57), (1.4, -1.57), (0.0, -1.57)])
def test_a_handle_is_laid_over_to_the_side_on_which_it_does_not_lie(start: float, end: float) -> None:
    ends = {"lower": -1.57, "upper": 1.57, "closed": 1.57, "open": -1.57, "initial_position": start}
    handle = make_joint("bail").model_copy(update=ends | {"label": BAG.part})
    assert joint_of(BAG, overlay(handle)) == handle and target_of(BAG, handle) == end


def test_a_joint_that_closes_upwards_opens_downwards() -> None:
    turned = make_joint("turned", initial_position=1.0).model_copy(update={"closed": 1.0, "open": 0.0})
    assert target_of(Task("open", Verb.OPEN), turned) == pytest.approx(2.0 / 3.0)


def test_the_part_that_a_task_names_is_moved_and_not_one_further_open() -> None:
    lid = make_joint("lid", initial_position=0.2).model_copy(update={"label": "lid"})
    door = make_joint("door", initial_position=0.9)
    assert joint_of(Task("close", Verb.CLOSE, "lid"), overlay(door, lid)) == lid
    assert joint_of(Task("close", Verb.CLOSE, "drawer"), overlay(door, lid)) is None


def test_near_is_an_angle_for_hinges_and_a_share_of_the_range_for_sliders() -> None:
    hinge, slider = make_joint("hinge"), make_joint("slide", "prismatic").model_copy(update={"upper": 0.2})
    assert is_near(hinge, 0.09, 0.0) and not is_near(hinge, 0.11, 0.0)
    assert is_near(slider, 0.009, 0.0) and not is_near(slider, 0.011, 0.0)


@pytest.fixture
def trials() -> pd.DataFrame:
    empty: dict[str, object] = dict.fromkeys(TRIALS.schema.names)
    faults: dict[str, object] = dict.fromkeys(FAULTS, False)
    box: dict[str, object] = {"task": "box close", "asset_id": "100221", "model": "m"} | faults
    rows: list[dict[str, object]] = [
        box | {"method": "asset2sim", "outcome": "done", "score": 5.0},
        {"task": "cup grasp", "asset_id": "7", "method": "asset2sim", "model": "m", "outcome": "unreachable"},
        box | {"method": "reference", "outcome": "not done", "score": 1.5, "moved_before_contact": True},
    ]
    return pd.DataFrame([empty | row for row in rows])


def test_methods_stand_in_the_papers_order_with_what_was_never_recorded_at_zero(trials: pd.DataFrame) -> None:
    reference, ours = method_figures(trials)
    assert (reference.method, reference.done, reference.tasks, reference.faults) == ("reference", 0, 1, (1, *[0] * 6))
    assert (ours.method, ours.done, ours.tasks, ours.recorded, ours.score) == ("asset2sim", 1, 2, 1, 2.5)


def test_each_task_says_what_became_of_it(trials: pd.DataFrame) -> None:
    assert task_rows(trials) == [
        ("box close", {("asset2sim", "m"): "done", ("reference", "m"): "not done; moved before contact"}),
        ("cup grasp 7", {("asset2sim", "m"): "unreachable"}),
    ]
    assert "| asset2sim | 1 of 2 | 2.50 |" in trials_block(trials)
    assert "| box close | not done; moved before contact | done |" in trials_block(trials)


def test_recordings_lie_beside_the_objects_and_not_behind_a_url() -> None:
    assert motion_folder(Path("out"), "7", "box close") == Path("out/motions/7/box-close")
    with pytest.raises(UsageError, match="fetch the output into a folder first"):
        RecordMotionOptions(outs=("s3://bucket/out",)).folders()
