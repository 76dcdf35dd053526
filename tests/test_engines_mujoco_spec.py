"""A URDF as a MuJoCo specification: names, terms, meshes and filters are as the URDF states them."""

from pathlib import Path

import numpy as np
import pytest

from schemas.errors import AssetError
from schemas.vocabulary import Engine, FailureMode
from tests.assets import box_obj
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, box, mesh, swing, write_urdf
from tests.engine_worlds import held, on_plane

mujoco = pytest.importorskip("mujoco")

from asset2sim.engines.mujoco_spec import give_options, object_spec  # noqa: E402

CUBE = ((box(0.1, 0.1, 0.1), ORIGIN),)


def test_joints_have_every_term_of_the_urdf(tmp_path: Path) -> None:
    terms = {"damping": 0.3, "friction": 0.2, "stiffness": 4.0, "reference": 0.7, "lower": -0.5, "upper": 1.5}
    model = object_spec(swing(tmp_path, UrdfLink("part"), **terms), free=True, contact_friction=0.4).compile()
    joint, dof = model.joint("j"), model.joint("j").dofadr[0]
    assert float(np.ravel(model.dof_damping[dof])[0]) == pytest.approx(0.3)
    assert float(np.ravel(joint.stiffness)[0]) == pytest.approx(4.0)
    assert model.dof_frictionloss[dof] == pytest.approx(0.2)
    assert model.qpos_spring[joint.qposadr[0]] == pytest.approx(0.7)
    assert joint.range == pytest.approx([-0.5, 1.5]) and joint.limited


def test_names_and_fixed_links_are_kept_and_mass_is_as_authored(tmp_path: Path) -> None:
    links = [UrdfLink("root", 2.0, shapes=CUBE), UrdfLink("plate", 0.5, shapes=CUBE), UrdfLink("knob", 0.25)]
    joints = [UrdfJoint("glue", "fixed", "root", "plate"), UrdfJoint("slide", "prismatic", "plate", "knob")]
    model = object_spec(write_urdf(tmp_path, links, joints), free=True, contact_friction=0.5).compile()
    assert [model.body(i).name for i in range(1, model.nbody)] == ["root", "plate", "knob"]
    np.testing.assert_allclose(model.body_mass[1:], [2.0, 0.5, 0.25])
    assert (model.geom_friction[:, 0] == 0.5).all()


def test_a_moving_link_without_mass_is_refused_and_none_is_made_up(tmp_path: Path) -> None:
    text = f'<robot name="r"><link name="a"><collision><geometry>{box(1, 1, 1)}</geometry></collision></link></robot>'
    (tmp_path / "object.urdf").write_text(text, encoding="utf-8")
    refusal = pytest.raises(AssetError, match=r"MuJoCo refuses object\.urdf and says: .*mass")
    with refusal as caught, on_plane(Engine.MUJOCO, tmp_path / "object.urdf"):
        pass
    assert caught.value.mode is FailureMode.ENGINE_REFUSED


def test_a_missing_mesh_is_refused_with_its_name(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path, [UrdfLink("part", shapes=((mesh("gone.obj"), ORIGIN),))])
    with pytest.raises(AssetError, match=r"gone\.obj"), on_plane(Engine.MUJOCO, urdf):
        pass


def test_meshes_of_the_same_file_name_in_two_folders_stay_apart(tmp_path: Path) -> None:
    for folder, size in (("one", 0.1), ("two", 0.3)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "part.obj").write_text(box_obj((-size,) * 3, (size,) * 3), encoding="utf-8")
    shapes = ((mesh("one/part.obj"), ORIGIN), (mesh("two/part.obj"), (2.0, 0.0, 0.0)))
    spec = object_spec(write_urdf(tmp_path, [UrdfLink("a", shapes=shapes)]), free=True, contact_friction=0.5)
    assert [item.file for item in spec.meshes] == ["one/part.obj", "two/part.obj"]
    model = spec.compile()
    sizes = sorted(float(np.abs(model.mesh_vert[start : start + 8]).max()) for start in model.mesh_vertadr)
    assert sizes == pytest.approx([0.1, 0.3])


@pytest.mark.system
def test_a_mesh_that_was_rewritten_is_read_anew(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path, [UrdfLink("a", shapes=((mesh("part.obj"), ORIGIN),))])
    for size in (0.1, 0.2, 0.1):
        (tmp_path / "part.obj").write_text(box_obj((-size,) * 3, (size,) * 3), encoding="utf-8")
        with on_plane(Engine.MUJOCO, urdf) as world:
            assert world.root_pose()[0][2] == pytest.approx(size)


def test_visuals_are_left_out(tmp_path: Path) -> None:
    text = (
        '<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" '
        'iyz="0"/></inertial><visual name="twin"><geometry><mesh filename="gone.obj"/></geometry></visual>'
        '<visual name="twin"><geometry><mesh filename="gone.dae"/></geometry></visual>'
        f"<collision><geometry>{box(1, 1, 1)}</geometry></collision></link></robot>"
    )
    (tmp_path / "object.urdf").write_text(text, encoding="utf-8")
    assert object_spec(tmp_path / "object.urdf", free=True, contact_friction=0.5).compile().ngeom == 1


@pytest.mark.parametrize(("limits", "free"), [((0.2, 0.2), False), ((0.5, -0.5), True)])
def test_limits_without_range_hold_the_joint_and_crossed_ones_do_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limits: tuple[float, float], free: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    urdf = swing(tmp_path, UrdfLink("part"), lower=limits[0], upper=limits[1])
    model = object_spec(urdf, free=False, contact_friction=0.5).compile()
    joint = model.joint("j")
    assert bool(joint.limited[0]) is not free
    assert free or joint.range == pytest.approx([0.2, 0.2], abs=1e-5)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()  # MuJoCo warns of it


def test_what_a_free_root_filters_a_held_one_filters_too(tmp_path: Path) -> None:
    names = ("root", "plate", "door", "handle", "drawer")
    joints = [
        UrdfJoint("a", "fixed", "root", "plate"),
        UrdfJoint("b", "revolute", "plate", "door"),
        UrdfJoint("c", "fixed", "door", "handle"),
        UrdfJoint("d", "prismatic", "root", "drawer", axis=(1.0, 0.0, 0.0)),
    ]
    urdf = write_urdf(tmp_path, [UrdfLink(name, shapes=CUBE) for name in names], joints)
    seen = []
    for free in (True, False):
        model = object_spec(urdf, free=free, contact_friction=0.5).compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        bodies = model.geom_bodyid[data.contact.geom]
        seen.append({frozenset(model.body(int(body)).name for body in pair) for pair in bodies})
    # The door with its handle, and the drawer, move against each other; all else hangs together or is one joint away.
    assert seen[0] == seen[1] == {frozenset(("door", "drawer")), frozenset(("handle", "drawer"))}


@pytest.mark.system
def test_an_explosion_is_not_reset_and_writes_no_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    urdf = swing(tmp_path, UrdfLink("part", 1.0), stiffness=1e7)
    spec = object_spec(urdf, free=False, contact_friction=0.5)
    give_options(spec, 1.0 / 60.0, 9.81)
    assert spec.option.disableflags & int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    with held(Engine.MUJOCO, urdf, 1.0 / 60.0) as world:
        world.place({"j": 1.0})
        world.step(600)
        assert not np.isfinite(world.positions()).all() or np.abs(world.velocities()).max() > 100.0
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_a_rolling_resistance_that_the_urdf_states_counts_in_every_contact(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path, [UrdfLink("root", 2.0, shapes=CUBE)], [])
    plain = object_spec(urdf, free=True, contact_friction=0.5).compile()
    assert (plain.geom_condim == 3).all(), "without one nothing resists rolling"
    stated = "<contact><rolling_friction value='0.0005'/></contact></link>"
    urdf.write_text(urdf.read_text(encoding="utf-8").replace("</link>", stated), encoding="utf-8")
    model = object_spec(urdf, free=True, contact_friction=0.5).compile()
    assert (model.geom_condim == 6).all() and model.geom_friction[:, 2] == pytest.approx(0.0005)
