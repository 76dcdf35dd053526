"""The Robotiq 2F-85 on the arm beside its closed form, what it holds, and what is said where its model is missing."""

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
import mujoco

from asset2sim.gym.arm.franka import HAND, HOME, OWN_HAND, franka_spec, waiting
from asset2sim.gym.arm.gripper import (
    ANGLE_RAD,
    CRANK_M,
    GRIPPERS,
    JOINTS,
    PAD_FACE_M,
    PIVOT_M,
    RADIUS_M,
    REMEDY,
    ROBOTIQ,
    TORQUE,
    gripper_of,
    knuckle_of,
    robotiq_file,
)
from asset2sim.gym.arm.planning import ToolPlan
from asset2sim.gym.arm.scene import base_at, build_stage
from asset2sim.gym.arm.tasks import Task, Verb
from lab.schemas.settings import TrialSettings
from lab.trials.record import record
from lab.trials.trial import run_trial
from schemas.errors import UnknownChoiceError, UsageError
from tests.refined_things import block, drawer

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    """The arm with the gripper, and between the open pads a block of 40 mm and 0.5 kg that nothing else bears."""
    try:
        robotiq_file()
    except UsageError as error:
        pytest.skip(str(error))
    spec = franka_spec(ROBOTIQ)
    spec.option.timestep, spec.option.integrator = 1e-3, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 100.0
    body = spec.worldbody.add_body(name="block")
    body.add_freejoint()
    body.add_geom(
        name="block", type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.02, 0.02, 0.02), mass=0.5, condim=4,
        friction=(0.5, 5e-3, 1e-4), solref=(0.004, 1.0),
    )  # fmt: skip
    return spec.compile()


def held(model: mujoco.MjModel, opening_m: float, seconds: float, *, away: bool = False) -> mujoco.MjData:
    """The arm at home, told this opening from the start on, with the block between the pads or far away."""
    data = mujoco.MjData(model)
    data.ctrl[:] = waiting(ROBOTIQ)
    data.qpos[:7] = HOME
    data.qpos[7:13] = ROBOTIQ.ratios @ knuckle_of(np.array([0.05]))[0]
    mujoco.mj_kinematics(model, data)
    hand = data.body(HAND)
    pads = np.array([0.0, 0.0, 0.1424])  # of the pads' middle, where they are 40 mm apart
    data.qpos[13:16] = np.array([9.0, 0.0, 0.0]) if away else hand.xpos + hand.xmat.reshape(3, 3) @ pads
    mujoco.mju_mat2Quat(data.qpos[16:20], hand.xmat)
    data.ctrl[7:] = ROBOTIQ.servos(np.array([opening_m]))[0]
    for _ in range(round(seconds * 1000.0)):
        mujoco.mj_step(model, data)
    return data


def in_hand(data: mujoco.MjData, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Position and axes of a body in the hand's frame."""
    hand, body = data.body(HAND), data.body(name)
    turn = hand.xmat.reshape(3, 3).T
    return turn @ (body.xpos - hand.xpos), turn @ body.xmat.reshape(3, 3)


@pytest.mark.parametrize("opening_m", [0.001, 0.02, 0.04, 0.06, 0.085])
def test_the_pads_are_as_far_apart_as_told_and_parallel(model: mujoco.MjModel, opening_m: float) -> None:
    data = held(model, opening_m, 1.0, away=True)
    places, faces = [], []
    for side in ("left", "right"):
        at, axes = in_hand(data, f"{side}_inner_finger")
        assert axes[2, 2] > 1.0 - 1e-6  # the finger points where the hand does
        places.append(at)
        faces.append(at - axes[:, 1] * PAD_FACE_M)
    angle = float(knuckle_of(np.array([opening_m]))[0, 0])
    crank = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]) @ CRANK_M
    assert np.abs(places[1][1:] - [PIVOT_M + crank[0], 0.054904 + crank[1]]).max() < 1e-4
    assert np.linalg.norm(faces[0] - faces[1]) == pytest.approx(opening_m, abs=1e-4)
    assert ROBOTIQ.opened(data.qpos[7:13]) == pytest.approx(opening_m, abs=1e-4)
    assert ROBOTIQ.opening_of(data.ctrl[7:]) == pytest.approx(opening_m, abs=1e-9)


def test_a_block_of_half_a_kilogram_is_held_for_two_seconds_by_the_torque_over_its_lever(model: mujoco.MjModel) -> None:
    data = held(model, 0.0, 0.5)
    before = in_hand(data, "block")[0]
    forces = {"left": 0.0, "right": 0.0}
    force = np.zeros(6)
    block_geom = int(model.geom("block").id)
    for index in range(data.ncon):
        pair = [int(geom) for geom in data.contact.geom[index]]
        if block_geom in pair:
            name = model.body(int(model.geom_bodyid[sum(pair) - block_geom])).name
            mujoco.mj_contactForce(model, data, index, force)
            assert name in ROBOTIQ.tips
            forces[name.split("_")[0]] += force[0]
    angle = float(knuckle_of(np.array([0.04]))[0, 0])
    pressed = TORQUE / (2.0 * RADIUS_M * math.sin(angle + ANGLE_RAD))
    assert forces["left"] == pytest.approx(pressed, rel=0.05) and forces["right"] == pytest.approx(pressed, rel=0.05)
    assert 2.0 * 0.5 * pressed > 3.0 * 0.5 * 9.81  # friction 0.5 on two sides could bear it three times
    for _ in range(2000):
        mujoco.mj_step(model, data)
    assert np.linalg.norm(in_hand(data, "block")[0] - before) < 1e-3
    for name, (ratio,) in zip(JOINTS, ROBOTIQ.ratios, strict=True):  # the linkage stays closed under load
        assert data.joint(name).qpos[0] == pytest.approx(ratio * data.joint(JOINTS[0]).qpos[0], abs=2e-3)


def test_open_fingers_let_the_same_block_fall(model: mujoco.MjModel) -> None:
    assert in_hand(held(model, 0.06, 0.5), "block")[0][2] > 0.3


def test_the_arm_with_it_pushes_and_lifts(model: mujoco.MjModel, tmp_path: Path) -> None:
    settings = TrialSettings(gripper="robotiq")
    shut = run_trial(drawer(tmp_path / "drawer"), Task("close", Verb.CLOSE), tmp_path / "one", False, settings)
    assert (shut["outcome"], shut["tool"]) == ("done", "arm")
    thing = block(tmp_path / "block", 0.05, 0.2)
    assert run_trial(thing, Task("grasp", Verb.GRASP), tmp_path / "two", False, settings)["outcome"] == "done"


def test_its_servo_is_told_and_its_joints_are_where_that_leads(model: mujoco.MjModel, tmp_path: Path) -> None:
    stage = build_stage(block(tmp_path / "block", 0.05, 0.2), franka_spec(ROBOTIQ), base_at(0.0, 1.0), gripper=ROBOTIQ)
    told = np.array([*HOME, 0.4])
    track = record(stage, ToolPlan(stage.base, np.array([0.0, 0.5]), np.array([told, told]), ("settle", "rest")), {})
    assert track.tool.shape[1] == 13 and not any(name.startswith(f"tool/{OWN_HAND[1]}") for name in track.links)
    assert np.abs(track.tool[-1, 7:] - [0.4, -0.4, 0.4, 0.4, -0.4, 0.4]).max() < 2e-3


def test_what_is_missing_is_said_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"pip install --no-deps robosuite==1\.5\.2"):
        robotiq_file()
    assert "--no-deps" in REMEDY
    with pytest.raises(UnknownChoiceError, match="panda"):
        gripper_of("robotik")
    assert all(gripper_of(name).name == name for name in GRIPPERS)
