"""What is PyBullet's own: explicit damping, slopes, free flight without energy from nowhere, refusals, clients apart.

What holds in every engine is in ``test_engines_joints`` and ``test_engines_contacts``.
"""

import math
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pybullet
import pytest
import trimesh
from pybullet_utils.bullet_client import BulletClient

from asset2sim.assets.urdf.read import MOST_LINKS
from asset2sim.engines.pybullet_object import IDLE, PyBulletItem, loaded
from asset2sim.engines.pybullet_world import PyBulletWorld, open_pybullet
from asset2sim.physics.arrays import Array
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, ball_inertia, block_urdf, joint_track, mesh, swing, write_urdf
from tests.engine_worlds import period

pytestmark = pytest.mark.system

STEP = 1.0 / 240.0
G = 9.81
WHEEL = UrdfLink("part", 1.0, ORIGIN, ball_inertia(0.01))
"""A part whose centre lies on its axis: gravity does nothing to it on a hinge."""


def track(urdf: Path, start: float, seconds: float, velocity: float = 0.0) -> Array:
    """The positions of the joint ``j`` of an object whose base is held, left alone from ``start``."""
    with loaded(urdf, fixed_base=True, timestep_s=STEP) as item:
        item.place({"j": start})
        item.client.resetJointState(item.body, item.joint_index["j"], start, velocity)
        return joint_track(item, seconds)


def test_a_damped_hinge_loses_speed_as_its_damping_says(tmp_path: Path) -> None:
    damping, inertia, speed = 0.1, 0.01, 1.0
    speeds = np.diff(track(swing(tmp_path, WHEEL, damping=damping), 0.0, 0.5, speed)) / STEP
    steps = np.arange(1, len(speeds) + 1)
    # Explicit damping: each step keeps 1 - c Δt / I. The continuous e^(-t/τ) is within 2.5 % of it over one τ.
    np.testing.assert_allclose(speeds, speed * (1.0 - damping * STEP / inertia) ** steps, rtol=1e-6)
    one_tau = speeds[steps * STEP <= inertia / damping + 1e-9]
    np.testing.assert_allclose(one_tau, np.exp(-steps[: len(one_tau)] * STEP * damping / inertia), rtol=0.025)


def slope(urdf: Path, angle: float, friction: float, step: float) -> tuple[float, float]:
    """Distance (m) and speed (m/s) down a slope, 1 s after a resting block's plane is tilted by turning gravity."""
    with open_pybullet(urdf, plane=True, timestep_s=step, contact_friction=friction) as world:
        item = world.item
        world.place({}, height_m=0.001)
        world.step(round(0.3 / step))
        start = item.client.getBasePositionAndOrientation(item.body)[0][0]
        item.client.setGravity(G * math.sin(angle), 0.0, -G * math.cos(angle))
        world.step(round(1.0 / step))
        end = item.client.getBasePositionAndOrientation(item.body)[0][0]
        return end - start, item.client.getBaseVelocity(item.body)[0][0]


@pytest.mark.parametrize("friction", [0.3, 0.6])
def test_a_block_stays_on_a_slope_that_friction_must_hold(tmp_path: Path, friction: float) -> None:
    urdf = block_urdf(tmp_path, (0.3, 0.3, 0.1))
    moved, speed = slope(urdf, math.atan(0.95 * friction), friction, 1e-3)
    assert abs(moved) < 1e-3 and abs(speed) < 1e-3


@pytest.mark.parametrize(("friction", "tangent"), [(0.3, 0.36), (0.6, 0.8), (0.0, 0.2)])
def test_a_block_slides_down_a_steeper_one_as_coulomb_says(tmp_path: Path, friction: float, tangent: float) -> None:
    angle = math.atan(tangent)
    moved, speed = slope(block_urdf(tmp_path, (0.3, 0.3, 0.1)), angle, friction, 1e-3)
    acceleration = G * (math.sin(angle) - friction * math.cos(angle))
    assert speed == pytest.approx(acceleration, rel=0.05)
    assert moved == pytest.approx(acceleration / 2.0, rel=0.05)


FLYER = (
    UrdfLink("base", 2.0, ORIGIN, (0.02, 0.0, 0.0, 0.03, 0.0, 0.04)),
    UrdfLink("part", 1.0, (0.2, 0.0, 0.0), (0.005, 0.0, 0.0, 0.01, 0.0, 0.012)),
)


def momentum(item: PyBulletItem, links: tuple[UrdfLink, UrdfLink]) -> tuple[Array, float, float]:
    """(3,) linear momentum, spin about z around the centre of mass of a flat motion, and kinetic energy, SI units."""
    client, body = item.client, item.body
    base, turning = (np.array(v) for v in client.getBaseVelocity(body))
    state = client.getLinkState(body, 0, computeLinkVelocity=1)
    places = np.array([client.getBasePositionAndOrientation(body)[0], state[0]])
    speeds, spins = np.array([base, state[6]]), np.array([turning[2], state[7][2]])
    masses, moments = np.array([link.mass for link in links]), np.array([link.inertia[5] for link in links])
    linear: Array = masses @ speeds
    around = places - masses @ places / masses.sum()
    angular = float(moments @ spins + masses @ np.cross(around, speeds)[:, 2])
    return linear, angular, float(masses @ (speeds**2).sum(axis=1) + moments @ spins**2) / 2.0


@pytest.mark.parametrize("friction", [0.0, 0.02])
def test_in_free_flight_friction_alone_takes_energy_and_nothing_takes_momentum(tmp_path: Path, friction: float) -> None:
    joint = UrdfJoint("j", "continuous", "base", "part", xyz=(0.1, 0.0, 0.0), friction=friction)
    with loaded(write_urdf(tmp_path, FLYER, [joint]), fixed_base=False, timestep_s=1e-3) as item:
        item.client.setGravity(0.0, 0.0, 0.0)
        item.client.resetBaseVelocity(item.body, [1.0, 0.5, 0.0], [0.0, 0.0, 1.0])
        item.client.resetJointState(item.body, 0, 0.0, 4.0)
        stepping, travelled = PyBulletWorld(item, 1e-3, plane=False), 0.0
        stepping.step()
        before = momentum(item, FLYER)
        for _ in range(1000):
            stepping.step()
            travelled += abs(float(item.velocities()[0])) * 1e-3
        after = momentum(item, FLYER)
    np.testing.assert_allclose(after[0], before[0], rtol=0.003)
    assert after[1] == pytest.approx(before[1], rel=0.01)
    # PyBullet's own damping of 0.04 would have taken 8 % of the energy in this second.
    assert before[2] - after[2] == pytest.approx(friction * travelled, rel=0.05, abs=0.005 * before[2])


def test_a_thrown_block_neither_slows_nor_stops_turning(tmp_path: Path) -> None:
    with loaded(block_urdf(tmp_path), fixed_base=False, timestep_s=STEP) as item:
        item.client.setGravity(0.0, 0.0, 0.0)
        item.client.resetBaseVelocity(item.body, [1.0, 0.0, 0.0], [0.0, 3.0, 0.0])
        PyBulletWorld(item, STEP, plane=False).step(480)
        linear, angular = item.client.getBaseVelocity(item.body)
    np.testing.assert_allclose([linear[0], angular[1]], [1.0, 3.0], rtol=1e-6)


def test_a_spring_in_free_flight_pushes_both_sides_alike(tmp_path: Path) -> None:
    joint = UrdfJoint("j", "prismatic", "base", "part", (1.0, 0.0, 0.0), (0.1, 0.0, 0.0), stiffness=24.0)
    with loaded(write_urdf(tmp_path, FLYER, [joint]), fixed_base=False, timestep_s=STEP) as item:
        item.client.setGravity(0.0, 0.0, 0.0)
        item.place({"j": 0.1})
        stepping, positions = PyBulletWorld(item, STEP, plane=False), []
        for _ in range(480):
            stepping.step()
            positions.append(float(item.positions()[0]))
            assert np.linalg.norm(momentum(item, FLYER)[0]) < 1e-6
    # The reduced mass of 2 and 1 kg is 2/3 kg: ω = 6 rad/s.
    assert period(np.array(positions)) == pytest.approx(2 * math.pi / 6.0, rel=0.005)


def test_a_file_that_pybullet_refuses_is_an_asset_error_with_what_it_printed(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path, [UrdfLink("part", shapes=((mesh("gone.obj"), ORIGIN),))])
    refusal = pytest.raises(AssetError, match=r"refuses object\.urdf and says: .*Link.*part")
    with refusal as caught, loaded(urdf, fixed_base=True, timestep_s=STEP):
        pass
    assert caught.value.mode is FailureMode.ENGINE_REFUSED


def test_clients_are_apart_and_empty_after_their_block(tmp_path: Path) -> None:
    urdf = swing(tmp_path, WHEEL)
    with loaded(urdf, fixed_base=True, timestep_s=STEP) as first:
        with loaded(urdf, fixed_base=True, timestep_s=STEP) as second:
            first.place({"j": 0.5})
            assert second.positions()[0] == 0.0
        assert first.positions()[0] == 0.5
    assert first.client.getNumBodies() == second.client.getNumBodies() == 0


def test_clients_that_are_kept_serve_what_forks() -> None:
    """The fork server connects as many as a check opens at once: each takes 15 ms anew."""
    look = "from asset2sim.engines.pybullet_object import IDLE; print(len(IDLE))"
    words = [sys.executable, "-c", f"import asset2sim.experiments.isolation.preload; {look}"]
    assert subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()[-1] == "3"


def test_a_used_client_gives_exactly_what_a_new_one_gives(tmp_path: Path) -> None:
    IDLE.clear()
    (tmp_path / "other").mkdir()
    urdf, other, ends = block_urdf(tmp_path), swing(tmp_path / "other", WHEEL), []
    for _ in range(2):
        with open_pybullet(urdf, plane=True, timestep_s=STEP, contact_friction=0.5) as world:
            world.place({}, height_m=0.1, tilt_rad=(0.3, 0.2, 0.1))
            world.step(240)
            ends.append(np.concatenate(world.root_pose()).tolist())
        with loaded(other, fixed_base=True, timestep_s=1.0 / 60.0, gravity_m_s2=1.0) as item:
            joint_track(item, 0.5)
    assert ends[0] == ends[1] and len(IDLE) == 1


def test_a_mesh_that_has_changed_is_read_again(tmp_path: Path) -> None:
    urdf, widths = write_urdf(tmp_path, [UrdfLink("part", shapes=((mesh("part.obj"), ORIGIN),))]), []
    for edge in (0.1, 0.2):
        trimesh.creation.box((edge, edge, edge)).export(tmp_path / "part.obj")
        with loaded(urdf, fixed_base=True, timestep_s=STEP) as item:
            low, high = item.client.getAABB(item.body)
            widths.append(high[0] - low[0])
    assert widths == pytest.approx([0.1, 0.2], abs=0.01)


def test_a_tiny_knob_turns_although_its_friction_would_stop_a_hundred_radians_a_second(tmp_path: Path) -> None:
    # 1e-9 kg·m² at 240 Hz: friction of 1e-3 N·m takes 4000 rad/s in a step, forty times PyBullet's own largest speed.
    knob = UrdfLink("knob", mass=1e-4, inertia=ball_inertia(1e-9))
    urdf = swing(tmp_path, knob, type="continuous", friction=1e-3)
    with loaded(urdf, fixed_base=True, timestep_s=1.0 / 240.0, gravity_m_s2=0.0) as item:
        for torque, moves in ((0.9e-3, False), (2e-3, True)):
            item.place({})
            for _ in range(24):
                item.client.setJointMotorControl2(
                    item.body, item.joint_index["j"], pybullet.TORQUE_CONTROL, force=torque
                )
                item.client.stepSimulation()
            assert bool(abs(item.positions()[0]) > 1e-3) is moves


@pytest.mark.parametrize(("links", "told"), [(MOST_LINKS, True), (MOST_LINKS + 1, False)])
def test_an_object_of_more_links_than_are_let_in_would_have_no_state(tmp_path: Path, links: int, told: bool) -> None:
    spokes = [f"<link name='l{place}'/>" for place in range(links)]
    spokes += [
        f"<joint name='j{place}' type='fixed'>\n<parent link='l0'/>\n<child link='l{place}'/></joint>"
        for place in range(1, links)
    ]
    urdf = tmp_path / "wheel.urdf"
    urdf.write_text(f"<robot name='wheel'>{chr(10).join(spokes)}</robot>")
    client = BulletClient(pybullet.DIRECT)
    try:
        with pytest.raises(pybullet.error) if not told else nullcontext():
            client.getBasePositionAndOrientation(client.loadURDF(str(urdf)))
    finally:
        client.disconnect()


def test_a_client_looks_a_function_up_once_and_joints_are_placed_in_one_call(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    base = UrdfLink("base", 1.0, ORIGIN, ball_inertia(0.01))
    urdf = write_urdf(tmp_path, [base, WHEEL], [UrdfJoint("j", "continuous", "base", "part")])
    with loaded(urdf, fixed_base=True, timestep_s=STEP) as item:
        assert item.client.stepSimulation is item.client.stepSimulation
        monkeypatch.setattr(item.client, "resetJointState", None)  # each of its calls moves every link
        item.place({"j": 0.3})
        assert item.positions() == pytest.approx([0.3])
