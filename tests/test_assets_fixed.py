"""Fixed objects as files: every format says that the root is held, and plain loaders leave it where it is."""

from pathlib import Path

import mujoco
import numpy as np
import pybullet
import pytest
from pybullet_utils.bullet_client import BulletClient

from asset2sim.assets.exports.mjcf import export_mjcf
from asset2sim.assets.exports.refined_object import CLEARANCE_M, read_object
from asset2sim.assets.exports.usd import export_usd
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.base import JOINT, WORLD, hung_from_world
from schemas.overlay import PhysicsOverlay
from schemas.support import Support, SupportKind
from tests.exported import arm

FIXED = Support(kind=SupportKind.FIXED, confidence=1.0)


def fixed_arm(folder: Path) -> PhysicsOverlay:
    return arm(folder, 0.4, damping=0.1).model_copy(update={"support": FIXED})


@pytest.mark.system
def test_a_fixed_objects_mjcf_has_no_free_joint_and_stays(tmp_path: Path) -> None:
    path = export_mjcf(tmp_path, fixed_arm(tmp_path), 1.0 / 240.0)
    model = mujoco.MjModel.from_xml_path(str(path.parent / "scene.xml"))
    assert (model.nq, model.nv) == (1, 1)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    assert data.qpos == pytest.approx([0.4])
    mujoco.mj_forward(model, data)
    before = data.body("base").xpos.copy()
    # The base's box reaches 0.05 m below its origin, and hangs clear of the floor.
    assert before == pytest.approx([0.0, 0.0, 0.05 + CLEARANCE_M])
    for _ in range(480):
        mujoco.mj_step(model, data)
    assert data.body("base").xpos == pytest.approx(before, abs=0.0)


def test_a_fixed_objects_usd_is_held_by_a_joint_in_its_own_frame(tmp_path: Path) -> None:
    usd = pytest.importorskip("pxr.Usd")
    from pxr import Gf, UsdGeom, UsdPhysics

    export = export_usd(tmp_path, fixed_arm(tmp_path))
    stage = usd.Stage.Open(str(export.path))
    top = stage.GetDefaultPrim()
    base = UsdPhysics.FixedJoint(stage.GetPrimAtPath(top.GetPath().AppendPath("joints/base")))
    assert base.GetPrim().HasAPI(UsdPhysics.ArticulationRootAPI)
    roots = [prim.GetPath() for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.ArticulationRootAPI)]
    assert roots == [base.GetPath()], "the held root is the articulation's only root"
    [held] = base.GetBody1Rel().GetTargets()
    assert base.GetBody0Rel().GetTargets() == [top.GetPath()]
    # Both frames of the joint meet, also where the object is placed elsewhere in a scene.
    UsdGeom.Xformable(top).AddTranslateOp().Set(Gf.Vec3d(1.0, 2.0, 3.0))
    cache = UsdGeom.XformCache()
    link = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(held)).ExtractTranslation()
    frame = cache.GetLocalToWorldTransform(top).Transform(Gf.Vec3d(base.GetLocalPos0Attr().Get()))
    assert np.allclose(link, frame, atol=1e-6) and np.allclose(frame, (1.0, 2.0, 3.05 + CLEARANCE_M), atol=1e-6)


@pytest.mark.system
def test_a_urdf_hung_from_the_world_stays_without_a_flag(tmp_path: Path) -> None:
    overlay = fixed_arm(tmp_path)
    urdf = tmp_path / URDF_NAME
    height = read_object(tmp_path, overlay).height_to_stand(overlay.initial_positions)
    urdf.write_bytes(hung_from_world(urdf.read_bytes(), height))
    model = mujoco.MjSpec.from_file(str(urdf)).compile()
    assert model.nv == 1
    client = BulletClient(connection_mode=pybullet.DIRECT)
    try:
        client.setGravity(0.0, 0.0, -9.81)
        body = client.loadURDF(str(urdf), flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
        names = {client.getJointInfo(body, i)[1].decode(): i for i in range(client.getNumJoints(body))}
        assert client.getBodyInfo(body)[0].decode() == WORLD and JOINT in names
        before = client.getLinkState(body, names[JOINT])[4]
        for _ in range(240):
            client.stepSimulation()
        after = client.getLinkState(body, names[JOINT], computeForwardKinematics=1)[4]
        assert after == pytest.approx(before, abs=1e-6) and before[2] == pytest.approx(0.05 + CLEARANCE_M)
    finally:
        client.disconnect()


def test_hanging_twice_changes_nothing_and_a_taken_name_is_avoided(tmp_path: Path) -> None:
    arm(tmp_path, name=JOINT)
    once = hung_from_world((tmp_path / URDF_NAME).read_bytes(), 0.0)
    assert hung_from_world(once, 0.0) == once
    assert once.count(f'name="{JOINT}"'.encode()) == 1 and f'name="{JOINT}_"'.encode() in once
