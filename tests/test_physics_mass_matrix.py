"""Effective inertia and gravity loads against closed forms, and the whole matrix against PyBullet's."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.engines.pybullet_object import loaded
from asset2sim.engines.pybullet_world import PyBulletWorld
from asset2sim.physics.inertia import box_inertia
from asset2sim.physics.kinematics import TreeJoint
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body, JointSpace, joint_space
from schemas.base import Vector3
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, tree_joint, write_urdf

SPHERE = 0.02 * np.eye(3)
HEAVY = Body(1e9, np.zeros(3), 1e9 * np.eye(3))


def pair(joint: TreeJoint, base: Body, part: Body, position: float = 0.0) -> JointSpace:
    return joint_space([joint], "base", {"base": base, "part": part}, {joint.name: position})


def pendulum(position: float, angle: Vector3 = ORIGIN) -> JointSpace:
    """2 kg, 0.5 m below a hinge along y."""
    hinge = tree_joint("j", "revolute", "base", "part", (0, 1, 0), (0.3, 0.1, 2.0), angle)
    return pair(hinge, HEAVY, Body(2.0, np.array([0.0, 0.0, -0.5]), SPHERE), position)


@pytest.mark.parametrize("position", [0.0, 0.7, -2.0])
def test_a_pendulum_has_m_l_squared_plus_its_own_inertia(position: float) -> None:
    space = pendulum(position)
    assert space.matrix[6, 6] == pytest.approx(2.0 * 0.5**2 + 0.02)
    # The base of a million tonnes takes 1e-9 of the motion.
    assert space.effective_inertia() == pytest.approx({"j": 0.52}, rel=1e-6)


@pytest.mark.parametrize("position", [0.0, 0.7, -2.0, math.pi / 2])
def test_gravity_pulls_a_pendulum_back_by_m_g_l_sine(position: float) -> None:
    assert pendulum(position).gravity[0] == pytest.approx(-2.0 * 9.81 * 0.5 * math.sin(position), abs=1e-12)


def test_a_hinge_turned_upright_feels_no_gravity() -> None:
    assert pendulum(0.7, (math.pi / 2, 0.0, 0.0)).gravity[0] == pytest.approx(0.0, abs=1e-12)


def test_gravity_pulls_a_slider_by_its_weight_along_the_axis() -> None:
    weight = 3.0 * GRAVITY_M_S2
    slope = math.radians(30.0)
    part = Body(3.0, np.array([0.4, 0.3, 0.2]), SPHERE)
    inclined = (math.cos(slope), 0.0, math.sin(slope))
    for axis, expected in (((0, 0, 1), -weight), ((0, 0, -1), weight), ((1, 0, 0), 0.0), (inclined, -0.5 * weight)):
        space = pair(tree_joint("j", "prismatic", "base", "part", axis), HEAVY, part)
        assert space.gravity[0] == pytest.approx(expected, abs=1e-9)


def test_two_equal_bodies_free_on_a_hinge_have_half_the_inertia_of_one() -> None:
    body = Body(1.0, np.zeros(3), SPHERE)
    space = pair(tree_joint("j", "revolute", "base", "part", (1, 2, 3)), body, body, 0.4)
    assert space.effective_inertia()["j"] == pytest.approx(0.01)


def test_two_bodies_free_on_a_slider_have_their_reduced_mass() -> None:
    first, second = Body(2.0, np.zeros(3), SPHERE), Body(3.0, np.array([0.0, 0.0, 0.1]), SPHERE)
    space = pair(tree_joint("j", "prismatic", "base", "part", (0, 0, 1)), first, second, 0.4)
    assert space.effective_inertia()["j"] == pytest.approx(2.0 * 3.0 / 5.0)


def test_a_slider_beside_the_centre_also_turns_the_pair() -> None:
    part = Body(1.0, np.array([1.0, 0.0, 0.0]), SPHERE)
    space = pair(tree_joint("j", "prismatic", "base", "part", (0, 0, 1)), Body(1.0, np.zeros(3), SPHERE), part)
    # Two bodies of 1 kg, 1 m apart across the slide: μ = 1/2. The slider lets neither turn against the other, so the
    # pair turns as one about its centre, with 2 · 0.02 + μ · 1², and that turn gives way: μ - (μ d)² / I.
    whole, reduced = 0.04 + 0.5, 0.5
    assert space.effective_inertia()["j"] == pytest.approx(reduced - reduced**2 / whole)


def test_what_a_hinge_carries_counts_with_it() -> None:
    arm = [
        tree_joint("j", "revolute", "base", "upper", (0, 1, 0)),
        tree_joint("fixed", "fixed", "upper", "lower", xyz=(0, 0, -1)),
    ]
    upper, lower = Body(1.0, np.array([0.0, 0.0, -0.5]), SPHERE), Body(2.0, np.zeros(3), SPHERE)
    bodies = {"base": HEAVY, "upper": upper, "lower": lower}
    space = joint_space(arm, "base", bodies, {"j": 0.3})
    assert space.names == ("j",)
    assert space.matrix[6, 6] == pytest.approx(1.0 * 0.25 + 2.0 * 1.0 + 2 * 0.02)
    assert space.gravity[0] == pytest.approx(-9.81 * (1.0 * 0.5 + 2.0 * 1.0) * math.sin(0.3))


def test_a_part_that_may_slide_freely_does_not_weigh_on_the_joint_beside_it() -> None:
    sides = [tree_joint("left", "prismatic", "base", "a"), tree_joint("right", "prismatic", "base", "b")]
    bodies = {name: Body(mass, np.zeros(3), SPHERE) for name, mass in (("base", 1.0), ("a", 1.0), ("b", 1.0))}
    # b stays behind while the base gives way, so a meets the base alone: 1 · 1 / 2.
    assert joint_space(sides, "base", bodies, {}).effective_inertia()["left"] == pytest.approx(0.5)


def test_a_push_on_the_free_base_meets_the_total_mass() -> None:
    space = pair(
        tree_joint("j", "prismatic", "base", "part"), Body(2.0, np.zeros(3), SPHERE), Body(3.0, np.ones(3), SPHERE)
    )
    np.testing.assert_allclose(space.matrix[:3, :3], 5.0 * np.eye(3))


def test_the_fastest_decay_of_one_joint_is_damping_over_inertia() -> None:
    assert pendulum(0.3).fastest_decay({"j": 0.26}) == pytest.approx(0.5, rel=1e-6)
    assert pendulum(0.3).fastest_decay({}) == 0.0
    assert joint_space([], "base", {"base": HEAVY}, {}).fastest_decay({}) == 0.0


def test_two_damped_joints_on_one_free_base_decay_faster_together() -> None:
    body = Body(1.0, np.zeros(3), SPHERE)
    sides = [tree_joint("left", "prismatic", "base", "a"), tree_joint("right", "prismatic", "base", "b")]
    space = joint_space(sides, "base", {"base": body, "a": body, "b": body}, {})
    # (M⁻¹)ⱼⱼ = 2 and, through the base, ±1 across: eigenvalues 1 and 3 with unit damping; one joint alone gives 2.
    assert space.fastest_decay({"left": 1.0, "right": 1.0}) == pytest.approx(3.0)
    assert space.fastest_decay({"left": 1.0}) == pytest.approx(2.0)


@st.composite
def trees(draw: st.DrawFn) -> tuple[list[TreeJoint], dict[str, Body], dict[str, float]]:
    """A tree of up to seven links of any shape and pose."""
    numbers = st.floats(-2.0, 2.0)
    vectors = st.tuples(numbers, numbers, numbers)
    count = draw(st.integers(1, 6))
    joints = []
    for index in range(count):
        axis = draw(vectors.filter(lambda v: float(np.linalg.norm(v)) > 0.1))
        kind = draw(st.sampled_from(["revolute", "continuous", "prismatic", "fixed"]))
        parent = f"l{draw(st.integers(0, index))}"
        joints.append(tree_joint(f"j{index}", kind, parent, f"l{index + 1}", axis, draw(vectors), draw(vectors)))
    sizes = st.floats(0.05, 1.0)
    bodies = {}
    for index in range(count + 1):
        mass = draw(st.floats(0.01, 10.0))
        size = np.array(draw(st.tuples(sizes, sizes, sizes)))
        bodies[f"l{index}"] = Body(mass, np.array(draw(vectors)), box_inertia(mass, size))
    return joints, bodies, {joint.name: draw(numbers) for joint in joints}


@given(tree=trees())
@settings(deadline=None, derandomize=True, max_examples=60)
def test_the_matrix_of_any_tree_is_symmetric_and_positive_definite(
    tree: tuple[list[TreeJoint], dict[str, Body], dict[str, float]],
) -> None:
    joints, bodies, positions = tree
    space = joint_space(joints, "l0", bodies, positions)
    np.testing.assert_allclose(space.matrix, space.matrix.T, rtol=0.0, atol=1e-9 * np.abs(space.matrix).max())
    assert np.linalg.eigvalsh(space.matrix)[0] > 0.0
    for index, (name, inertia) in enumerate(space.effective_inertia().items()):
        assert space.names[index] == name
        # A base that can give way only ever makes a joint lighter than one held by the world.
        assert 0.0 < inertia <= space.matrix[6 + index, 6 + index] * (1.0 + 1e-9)


CHAIN_LINKS = (
    UrdfLink("base", 2.0, (0.01, 0.02, 0.03), (0.02, 0.001, 0.002, 0.03, 0.003, 0.04)),
    UrdfLink("arm", 1.0, (0.2, 0.0, 0.1), (0.005, 0.0, 0.0, 0.01, 0.0, 0.012)),
    UrdfLink("tray", 0.5, (0.0, 0.1, 0.0), (0.004, 0.0, 0.0, 0.003, 0.0, 0.005)),
    UrdfLink("wheel", 0.3, (0.0, 0.05, 0.02), (0.001, 0.0, 0.0, 0.002, 0.0, 0.0015)),
)
CHAIN_JOINTS = (
    UrdfJoint("swing", "revolute", "base", "arm", (0.0, 0.6, 0.8), (0.1, 0.0, 0.2)),
    UrdfJoint("slide", "prismatic", "arm", "tray", (0.8, 0.0, 0.6), (0.3, 0.1, 0.0)),
    UrdfJoint("spin", "continuous", "base", "wheel", (1.0, 0.0, 0.0), (0.0, -0.2, 0.1)),
)
POSE = {"swing": 0.7, "slide": -0.2, "spin": 1.9}


def chain_space() -> JointSpace:
    tree = [tree_joint(j.name, j.type, j.parent, j.child, j.axis, j.xyz) for j in CHAIN_JOINTS]
    bodies = {}
    for link in CHAIN_LINKS:
        xx, xy, xz, yy, yz, zz = link.inertia
        bodies[link.name] = Body(link.mass, np.array(link.com), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    return joint_space(tree, "base", bodies, POSE)


@pytest.mark.system
def test_the_joint_block_is_pybullets_own_mass_matrix(tmp_path: Path) -> None:
    space = chain_space()
    with loaded(write_urdf(tmp_path, CHAIN_LINKS, CHAIN_JOINTS), fixed_base=True, timestep_s=1 / 240) as item:
        order = [space.names.index(name) for name in item.joint_index]
        theirs = item.client.calculateMassMatrix(item.body, [POSE[name] for name in item.joint_index])
        item.place(POSE)
        still = [0.0] * 3
        loads = item.client.calculateInverseDynamics(item.body, [POSE[n] for n in item.joint_index], still, still)
    np.testing.assert_allclose(space.matrix[6:, 6:][np.ix_(order, order)], theirs, rtol=1e-6, atol=1e-9)
    # What holds the object still is the opposite of gravity's pull.
    np.testing.assert_allclose(space.gravity[order], -np.array(loads), rtol=1e-6, atol=1e-9)


@pytest.mark.system
@pytest.mark.parametrize("name", ["swing", "slide", "spin"])
def test_a_push_on_one_joint_of_a_free_object_meets_its_effective_inertia(tmp_path: Path, name: str) -> None:
    step, push = 1e-4, 0.1
    with loaded(write_urdf(tmp_path, CHAIN_LINKS, CHAIN_JOINTS), fixed_base=False, timestep_s=step) as item:
        item.client.setGravity(0.0, 0.0, 0.0)
        item.place(POSE)
        kind = item.client.TORQUE_CONTROL
        item.client.setJointMotorControl2(item.body, item.joint_index[name], kind, force=push)
        PyBulletWorld(item, step, plane=False).step()
        speed = item.client.getJointState(item.body, item.joint_index[name])[1]
    assert push * step / speed == pytest.approx(chain_space().effective_inertia()[name], rel=1e-5)
