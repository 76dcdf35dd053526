"""The paper's eleven tasks in the DROID scene, and from a policy's actions to the arm's servos."""

import json

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.gym.arm.franka import DAMPING, STIFFNESS, Arm
from asset2sim.gym.arm.gripper import PANDA, ROBOTIQ
from asset2sim.gym.arm.tasks import PAPER, Task, Verb
from lab.probes.controller import OPENING_M, STEP_RAD, carried_out, closed_share, commands_of
from lab.probes.episode import probe_task
from lab.probes.experts import DRIFT, KEPT, KICK, REACHED
from lab.probes.observation import CONTROL_HZ, Chunk
from lab.probes.scene import FLANGE, START
from lab.probes.tasks import PAPER11, ProbeTask
from schemas.errors import UnknownChoiceError
from tests.factories import make_joint
from tests.marks import OBJECTS, needs_objects

MEASURED = START


PUBLISHED_WORDS = {
    task: (told, f"The robot tries to {tries}")
    for task, told, tries in (
        ("stapler press", "Press down on the stapler.", "press the stapler on the table."),
        (
            "stapler grasp",
            "Pick up the stapler and put into the bowl.",
            "pick up the stapler and put it into the bowl.",
        ),
        ("box close", "Close the box lid.", "close the box."),
        ("box grasp", "Pick up the box and put into the bowl.", "pick up the box and put it into the bowl."),
        ("toilet close", "Close the toilet lid.", "close the toilet lid."),
        ("microwave close", "Close the microwave door.", "close the microwave door."),
        ("laptop fold", "Close the laptop.", "close the laptop."),
        ("bag grasp", "Pick up the bag and put into the bowl.", "pick up the bag and put it into the bowl."),
        ("suitcase close", "Close the suitcase lid.", "close the suitcase."),
        ("trashcan close", "Close the trashcan lid.", "close the trashcan lid."),
        ("cabinet close", "Close the drawer of the cabinet.", "close the drawer of the cabinet."),
    )
}
"""Task → the paper's instruction to a policy and its motion prompt to a judge, copied from it."""


def command(velocities: list[float], gripper: float = 0.0, fingers: float = 0.04) -> np.ndarray:
    action = np.array([*velocities, gripper])
    return commands_of(action, "joint_velocity", MEASURED, np.full(2, fingers), Arm())


def test_the_tasks_are_the_papers_and_each_is_told_in_words_of_its_own() -> None:
    theirs = {(task.name, asset_id, task.verb) for asset_id, tasks in PAPER.items() for task in tasks}
    assert {(task.name, task.asset_id, task.verb) for task in PAPER11.values()} == theirs and len(theirs) == 11
    assert {task.name: (task.instruction, task.motion_prompt) for task in PAPER11.values()} == PUBLISHED_WORDS
    assert all((task.bowl is None) == bool(task.joint) == (task.verb is not Verb.GRASP) for task in PAPER11.values())
    assert probe_task(Task("box close", Verb.CLOSE)) is PAPER11["box close"]
    with pytest.raises(UnknownChoiceError, match="box eat"):
        probe_task(Task("box eat", Verb.CLOSE))


@needs_objects
@pytest.mark.parametrize("task", [task for task in PAPER11.values() if task.joint], ids=lambda task: task.name)
def test_each_tasks_joint_is_the_part_that_the_papers_task_names(task: ProbeTask) -> None:
    (folder,) = OBJECTS.glob(f"*/{task.asset_id}")
    (joint,) = (item for item in read_urdf(folder / URDF_NAME).joints if item.name == task.joint)
    parts = {item["id"]: item["name"] for item in json.loads((folder / "mobility_v2.json").read_text())}
    (named,) = (item for item in PAPER[task.asset_id] if item.name == task.name)
    assert parts[int(joint.child.removeprefix("link_"))] == named.part


def test_a_start_is_an_angle_of_a_hinge_and_a_share_of_a_sliders_range_within_the_limits() -> None:
    close, drawer = PAPER11["box close"], PAPER11["cabinet close"]
    assert close.start_of(make_joint("lid")) == pytest.approx(0.4)
    assert close.start_of(make_joint("lid").model_copy(update={"closed": 1.0, "open": 0.0})) == pytest.approx(0.6)
    assert close.start_of(make_joint("lid").model_copy(update={"upper": 0.3})) == pytest.approx(0.3)
    slide = make_joint("slide", "prismatic").model_copy(update={"upper": 0.2, "open": 0.2})
    assert drawer.start_of(slide) == pytest.approx(0.05)
    assert [close.epsilon(make_joint("lid")), drawer.epsilon(slide)] == pytest.approx([0.1, 0.01])
    assert PAPER11["bag grasp"].epsilon(None) == pytest.approx(0.16 + 0.05 * np.tan(np.radians(20.0)))


def test_a_velocity_moves_the_target_by_a_fifteenth_of_a_second_from_where_the_joints_are() -> None:
    told = command([1.5, 0.0, -0.75, 0.0, 0.0, 0.0, 0.3])
    assert told[:7] - MEASURED == pytest.approx([0.1, 0.0, -0.05, 0.0, 0.0, 0.0, 0.02])


def test_what_is_too_fast_is_slowed_down_in_the_same_direction() -> None:
    told = command([6.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert told[:7] - MEASURED == pytest.approx([STEP_RAD, STEP_RAD / 2, 0.0, 0.0, 0.0, 0.0, 0.0])


def test_a_position_is_told_as_it_is_as_droid_does_and_not_clipped_to_the_measured_joints() -> None:
    action = np.array([*(MEASURED - FLANGE + [0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]), 0.0])
    told = commands_of(action, "joint_position", MEASURED, np.full(2, 0.04), Arm())
    assert told[:7] - MEASURED == pytest.approx([0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def test_nothing_is_told_beyond_a_joints_range() -> None:
    arm = Arm()
    told = commands_of(np.array([3.0] * 8), "joint_velocity", arm.upper - 0.01, np.zeros(2), arm)
    assert told[:7] == pytest.approx(arm.upper)


def test_the_fingers_close_at_their_own_speed() -> None:
    assert command([0.0] * 7, 1.0)[7:] == pytest.approx([0.04 - OPENING_M / 2.0] * 2)
    assert pytest.approx(0.05) == OPENING_M * CONTROL_HZ
    assert command([0.0] * 7, 0.0, 0.04)[7:] == pytest.approx([0.04] * 2)
    assert command([0.0] * 7, 1.0, 0.0)[7:] == pytest.approx([0.0] * 2)
    assert (closed_share(PANDA, np.array([0.04, 0.04])), closed_share(PANDA, np.zeros(2))) == (0.0, 1.0)
    robotiq = Arm.__new__(Arm)
    robotiq.gripper, robotiq.lower, robotiq.upper = ROBOTIQ, np.full(7, -9.0), np.full(7, 9.0)
    opened = ROBOTIQ.servos(np.array([ROBOTIQ.opening_m]))[0]
    told = commands_of(np.array([0.0] * 7 + [1.0]), "joint_velocity", START, opened, robotiq)
    assert told.shape == (8,) and ROBOTIQ.opening_of(told[7:]) == pytest.approx(ROBOTIQ.opening_m - OPENING_M, abs=1e-4)


@pytest.mark.parametrize("actions", [np.zeros((0, 8)), np.zeros((5, 7)), np.zeros(8), np.full((2, 8), np.nan)])
def test_actions_that_are_none_are_refused(actions: np.ndarray) -> None:
    with pytest.raises(ValueError, match="chunk"):
        carried_out(Chunk(actions, "joint_velocity"))


def test_eight_actions_of_a_chunk_are_carried_out() -> None:
    assert carried_out(Chunk(np.zeros((15, 8)), "joint_velocity")).shape == (8, 8)


def test_the_experts_idea_of_a_servo_is_that_of_a_critically_damped_one() -> None:
    stiffness, damping = STIFFNESS[0], DAMPING[0]
    inertia, step = damping**2 / (4.0 * stiffness), 1e-5
    for change, speed in ((0.2, 0.0), (0.0, 1.0), (-0.1, 0.5)):
        at, going = 0.0, speed
        for _ in range(round(1.0 / CONTROL_HZ / step)):
            going += step * (stiffness * (change - at) - damping * going) / inertia
            at += step * going
        assert at == pytest.approx(REACHED[0] * change + DRIFT[0] * speed, abs=2e-4)
        assert going == pytest.approx(KICK[0] * change + KEPT[0] * speed, abs=2e-3)
