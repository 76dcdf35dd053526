"""Contacts, standing and falling in every engine: depths, Φ, filters, heights and friction that a hand can compute."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from asset2sim.checks import rest
from asset2sim.engines.contacts import ContactPoint, penetration
from asset2sim.engines.static_object import contact_points, contacts_at, static_object
from asset2sim.engines.world import World
from schemas.base import Vector3
from schemas.errors import AssetError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, FailureMode
from tests.assets import box_obj
from tests.builders import (
    CUBE,
    ORIGIN,
    UrdfJoint,
    UrdfLink,
    ball_inertia,
    block_urdf,
    box,
    mesh,
    siblings,
    sphere,
    write_urdf,
)
from tests.engine_worlds import STEP, G, every_engine, held, on_plane, recorded

pytestmark = pytest.mark.system

BLOCK_INERTIA = ball_inertia(1.0 * 0.1**2 / 6.0)


def deepest(points: list[ContactPoint]) -> float:
    return max((-point.separation_m for point in points), default=0.0)


@every_engine
@pytest.mark.parametrize("plane", [False, True])
def test_overlapping_siblings_are_seen_at_their_depth_and_nothing_moves(
    tmp_path: Path, engine: Engine, plane: bool
) -> None:
    urdf = siblings(tmp_path, 0.01)
    with on_plane(engine, urdf) if plane else held(engine, urdf) as world:
        for position, depth in ((0.0, 0.01), (-0.005, 0.015), (0.009, 0.001), (0.0, 0.01)):
            world.place({"slide": position}, height_m=0.5)
            before = world.root_pose()
            points = world.contacts()
            over = [point for point in points if point.separation_m < 0.0]
            assert {frozenset((point.link_a, point.link_b)) for point in over} == {frozenset(("left", "right"))}
            assert deepest(points) == pytest.approx(depth, abs=2e-5)
            np.testing.assert_allclose(world.positions()[world.joint_names.index("slide")], position, atol=1e-7)
            np.testing.assert_array_equal(world.velocities(), 0.0)
            np.testing.assert_allclose(np.concatenate(world.root_pose()), np.concatenate(before), atol=1e-6)
        world.place({"slide": 0.02}, height_m=0.5)
        assert deepest(world.contacts()) == 0.0


@every_engine
def test_overlapping_meshes_are_seen_at_their_depth(tmp_path: Path, engine: Engine) -> None:
    (tmp_path / "cube.obj").write_text(box_obj((-0.05, -0.05, -0.05), (0.05, 0.05, 0.05)), encoding="utf-8")
    shapes = ((mesh("cube.obj"), ORIGIN),)
    links = [UrdfLink("root"), UrdfLink("left", shapes=shapes), UrdfLink("right", shapes=shapes)]
    joints = [
        UrdfJoint("glue", "revolute", "root", "left"),
        UrdfJoint("slide", "prismatic", "root", "right", axis=(1.0, 0.0, 0.0), xyz=(0.09, 0.0, 0.0)),
    ]
    with held(engine, write_urdf(tmp_path, links, joints)) as world:
        # PyBullet adds a margin of 1 mm to each of the two.
        assert deepest(world.contacts()) == pytest.approx(0.012 if engine is Engine.PYBULLET else 0.01, abs=1e-4)


@every_engine
@pytest.mark.parametrize("plane", [False, True])
@pytest.mark.parametrize("kind", ["revolute", "prismatic", "fixed"])
def test_a_link_and_its_parent_are_not_in_contact(tmp_path: Path, engine: Engine, plane: bool, kind: str) -> None:
    links = [UrdfLink("root", shapes=CUBE), UrdfLink("part", shapes=CUBE), UrdfLink("knob")]
    joints = [UrdfJoint("j", kind, "root", "part"), UrdfJoint("k", "revolute", "part", "knob")]
    urdf = write_urdf(tmp_path, links, joints)
    with on_plane(engine, urdf) if plane else held(engine, urdf) as world:
        world.place({}, height_m=0.5)
        assert deepest(world.contacts()) == 0.0


@every_engine
def test_a_link_and_its_grandparent_are_in_contact(tmp_path: Path, engine: Engine) -> None:
    links = [UrdfLink("root", shapes=CUBE), UrdfLink("arm"), UrdfLink("part", shapes=CUBE)]
    joints = [
        UrdfJoint("j", "revolute", "root", "arm"),
        UrdfJoint("k", "prismatic", "arm", "part", axis=(1.0, 0.0, 0.0)),
    ]
    with held(engine, write_urdf(tmp_path, links, joints)) as world:
        world.place({"k": 0.08})
        assert deepest(world.contacts()) == pytest.approx(0.02, abs=2e-5)


@every_engine
def test_a_released_block_falls_as_gravity_says(tmp_path: Path, engine: Engine) -> None:
    with on_plane(engine, block_urdf(tmp_path)) as world:
        world.place({}, height_m=1.0)
        heights = recorded(world, 0.4, lambda: float(world.root_pose()[0][2]))
        # h = g t² / 2, and g t Δt / 2 more where the speed is taken before the position; nothing turns it.
        assert heights[0] - heights[-1] == pytest.approx(0.5 * G * 0.4**2, rel=1.05 * STEP / 0.4)
        assert world.link_speeds() == pytest.approx([G * 0.4], rel=1e-3)
        assert abs(world.root_pose()[1][3]) == pytest.approx(1.0, abs=1e-6)
        assert world.lowest_m() == pytest.approx(1.0 - 0.5 * G * 0.4**2, abs=0.01)


@every_engine
@pytest.mark.parametrize("step", [1.0 / 240.0, 1.0 / 60.0])
def test_a_block_dropped_from_five_centimetres_comes_to_rest(tmp_path: Path, engine: Engine, step: float) -> None:
    with on_plane(engine, block_urdf(tmp_path), step) as world:
        world.place({}, height_m=0.05)
        speeds = recorded(world, 1.0, lambda: float(world.link_speeds().max()))
        assert speeds.max() == pytest.approx(math.sqrt(2 * G * 0.05), abs=1.5 * G * step)
        assert speeds[-1] < 5e-3
        assert abs(world.lowest_m()) < 2e-3
        rest = world.root_pose()
        world.step(round(1.0 / step))
        after = world.root_pose()
        assert np.linalg.norm(after[0] - rest[0]) < 1e-3
        assert (Rotation.from_quat(after[1]) * Rotation.from_quat(rest[1]).inv()).magnitude() < 1e-3


@every_engine
@pytest.mark.parametrize(("shape", "below"), [
    (box(0.1, 0.2, 0.3), 0.15), (sphere(0.05), 0.05), ('<cylinder radius="0.05" length="0.3"/>', 0.15),
])  # fmt: skip
def test_an_object_stands_at_its_height_shifted_and_tilted(
    tmp_path: Path, engine: Engine, shape: str, below: float
) -> None:
    urdf = write_urdf(tmp_path, [UrdfLink("body", 1.0, ORIGIN, ball_inertia(0.01), ((shape, ORIGIN),))])
    # PyBullet makes a cylinder a mesh, and adds a margin of 1 mm to it.
    near = 1.1e-3 if engine is Engine.PYBULLET and "cylinder" in shape else 2e-5
    with on_plane(engine, urdf) as world:
        world.place({}, height_m=0.02, shift_m=(0.3, -0.2))
        position, orientation = world.root_pose()
        np.testing.assert_allclose(position, (0.3, -0.2, 0.02 + below), atol=near)
        np.testing.assert_allclose(np.abs(orientation), (0, 0, 0, 1), atol=1e-6)
        assert world.lowest_m() == pytest.approx(0.02, abs=2e-5)
        world.place({}, height_m=0.02, tilt_rad=(math.pi / 2, 0.0, 0.0))
        assert world.root_pose()[0][2] == pytest.approx(0.02 + lying(shape), abs=1e-4 + near)
        world.place({}, height_m=0.02, tilt_rad=(0.03, -0.02, 0.0))
        assert world.lowest_m() == pytest.approx(0.02, abs=2e-5)
        turned = Rotation.from_quat(world.root_pose()[1]).as_rotvec()
        np.testing.assert_allclose(turned, (0.03, -0.02, 0.0), atol=1e-6)


def lying(shape: str) -> float:
    """Height of the middle of one of the shapes above after a quarter turn about x."""
    return 0.1 if "box" in shape else 0.05


@every_engine
def test_an_object_is_set_down_wherever_it_was_authored_and_however_its_joints_are(
    tmp_path: Path, engine: Engine
) -> None:
    base = UrdfLink("base", 20.0, (3.0, 0.0, 7.0), ball_inertia(0.5), ((box(0.3, 0.3, 0.2), (3.0, 0.0, 7.0)),))
    leg = UrdfLink("leg", 0.1, ORIGIN, ball_inertia(1e-3), ((box(0.02, 0.02, 0.02), (0.0, 0.0, -0.5)),))
    joint = UrdfJoint("j", "revolute", "base", "leg", axis=(0.0, 1.0, 0.0), xyz=(3.0, 0.0, 7.3))
    with on_plane(engine, write_urdf(tmp_path, [base, leg], [joint])) as world:
        # The leg reaches to 0.51 below its joint, which lies 0.3 over the base's middle; turned by 90° it is out of
        # the way.
        heights = []
        for position in (0.0, math.pi / 2):
            world.place({"j": position}, height_m=0.05)
            assert world.positions() == pytest.approx([position])
            assert world.lowest_m() == pytest.approx(0.05, abs=1e-4)
            heights.append(world.root_pose()[0][2])
        assert heights[0] - heights[1] == pytest.approx(0.51 - 0.3 - 0.1, abs=1e-4)


@every_engine
def test_link_speeds_are_those_of_the_centres_of_mass(tmp_path: Path, engine: Engine) -> None:
    arm = UrdfLink("arm", 0.1, (0.1, 0.0, 0.0), ball_inertia(1e-4))
    urdf = write_urdf(tmp_path, [UrdfLink("base", 10.0), arm], [UrdfJoint("j", "revolute", "base", "arm")])
    with held(engine, urdf, gravity=0.0) as world:
        world.kick({"j": 3.0})
        assert dict(zip(world.link_names, world.link_speeds(), strict=True))["arm"] == pytest.approx(0.3, rel=1e-4)
        world.step()
        assert world.link_speeds().max() == pytest.approx(0.3, rel=1e-3)
        world.place({})
        assert world.link_speeds().max() == pytest.approx(0.0, abs=1e-9)


def pushed(folder: Path) -> Path:
    """A table on which a block of 1 kg moves along x and z: on a carriage of 0.1 kg that slides along x alone."""
    table = UrdfLink("table", 10.0, ORIGIN, ball_inertia(1.0), ((box(4.0, 1.0, 0.2), (0.0, 0.0, -0.15)),))
    links = [table, UrdfLink("carriage", 0.1), UrdfLink("block", 1.0, ORIGIN, BLOCK_INERTIA, CUBE)]
    joints = [
        UrdfJoint("x", "prismatic", "table", "carriage", axis=(1.0, 0.0, 0.0)),
        UrdfJoint("z", "prismatic", "carriage", "block", axis=(0.0, 0.0, 1.0), lower=-0.1, upper=0.1),
    ]
    return write_urdf(folder, links, joints)


@every_engine
@pytest.mark.parametrize("step", [1.0 / 240.0, 1.0 / 60.0])
def test_a_pushed_block_holds_below_the_contact_friction_and_slides_above(
    tmp_path: Path, engine: Engine, step: float
) -> None:
    # The friction of the worlds is 0.5: it holds m g / 2 = 4.905 N.
    with held(engine, pushed(tmp_path), step) as world:
        world.step(round(0.25 / step))
        assert moved(world, 0.9 * 0.5 * G, 1.0) < 1e-3
        # a = (F - μ m g) / (m + carriage).
        assert moved(world, 1.5 * 0.5 * G, 0.5) == pytest.approx(0.5 * 0.5 * 0.5 * G / 1.1 * 0.5**2, rel=0.06)


def moved(world: World, effort: float, seconds: float) -> float:
    """How far ``x`` goes under an effort, m."""
    index = world.joint_names.index("x")
    start = world.positions()[index]
    world.push({"x": effort})
    world.step(round(seconds / world.timestep_s))
    return float(world.positions()[index] - start)


@every_engine
def test_an_object_on_a_plane_neither_wanders_nor_turns(tmp_path: Path, engine: Engine) -> None:
    lid = UrdfLink("lid", 0.3, (0.05, 0.0, 0.0), ball_inertia(1e-3), ((box(0.1, 0.1, 0.01), (0.05, 0.0, 0.0)),))
    body = UrdfLink("body", 1.0, ORIGIN, BLOCK_INERTIA, CUBE)
    joint = UrdfJoint("j", "revolute", "body", "lid", axis=(0.0, 1.0, 0.0), xyz=(-0.05, 0.0, 0.06), friction=0.5)
    with on_plane(engine, write_urdf(tmp_path, [body, lid], [joint])) as world:
        world.place({"j": -0.5}, height_m=2e-4)
        world.step(120)
        start, position = world.root_pose()[0], world.positions()[0]
        world.step(480)
        assert np.linalg.norm(world.root_pose()[0] - start) < 1e-4
        assert abs(world.positions()[0] - position) < 1e-3


@every_engine
def test_an_effort_within_a_free_object_moves_no_centre_of_mass(tmp_path: Path, engine: Engine) -> None:
    part = UrdfLink("part", 1.0, (0.2, 0.0, 0.0), ball_inertia(0.01), CUBE)
    base = UrdfLink("base", 2.0, ORIGIN, ball_inertia(0.02), CUBE)
    urdf = write_urdf(tmp_path, [base, part], [UrdfJoint("j", "prismatic", "base", "part", axis=(1.0, 0.0, 0.0))])
    with on_plane(engine, urdf) as world:
        world.place({}, height_m=5.0)
        world.push({"j": 2.0})
        start = world.root_pose()[0]
        world.step(120)
        # The reduced mass of 2 and 1 kg is 2/3 kg: q = 3 t² / 2, of which the base goes back by a third.
        assert world.positions()[0] == pytest.approx(0.5 * 3.0 * 0.5**2, rel=0.015)
        assert world.root_pose()[0][0] - start[0] == pytest.approx(-world.positions()[0] / 3.0, rel=0.01)


@every_engine
def test_an_object_without_collision_shapes_cannot_stand(tmp_path: Path, engine: Engine) -> None:
    refusal = pytest.raises(AssetError, match="no link has a collision shape")
    with refusal as caught, on_plane(engine, write_urdf(tmp_path, [UrdfLink("ghost")])):
        pass
    assert caught.value.mode is FailureMode.ENGINE_REFUSED


@every_engine
def test_what_has_flown_away_still_has_a_height(tmp_path: Path, engine: Engine) -> None:
    # PyBullet sees no further than 40 m: what burst apart was said to have no collision shape.
    with on_plane(engine, block_urdf(tmp_path)) as world:
        world.place({}, height_m=100.0)
        assert world.lowest_m() >= 99.0


@every_engine
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, -0.3, 0.2)])
def test_what_collides_is_the_shape_where_its_origin_puts_it(tmp_path: Path, engine: Engine, turn: Vector3) -> None:
    (tmp_path / "bar.obj").write_text(box_obj((0.0, 0.0, 0.0), (0.1, 0.02, 0.3)), encoding="utf-8")
    text = (
        '<robot name="bar"><link name="bar"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" '
        f'ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="1 2 3" rpy="{turn[0]} {turn[1]} {turn[2]}"/>'
        '<geometry><mesh filename="bar.obj" scale="2 1 1"/></geometry></collision></link></robot>'
    )
    (tmp_path / "bar.urdf").write_text(text, encoding="utf-8")
    corners = np.array([(x, y, z) for x in (0.0, 0.2) for y in (0.0, 0.02) for z in (0.0, 0.3)])
    low = (Rotation.from_euler("xyz", turn).apply(corners)[:, 2] + 3.0).min()
    margin = 1e-3 if engine is Engine.PYBULLET else 0.0
    with on_plane(engine, tmp_path / "bar.urdf") as world:
        world.place({}, height_m=0.1)
        assert world.root_pose()[0][2] == pytest.approx(0.1 - low + margin, abs=2e-4)


SETTINGS = EngineSettings()


def test_phi_of_two_overlapping_boxes_is_their_depth_at_every_contact_point(tmp_path: Path) -> None:
    points = contacts_at(siblings(tmp_path, 0.01), {}, SETTINGS)
    assert points and {frozenset((point.link_a, point.link_b)) for point in points} == {frozenset(("left", "right"))}
    np.testing.assert_allclose([point.separation_m for point in points], -0.01, atol=1e-6)
    assert penetration(points) == pytest.approx(0.01 * len(points))


def test_phi_follows_the_joint_and_is_zero_once_apart(tmp_path: Path) -> None:
    with static_object(siblings(tmp_path, 0.01), SETTINGS) as item:
        phis = [penetration(contact_points(item, {"slide": q})) for q in (-0.01, 0.0, 0.005, 0.02)]
    assert phis[0] > phis[1] > phis[2] > 0.0 and phis[3] == 0.0


def glued(folder: Path, kind: str, count: int = 2) -> Path:
    """A root with ``count`` boxes of 0.1 m in a row, each 10 mm into the next, on joints of one kind along x."""
    folder.mkdir()
    names = [f"box{n}" for n in range(count)]
    links = [UrdfLink("root"), *(UrdfLink(name, shapes=CUBE) for name in names)]
    places = [(0.09 * n, 0.0, 0.2) for n in range(count)]
    joints = [
        UrdfJoint(f"on_{name}", kind, "root", name, axis=(1.0, 0.0, 0.0), xyz=place)
        for n, (name, place) in enumerate(zip(names, places, strict=True))
    ]
    file = write_urdf(folder, links, joints)
    file.write_text(file.read_text().replace("><", ">\n<"))  # PyBullet breaks long lines
    return file


def phi_in(engine: Engine, urdf: Path) -> float:
    """Φ in one engine with all joints at zero, m."""
    return penetration(rest.contacts_at(engine, urdf, {}, SETTINGS))


@pytest.mark.parametrize("engine", ["pybullet", "mujoco", "sapien"])
@pytest.mark.parametrize("count", [2, 40])
def test_links_that_fixed_joints_hold_at_their_places_do_not_penetrate(engine: str, count: int, tmp_path: Path) -> None:
    """Of PhysX' 30 bits of filters, 40 links take two."""
    apart = phi_in(Engine(engine), glued(tmp_path / "slides", "prismatic"))
    assert apart > 0.009, "what a joint can move apart counts"
    assert phi_in(Engine(engine), glued(tmp_path / "glued", "fixed", count)) == 0.0
