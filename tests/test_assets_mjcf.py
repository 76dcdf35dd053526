import math
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asset2sim.assets.exports import left_out
from asset2sim.assets.exports.mjcf import HOME, SCENE_NAME, export_mjcf
from asset2sim.assets.exports.refined_object import MJCF_NAME
from asset2sim.engines.contacts import penetration
from asset2sim.engines.registry import open_world
from asset2sim.load import load
from schemas.errors import AssetError
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, Export
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, prior, sample
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, box, mesh, sphere
from tests.exported import ARM_INERTIA, BASE, FRICTION, arm, refined

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")

STEP_S = 1e-3
CHECK_STEP_S = EngineSettings().timestep_s


def held(folder: Path, overlay: PhysicsOverlay) -> tuple[Any, Any]:
    """The exported object with its root held, as a user would: the free joint removed."""
    spec = mujoco.MjSpec.from_file(str(export_mjcf(folder, overlay, CHECK_STEP_S)))
    spec.delete(spec.joint("root"))
    for key in spec.keys:
        spec.delete(key)
    model = spec.compile()
    model.opt.timestep = STEP_S
    return model, mujoco.MjData(model)


def run(model: Any, data: Any, seconds: float) -> None:
    mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))


def home(path: Path) -> tuple[Any, Any]:
    """A file's model at the keyframe of the initial state."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key(HOME).id)
    return model, data


def test_a_joints_speed_decays_at_damping_over_inertia(tmp_path: Path) -> None:
    damping = ARM_INERTIA / 0.5
    model, data = held(tmp_path, arm(tmp_path, damping=damping))
    data.qvel[0] = 1.0
    run(model, data, 0.5)
    assert data.qvel[0] == pytest.approx(math.exp(-1.0), rel=0.01)


def test_a_slider_decays_at_damping_over_mass(tmp_path: Path) -> None:
    drawer = UrdfLink("drawer", mass=2.0)
    slide = UrdfJoint("slide", "prismatic", "base", "drawer", axis=(1, 0, 0), damping=4.0)
    model, data = held(tmp_path, refined(tmp_path, [BASE, drawer], [slide]))
    data.qvel[0] = 0.5
    run(model, data, 0.5)
    assert data.qvel[0] == pytest.approx(0.5 * math.exp(-1.0), rel=0.01)


def test_a_spring_swings_at_its_frequency_and_rests_at_its_reference(tmp_path: Path) -> None:
    stiffness = 0.5
    model, data = held(tmp_path, arm(tmp_path, stiffness=stiffness, reference=0.4))
    track = []
    for _ in range(round(2.0 / STEP_S)):
        mujoco.mj_step(model, data)
        track.append(float(data.qpos[0]) - 0.4)
    crossings = np.flatnonzero(np.diff(np.sign(track)))
    half = float(np.diff(crossings).mean()) * STEP_S
    assert 2.0 * half == pytest.approx(2.0 * math.pi * math.sqrt(ARM_INERTIA / stiffness), rel=0.02)
    (tmp_path / "damped").mkdir()
    damped, state = held(tmp_path / "damped", arm(tmp_path / "damped", stiffness=0.5, damping=0.05, reference=0.4))
    run(damped, state, 3.0)
    assert state.qpos[0] == pytest.approx(0.4, abs=1e-3)


def test_armature_adds_to_what_a_spring_moves(tmp_path: Path) -> None:
    model, data = held(tmp_path, arm(tmp_path, stiffness=0.5, armature=0.03))
    assert model.dof_armature[0] == 0.03 and model.jnt_solimp[0][0] == 0.9999
    data.qpos[0] = 0.2
    run(model, data, math.pi / 2.0 * math.sqrt((ARM_INERTIA + 0.03) / 0.5))
    assert data.qpos[0] == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize(("effort", "opens"), [(0.9, False), (1.1, True)])
def test_a_seal_lets_go_at_its_torque_and_a_loader_exerts_it_once(tmp_path: Path, effort: float, opens: bool) -> None:
    seal = (50.0, 0.03, -1.0, 0.0)
    model, data = held(tmp_path, arm(tmp_path, damping=0.05, bias=seal, lower=0.0, upper=1.5))
    data.qfrc_applied[0] = effort
    run(model, data, 1.0)
    assert (float(data.qpos[0]) > 0.1) == opens
    assert list(model.actuator_biasprm[0][:2]) == pytest.approx([-1.5, 50.0])
    item = load(tmp_path, "mujoco", fixed=True)
    assert item.model.nu == 0
    item.apply_effort({"j": effort})
    for _ in range(240):
        item.step()
    assert (item.positions()["j"] > 0.1) == opens


def test_a_mechanism_stronger_than_the_effort_limit_is_whole(tmp_path: Path) -> None:
    """A garage door's springs exert more than a motor may on its joint: 300 N·m against 100."""
    model, data = held(tmp_path, arm(tmp_path, bias=(1e6, -1.0, 0.0, 300.0), lower=0.0, upper=1.5))
    mujoco.mj_forward(model, data)
    assert float(data.qfrc_actuator[0]) == pytest.approx(300.0)


@pytest.mark.parametrize(("turned", "comes_to"), [(0.3, 0.1), (0.4, 0.6), (50.3, 50.1), (-49.6, -49.4)])
def test_a_dial_goes_to_the_nearest_click(tmp_path: Path, turned: float, comes_to: float) -> None:
    dial = (-5.0, 0.1, -0.1, 0.1, 0.5)
    model, data = held(tmp_path, arm(tmp_path, bias=dial, type="continuous", damping=0.01, friction=0.01))
    data.qpos[0] = turned
    run(model, data, 2.0)
    assert float(data.qpos[0]) == pytest.approx(comes_to, abs=0.5 / (2.0 * math.pi) * math.asin(0.1) + 1e-3)


@pytest.mark.parametrize(("effort", "leaves"), [(0.105, False), (0.125, True)])
def test_a_dial_leaves_its_click_at_its_torque_and_friction(tmp_path: Path, effort: float, leaves: bool) -> None:
    dial = (-5.0, 0.1, -0.1, 0.1, 0.5)
    model, data = held(tmp_path, arm(tmp_path, bias=dial, type="continuous", damping=0.1, friction=0.01))
    data.qpos[0], data.qfrc_applied[0] = 0.1, effort
    run(model, data, 4.0)
    assert (float(data.qpos[0]) > 0.6) == leaves


SEAL, CLICKS = (50.0, 0.03, -1.0, 0.0), (-5.0, 0.0, -0.1, 0.1, 0.5)


@pytest.mark.parametrize(
    ("bias", "rolling_m", "lacking"),
    [
        (SEAL, 0.0, {Export.USD: "j (seal)", Export.SDF: "j (seal)"}),
        (CLICKS, 0.0, {Export.USD: "clicks of j", Export.SDF: "clicks of j"}),
        ((0.0,), 1e-3, {Export.USD: "rolling", Export.SDF: "rolling"}),
        ((0.0,), 0.0, {}),
    ],
)
def test_a_format_says_what_it_has_no_words_for(
    tmp_path: Path, bias: tuple[float, ...], rolling_m: float, lacking: dict[Export, str]
) -> None:
    overlay = arm(tmp_path, bias=bias).model_copy(update={"rolling_friction_m": rolling_m})
    found = {export: " ".join(item.message for item in left_out(overlay, export)) for export in Export}
    assert {export for export, said in found.items() if said} == set(lacking)
    assert all(said in found[export] for export, said in lacking.items())


@pytest.mark.parametrize(("share", "moves"), [(0.95, False), (1.1, True)])
def test_dry_friction_holds_up_to_its_torque(tmp_path: Path, share: float, moves: bool) -> None:
    model, data = held(tmp_path, arm(tmp_path, friction=0.02))
    data.qfrc_applied[0] = share * 0.02
    run(model, data, 1.0)
    assert (abs(float(data.qpos[0])) > 0.05) == moves
    if not moves:
        assert abs(float(data.qpos[0])) < 2e-3


def test_a_joint_stops_at_its_limits(tmp_path: Path) -> None:
    model, data = held(tmp_path, arm(tmp_path, lower=-0.2, upper=0.3))
    data.qfrc_applied[0] = 0.01
    run(model, data, 2.0)
    assert data.qpos[0] == pytest.approx(0.3, abs=0.01)


def test_masses_and_tensors_are_those_of_the_urdf_to_the_last_digit(tmp_path: Path) -> None:
    tensor = (0.0123456789012, 1.1e-3, -2.2e-3, 0.0223456789012, 3.3e-4, 0.0253456789012)
    part = UrdfLink("part", mass=1.23456789012, com=(0.1, -0.2, 0.3), inertia=tensor, shapes=((sphere(0.05), ORIGIN),))
    joint = UrdfJoint("j", "revolute", "base", "part", xyz=(0.5, 0, 0))
    model = mujoco.MjModel.from_xml_path(
        str(export_mjcf(tmp_path, refined(tmp_path, [BASE, part], [joint]), CHECK_STEP_S))
    )
    index = model.body("part").id
    assert model.body_mass[index] == 1.23456789012
    assert model.body_ipos[index].tolist() == [0.1, -0.2, 0.3]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[index])
    found = turn.reshape(3, 3) @ np.diag(model.body_inertia[index]) @ turn.reshape(3, 3).T
    xx, xy, xz, yy, yz, zz = tensor
    assert found == pytest.approx(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), rel=1e-9, abs=1e-12)
    assert model.body_mass.sum() == pytest.approx(11.23456789012, abs=1e-12)


def test_the_keyframe_is_the_initial_state_with_its_lowest_point_on_the_ground(tmp_path: Path) -> None:
    pole = UrdfLink("pole", mass=0.5, shapes=((box(0.02, 0.02, 0.5), (0.0, 0.0, 0.25)),))
    joint = UrdfJoint("j", "revolute", "base", "pole", axis=(0, 1, 0), xyz=(0.3, 0, 0), friction=5.0)
    overlay = refined(tmp_path, [BASE, pole], [joint], {"j": 2.5})
    export_mjcf(tmp_path, overlay, CHECK_STEP_S)
    model, data = home(tmp_path / SCENE_NAME)
    assert data.qpos[7] == 2.5
    reach = 0.5 * math.cos(math.pi - 2.5) + 0.01 * math.sin(math.pi - 2.5)
    assert data.qpos[2] == pytest.approx(reach, abs=1e-9)
    mujoco.mj_forward(model, data)
    ground = [contact.dist for contact in data.contact if model.geom("floor").id in contact.geom]
    assert min(ground, default=0.0) > -1e-6


def test_it_rests_on_the_floor_of_its_scene(tmp_path: Path) -> None:
    lid = UrdfLink("lid", mass=0.2, shapes=((box(0.2, 0.2, 0.01), (0.1, 0.0, 0.005)),))
    joint = UrdfJoint("j", "revolute", "base", "lid", axis=(0, -1, 0), xyz=(-0.1, 0, 0.06), lower=0.0, upper=1.5,
                      damping=0.01, friction=0.3)  # fmt: skip
    export_mjcf(tmp_path, refined(tmp_path, [BASE, lid], [joint], {"j": 0.7}), CHECK_STEP_S)
    model, data = home(tmp_path / SCENE_NAME)
    start = data.qpos.copy()
    run(model, data, 2.0)
    assert np.abs(data.qpos[:3] - start[:3]).max() < 1e-3
    assert data.qpos[7] == pytest.approx(0.7, abs=0.01)
    assert np.abs(data.qvel).max() < 0.01


@pytest.mark.parametrize(("share", "slides"), [(0.9, False), (1.1, True)])
def test_the_objects_own_friction_counts_on_any_floor(tmp_path: Path, share: float, slides: bool) -> None:
    export_mjcf(tmp_path, refined(tmp_path, [BASE], []), CHECK_STEP_S)
    model, data = home(tmp_path / SCENE_NAME)
    assert model.geom("floor").friction[0] == 1.0
    angle = math.atan(share * FRICTION)
    model.opt.gravity[:] = 9.81 * np.array([math.sin(angle), 0.0, -math.cos(angle)])
    run(model, data, 1.0)
    assert (abs(float(data.qpos[0])) > 0.05) == slides
    if not slides:
        assert abs(float(data.qpos[0])) < 5e-3


@pytest.mark.system
def test_it_compiles_and_runs_from_its_folder_alone(tmp_path: Path) -> None:
    folder = tmp_path / "there"
    (folder / "collision").mkdir(parents=True)
    (folder / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n")
    corners = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (folder / "collision" / "a.obj").write_text(corners)
    overlay = refined(folder, [UrdfLink("body", shapes=((mesh("collision/a.obj"), ORIGIN),))], [])
    urdf = folder / "mobility.urdf"
    flat = '<visual name="same"><geometry><mesh filename="flat.obj" scale="0.1 0.1 0.1"/></geometry></visual>'
    urdf.write_text(urdf.read_text().replace("</link>", flat + flat + "</link>"))
    export_mjcf(folder, overlay, CHECK_STEP_S)
    shutil.move(folder, tmp_path / "elsewhere with a space")
    program = (
        f"import mujoco; m = mujoco.MjModel.from_xml_path('{SCENE_NAME}'); d = mujoco.MjData(m); "
        "mujoco.mj_step(m, d, nstep=100); print(m.nmesh, m.ngeom, mujoco.MjModel.from_xml_path('mobility.xml').nkey)"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path / "elsewhere with a space", capture_output=True, text=True,
        check=True, timeout=300,
    )  # fmt: skip
    assert ended.stdout.split() == ["2", "3", "1"]


def test_links_next_to_each_other_do_not_collide_even_with_the_root_held(tmp_path: Path) -> None:
    foot = UrdfLink("foot", shapes=((box(0.2, 0.2, 0.2), ORIGIN),))
    lid = UrdfLink("lid", mass=0.2, shapes=((box(0.2, 0.2, 0.2), ORIGIN),))
    joints = [UrdfJoint("glue", "fixed", "base", "foot"), UrdfJoint("j", "revolute", "foot", "lid")]
    model, data = held(tmp_path, refined(tmp_path, [BASE, foot, lid], joints))
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


def test_a_continuous_joint_has_no_limits_and_a_locked_one_no_range(tmp_path: Path) -> None:
    wheel, stuck = UrdfLink("wheel"), UrdfLink("stuck")
    joints = [
        UrdfJoint("turn", "continuous", "base", "wheel"),
        UrdfJoint("held", "revolute", "base", "stuck", lower=0.5, upper=0.5),
    ]
    overlay = refined(tmp_path, [BASE, wheel, stuck], joints, {"held": 0.5})
    model = mujoco.MjModel.from_xml_path(str(export_mjcf(tmp_path, overlay, CHECK_STEP_S)))
    assert not model.joint("turn").limited[0]
    assert model.joint("held").limited[0]
    assert float(np.ptp(model.joint("held").range)) == pytest.approx(0.0, abs=1e-5)


def test_a_link_without_an_inertial_is_refused(tmp_path: Path) -> None:
    overlay = refined(tmp_path, [BASE], [])
    urdf = tmp_path / "mobility.urdf"
    urdf.write_text('<robot name="object"><link name="base"/></robot>')
    with pytest.raises(AssetError, match="link 'base' has no mass"):
        export_mjcf(tmp_path, overlay, CHECK_STEP_S)


def test_the_mjcf_is_what_the_mujoco_engine_measures(tmp_path: Path) -> None:
    spec_module = pytest.importorskip("asset2sim.engines.mujoco_spec")
    lid = UrdfLink("lid", mass=0.2, com=(0.1, 0, 0), shapes=((box(0.2, 0.2, 0.01), (0.1, 0.0, 0.005)),))
    joint = UrdfJoint("j", "revolute", "base", "lid", axis=(0, -1, 0), xyz=(-0.1, 0, 0.06), lower=-0.1, upper=1.5,
                      damping=0.013, friction=0.3, stiffness=0.7, reference=0.2)  # fmt: skip
    overlay = refined(tmp_path, [BASE, lid], [joint], {"j": 0.7})
    ours = mujoco.MjModel.from_xml_path(str(export_mjcf(tmp_path, overlay, 1.0 / 180.0)))
    spec = spec_module.object_spec(tmp_path / "mobility.urdf", free=True, contact_friction=FRICTION)
    spec_module.give_options(spec, 1.0 / 180.0, 9.81)
    measured = spec.compile()
    for field in ("body_mass", "body_ipos", "dof_damping", "dof_frictionloss", "jnt_stiffness", "jnt_range", "jnt_axis",
                  "jnt_limited", "jnt_pos", "dof_armature", "qpos_spring", "geom_size", "geom_pos", "geom_friction",
                  "geom_solref", "geom_solimp", "geom_margin", "geom_gap", "geom_condim", "jnt_margin"):  # fmt: skip
        mine, theirs = getattr(ours, field), getattr(measured, field)
        if field == "qpos_spring":
            mine, theirs = mine[7:], theirs[7:]
        assert mine == pytest.approx(theirs, abs=1e-9), field
    assert np.sort(ours.body_inertia) == pytest.approx(np.sort(measured.body_inertia), rel=1e-9)
    for field in ("dof_solref", "dof_solimp"):  # those of the root's free joint have no effect
        assert (getattr(ours, field)[6:] == getattr(measured, field)[6:]).all(), field
    for field in ("jnt_solref", "jnt_solimp"):
        assert (getattr(ours, field)[1:] == getattr(measured, field)[1:]).all(), field
    for field in ("timestep", "gravity", "integrator", "solver", "cone", "impratio", "iterations", "tolerance",
                  "ls_iterations", "ls_tolerance", "noslip_iterations", "o_margin", "density", "wind"):  # fmt: skip
        assert np.all(getattr(ours.opt, field) == getattr(measured.opt, field)), field
    assert ours.geom_solref[0].tolist() == [3.0 / 180.0, 1.0]
    # In the checks a state that is no longer a number must show.
    assert measured.opt.disableflags ^ ours.opt.disableflags == int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    assert MJCF_NAME == "mobility.xml"


@pytest.mark.system
def test_a_refined_object_rests_as_it_does_in_the_engine_that_judged_it(tmp_path: Path) -> None:
    settings = NO_VIEWS.model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,), interact=False)})
    overlay = refine_asset(sample("storage_sideboard"), tmp_path, settings, prior).overlay
    assert overlay is not None
    folder = tmp_path / "assets" / "storage_sideboard"
    export_mjcf(folder, overlay, CHECK_STEP_S)
    model, data = home(folder / SCENE_NAME)
    assert model.opt.timestep == settings.engine.timestep_s
    assert model.body_mass.sum() == pytest.approx(overlay.mass_kg, rel=1e-6)
    mujoco.mj_forward(model, data)
    floor = model.geom("floor").id
    phi = sum(max(0.0, -contact.dist) for contact in data.contact if floor not in contact.geom)
    opened = open_world(
        Engine.MUJOCO, folder / "mobility.urdf", plane=True, timestep_s=settings.engine.timestep_s,
        contact_friction=overlay.contact_friction,
    )  # fmt: skip
    with opened as world:
        world.place(overlay.initial_positions)
        assert phi == pytest.approx(penetration(world.contacts()), abs=1e-5)
        assert data.qpos[2] == pytest.approx(world.root_pose()[0][2], abs=1e-6)
        run(model, data, 2.0)
        world.step(round(2.0 / world.timestep_s))
        assert np.abs(data.qpos[:3] - world.root_pose()[0]).max() < 1e-3
        for name, position in zip(world.joint_names, world.positions(), strict=True):
            assert data.joint(name).qpos[0] == pytest.approx(position, abs=5e-3), name
