"""Wheels that are drawn with a few facets roll as round ones: as far as statics says, in every engine."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np
import pybullet
import pytest
import sapien
import trimesh
from sapien import physx

from asset2sim.assets.authored import REFINED_NAME
from asset2sim.assets.folder import write_folder
from asset2sim.assets.hulls import Hulls
from asset2sim.assets.meshes.cylinder import SIDES, Cylinder, cylinder_of
from asset2sim.engines.pybullet_object import FLAGS, empty_client
from asset2sim.engines.registry import open_world
from asset2sim.engines.sapien_world import SapienWorld
from asset2sim.load import load
from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision.shapes import collision_shapes
from asset2sim.refinement.collision.trim import trim
from asset2sim.validation.validate import validate
from schemas.overlay import JointProposal, LinkProposal, Overlay
from schemas.settings import CollisionSettings, PhysicsSettings
from schemas.vocabulary import CollisionMode, Engine, Source
from tests.assets import joint, link, mesh, read, robot, shape, written

R, WIDE, CORNERS = 0.05, 0.02, 12
WHEELS = {f"wheel{i}": (x, y) for i, (x, y) in enumerate([(0.2, 0.2), (0.2, -0.2), (-0.2, 0.2), (-0.2, -0.2)])}
SETTINGS = CollisionSettings(mode=CollisionMode.REPAIR)
RUB_NM, BOARD_KG, WHEEL_KG = 0.05, 9.2, 0.2


def prism(corners: int, radius: float = R, low: float = -WIDE / 2, high: float = WIDE / 2) -> Array:
    """Corners of a prism about y."""
    turns = np.arange(corners) * 2.0 * np.pi / corners
    return np.vstack(
        [np.column_stack([np.cos(turns), 0 * turns, np.sin(turns)]) * radius + (0, y, 0) for y in (low, high)]
    )


def obj(points: Array) -> str:
    """OBJ text of the hull of these points."""
    return str(trimesh.convex.convex_hull(points).export(file_type="obj"))


def cart(folder: Path, points: Array, xyz: str = "0 0 0.06", axis: str = "0 1 0", kind: str = "continuous") -> Path:
    """A board on four wheels of these points."""
    limit = None if kind == "continuous" else "0 1"
    urdf = robot(
        link("board", shape("0.5 0.3 0.04", xyz=xyz)),
        *(link(name, mesh("wheel.obj")) for name in WHEELS),
        *(
            joint(f"axle_{name}", kind, "board", name, xyz=f"{x} {y} 0", axis=axis, limit=limit)
            for name, (x, y) in WHEELS.items()
        ),
    )
    return written(folder, urdf, {"wheel.obj": obj(points)})


def hulls_of(source: Path) -> tuple[Hulls, list[str]]:
    hulls, notes = collision_shapes(read(source), 1.0, SETTINGS)
    return hulls, [note.link or "" for note in notes if note.code == "wheel_rounded"]


def test_a_facetted_wheel_on_the_ground_is_the_cylinder_that_it_is_drawn_for(tmp_path: Path) -> None:
    hulls, told = hulls_of(cart(tmp_path, prism(CORNERS)))
    assert set(told) == set(WHEELS)
    for name in WHEELS:
        (points,) = hulls[name]
        found = cylinder_of(points)
        assert found is not None and (found.radius, found.length) == pytest.approx((R, WIDE))
        assert abs(found.axis) == pytest.approx((0, 1, 0)) and found.middle == pytest.approx((0, 0, 0), abs=1e-9)


def test_a_hub_beside_the_tread_stays_and_does_not_reach_the_ground(tmp_path: Path) -> None:
    wide = np.vstack([prism(CORNERS), prism(CORNERS, 0.96 * R, -3 * WIDE, 3 * WIDE)])
    hulls, _ = hulls_of(cart(tmp_path, wide))
    tread, hub = hulls["wheel0"]
    assert cylinder_of(tread) is not None and cylinder_of(hub) is None
    assert np.ptp(hub[:, 1]) == pytest.approx(6 * WIDE) and np.hypot(*hub[:, ::2].T).max() <= 0.901 * R


@pytest.mark.parametrize(
    ("points", "other"),
    [
        (prism(CORNERS), {"axis": "0 0 1"}),  # a turntable
        (prism(CORNERS), {"kind": "revolute"}),  # a knob with ends
        (prism(CORNERS), {"xyz": "0 0 -0.2"}),  # wheels that do not stand on the ground
        (prism(6), {}),  # a nut
        (prism(CORNERS) * (1.0, 1.0, 0.9), {}),  # an oval
        (prism(90), {}),  # as fine as a round one
    ],
)
def test_what_is_no_wheel_or_round_already_stays_as_drawn(tmp_path: Path, points: Array, other: dict[str, str]) -> None:
    hulls, told = hulls_of(cart(tmp_path, points, **other))
    assert not told and all(cylinder_of(piece) is None for own in hulls.values() for piece in own)


def test_a_cylinder_is_known_by_its_corners_until_it_is_cut() -> None:
    made = Cylinder(np.array([0.1, 0.2, 0.3]), np.array([0.6, 0.0, 0.8]), 0.04, 0.01)
    found = cylinder_of(made.corners)
    assert found is not None and (found.radius, found.length) == pytest.approx((0.04, 0.01))
    assert found.middle == pytest.approx(made.middle) and found.axis == pytest.approx(made.axis)
    cut = trim(made.corners, np.array([1.0, 0.0, 0.0]), 0.08)
    assert cut is not None and cylinder_of(cut) is None
    assert cylinder_of(made.corners + np.eye(3)[[i % 3 for i in range(2 * SIDES)]] * 1e-3) is None


@pytest.mark.parametrize(
    ("tilt_rad", "gone_m", "left_m"),
    [
        (0.0, 0.002, 0.008),
        (0.02, 0.002, 0.008 - 0.04 * np.tan(0.02)),  # the rim's lowest corner lies R tan over the plane
        (np.pi, 0.002, 0.008),  # from the other end
        (0.02, 0.006, None),  # more than half of it
        (0.3, 0.002, None),  # across
    ],
)
def test_a_wheel_whose_end_is_cut_off_stays_a_cylinder(tilt_rad: float, gone_m: float, left_m: float | None) -> None:
    made = Cylinder(np.array([0.1, 0.2, 0.3]), np.array([0.0, 1.0, 0.0]), 0.04, 0.01)
    normal = np.array([0.0, np.cos(tilt_rad), np.sin(tilt_rad)])
    on_plane = made.middle + np.array([0.0, np.sign(np.cos(tilt_rad)) * (gone_m - 0.005), 0.0])
    cut = trim(made.corners, normal, float(normal @ on_plane))
    assert cut is not None and (cut @ normal).min() >= normal @ on_plane - 1e-9
    found = cylinder_of(cut)
    assert (found and found.length) == (left_m and pytest.approx(left_m, rel=1e-3))
    assert found is None or found.radius == pytest.approx(0.04)


def refined(folder: Path) -> Path:
    """The URDF of the cart as it is written, its axles rubbing by ``RUB_NM`` each."""
    item = read(cart(folder / "in", prism(CORNERS)))
    joints = tuple(JointProposal(name=f"axle_{name}", friction=RUB_NM, damping=0.0) for name in WHEELS)
    links = (LinkProposal(name="board", mass_kg=BOARD_KG), *(LinkProposal(name=n, mass_kg=WHEEL_KG) for n in WHEELS))
    settings = PhysicsSettings()
    overlay, _ = validate(item, Overlay(scale=1.0, links=links, joints=joints), Source.MODEL, 0.8, settings)
    hulls, _ = collision_shapes(item, 1.0, SETTINGS)
    urdf = write_folder(item, overlay, hulls, folder / "out", settings).urdf
    (urdf.parent / REFINED_NAME).write_text(overlay.model_dump_json())
    return urdf


def by_statics() -> float:
    """How far the cart coasts from 1 m/s against its axles' friction, m: its wheels turn as discs."""
    rolling = BOARD_KG + len(WHEELS) * 1.5 * WHEEL_KG
    return 0.5 * rolling / (len(WHEELS) * RUB_NM / R)


def coasts_in_mujoco(urdf: Path) -> float:
    spec = mujoco.MjSpec.from_file(str(urdf))
    world = mujoco.MjSpec()
    world.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[9, 9, 1])
    world.attach(spec, frame=world.worldbody.add_frame(pos=[0, 0, R]), prefix="c")
    world.worldbody.first_body().add_freejoint()
    for axle in world.joints[1:]:
        axle.frictionloss = RUB_NM
    model = world.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 250)
    data.qvel[0], data.qvel[6:], start = 1.0, 1.0 / R, data.qpos[0]
    while data.qvel[0] > 0.005 and data.time < 30.0:
        mujoco.mj_step(model, data)
    return float(data.qpos[0] - start)


def coasts_in_pybullet(urdf: Path) -> float:
    with empty_client() as client:
        client.setTimeStep(1.0 / 480.0)
        client.setGravity(0.0, 0.0, -9.81)
        client.createMultiBody(0.0, client.createCollisionShape(pybullet.GEOM_PLANE))
        body = client.loadURDF(str(urdf), [0.0, 0.0, R], flags=FLAGS)
        axles = range(client.getNumJoints(body))
        for index in (-1, *axles):
            client.changeDynamics(body, index, lateralFriction=1.0, linearDamping=0.0, angularDamping=0.0)
        for index in axles:
            client.setJointMotorControl2(body, index, pybullet.VELOCITY_CONTROL, force=RUB_NM)
        for _ in range(240):
            client.stepSimulation()
        client.resetBaseVelocity(body, [1.0, 0.0, 0.0], [0.0, 0.0, 0.0])
        for index in axles:
            client.resetJointState(body, index, 0.0, 1.0 / R)
        start, speed = client.getBasePositionAndOrientation(body)[0][0], 1.0
        for _ in range(30 * 480):
            if speed <= 0.005:
                break
            client.stepSimulation()
            speed = client.getBaseVelocity(body)[0][0]
        return float(client.getBasePositionAndOrientation(body)[0][0] - start)


def coasts_in_sapien(articulation: Any, step: Callable[[], None]) -> float:
    """PhysX makes a prism of a cylinder."""
    for _ in range(120):
        step()
    articulation.set_root_linear_velocity(np.array([1.0, 0.0, 0.0], np.float32))
    articulation.set_qvel(np.full(len(WHEELS), 1.0 / R, np.float32))
    start = articulation.root_pose.p[0]
    for _ in range(10 * 240):
        if articulation.root_linear_velocity[0] <= 0.005:
            break
        step()
    return float(articulation.root_pose.p[0] - start)


def coasts_in_the_checks(urdf: Path) -> float:
    with open_world(Engine.SAPIEN, urdf, plane=True, timestep_s=1.0 / 240.0, contact_friction=0.5) as world:
        return coasts_in_sapien(cast(SapienWorld, world).item.articulation, world.step)


def coasts_where_loaded(urdf: Path) -> float:
    item = load(urdf.parent, "sapien")
    return coasts_in_sapien(item.articulation, item.step)


def coasts_in_ones_own_scene(urdf: Path) -> float:
    scene = sapien.Scene([physx.PhysxCpuSystem()])
    scene.set_timestep(1.0 / 240.0)
    scene.add_ground(0.0, render=False)
    return coasts_in_sapien(load(urdf.parent, "sapien", into=scene).articulation, scene.step)


@pytest.mark.system
@pytest.mark.parametrize(
    "coasts",
    [coasts_in_mujoco, coasts_in_pybullet, coasts_in_the_checks, coasts_where_loaded, coasts_in_ones_own_scene],
)
def test_a_cart_on_facetted_wheels_coasts_as_far_as_its_axles_let_it(
    tmp_path: Path, coasts: Callable[[Path], float]
) -> None:
    urdf = refined(tmp_path)
    assert coasts(urdf) == pytest.approx(by_statics(), rel=0.03), "over 12 corners it stopped after a tenth"
