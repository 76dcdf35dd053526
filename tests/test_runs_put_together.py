"""A kitchen cut, refined by one command and put together again: its parts at their places, and opened one by one."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.commands import one_after_the_other
from tests.test_intake_split import MJCF, MOVED

mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.system
PLACE_M = 1e-4
"""Largest distance of a part from its place, m."""
OPENED, STILL = 0.9, 0.02
"""Share of its range by which a joint opens, and by which the others may move meanwhile."""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory, prefect_server: str) -> Path:
    """The kitchen's folder; the lamp's row of own numbers names a joint that it does not have."""
    folder = tmp_path_factory.mktemp("scenes")
    (folder / "data").mkdir()
    (folder / "data" / "kitchen.xml").write_text(MJCF)
    (folder / "data" / "overrides.csv").write_text("asset_id,joint:none\nkitchen.lamp,0.1\n")
    words = f"refine {folder}/data/kitchen.xml --out {folder}/out --split --engines pybullet --no-views --base world"
    refine = [*words.split(), "--no-report", "--workers", "2"]
    check = f"check {folder}/out/scenes/kitchen/scene.urdf --support fixed --engines pybullet".split()
    printed, checked = one_after_the_other([refine, check], prefect_server)
    assert "1 of 1 ok" in checked
    assert f"scenes:  {folder}/out/scenes" in printed
    return folder / "out" / "scenes" / "kitchen"


@pytest.fixture(scope="module")
def places() -> dict[str, Any]:
    """Link → its (3,) place in the authored kitchen, m."""
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return {model.body(body).name: data.xpos[body].copy() for body in range(1, model.nbody)}


def start(model: Any) -> Any:
    """The scene in its initial state."""
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
    mujoco.mj_forward(model, data)
    return data


def test_every_part_is_a_row_and_stands_in_the_whole(scene: Path) -> None:
    rows = json.loads((scene / "placement.json").read_text())["parts"]
    assert {row["part"]: row["made"] for row in rows} == dict.fromkeys(MOVED, "refined") | {"lamp": "authored"}
    assert [row["part"] for row in rows if row["free"]] == ["kettle"]
    assert (scene.parents[1] / "assets" / "kitchen.stove" / "mobility.urdf").is_file()
    assert not (scene.parents[1] / "assets" / "kitchen.lamp").exists()


def test_in_mujoco_each_part_is_at_its_place_and_opens_while_the_others_rest(
    scene: Path, places: dict[str, Any]
) -> None:
    plain = mujoco.MjModel.from_xml_path(str(scene / "scene.xml"))
    data = start(plain)
    for body in range(1, plain.nbody):
        name = plain.body(body).name.rpartition("/")[2]
        assert data.xpos[body] == pytest.approx(places[name], abs=PLACE_M), name
    joints = [index for index in range(plain.njnt) if plain.jnt_type[index] != mujoco.mjtJoint.mjJNT_FREE]
    assert len(joints) == sum(map(len, MOVED.values())) and plain.njnt == len(joints) + 1, "the kettle is free"
    for index in joints:
        spec = mujoco.MjSpec.from_file(str(scene / "scene.xml"))
        servo = spec.add_actuator(name="hand", target=plain.joint(index).name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_position(kp=500.0, dampratio=1.0)
        model = spec.compile()
        data = start(model)
        before = data.qpos.copy()
        for step in range(round(3.0 / model.opt.timestep)):
            data.actuator("hand").ctrl = model.jnt_range[index][1] * min(1.0, step * model.opt.timestep / 2.0)
            mujoco.mj_step(model, data)
        share = np.abs(data.qpos - before)[model.jnt_qposadr[joints]] / np.ptp(model.jnt_range[joints], axis=1)
        assert share[joints.index(index)] > OPENED, model.joint(index).name
        assert np.delete(share, joints.index(index)).max() < STILL


def test_in_pybullet_each_part_is_at_its_place_and_opens_while_the_others_rest(
    scene: Path, places: dict[str, Any]
) -> None:
    bullet = pytest.importorskip("pybullet")
    client = bullet.connect(bullet.DIRECT)
    try:
        flags = bullet.URDF_USE_SELF_COLLISION | bullet.URDF_USE_INERTIA_FROM_FILE
        held = bullet.loadURDF(str(scene / "scene.urdf"), useFixedBase=True, flags=flags, physicsClientId=client)
        bullet.setGravity(0, 0, -9.81, physicsClientId=client)
        infos = [bullet.getJointInfo(held, joint, physicsClientId=client) for joint in
                 range(bullet.getNumJoints(held, physicsClientId=client))]  # fmt: skip
        for info in infos:
            place = bullet.getLinkState(held, info[0], computeForwardKinematics=True, physicsClientId=client)[4]
            assert place == pytest.approx(places[info[12].decode()], abs=PLACE_M), info[12]
        index = {info[12].decode(): info[0] for info in infos}
        for pair in json.loads((scene / "placement.json").read_text())["do_not_collide"]:
            bullet.setCollisionFilterPair(held, held, *(index[name] for name in pair), False, physicsClientId=client)
        moving = [info for info in infos if info[2] != bullet.JOINT_FIXED]
        assert len(moving) == sum(map(len, MOVED.values()))
        for chosen in moving:
            for info in moving:
                bullet.resetJointState(held, info[0], 0.0, physicsClientId=client)
                goal = info[9] if info is chosen else 0.0
                bullet.setJointMotorControl2(held, info[0], bullet.POSITION_CONTROL, goal, force=100.0,
                                             maxVelocity=1.0, physicsClientId=client)  # fmt: skip
            for _ in range(240 * 3):
                bullet.stepSimulation(physicsClientId=client)
            for info in moving:
                share = abs(bullet.getJointState(held, info[0], physicsClientId=client)[0]) / (info[9] - info[8])
                assert share > OPENED if info is chosen else share < STILL, info[1]
    finally:
        bullet.disconnect(client)


def test_the_usd_has_every_part_at_its_place(scene: Path, places: dict[str, Any]) -> None:
    pxr = pytest.importorskip("pxr.UsdGeom")
    from pxr import Usd, UsdPhysics

    stage = Usd.Stage.Open(str(scene / "scene.usda"))
    bodies = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    assert {prim.GetDisplayName() for prim in bodies} == places.keys() - {"room"}
    for prim in bodies:
        at = pxr.Xformable(prim).ComputeLocalToWorldTransform(0).ExtractTranslation()
        assert list(at) == pytest.approx(places[prim.GetDisplayName()], abs=PLACE_M), prim.GetPath()
