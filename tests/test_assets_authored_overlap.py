"""Overlaps are told apart: those of the authored meshes, and those that only the hulls have."""

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.authored_overlap import AuthoredShapes, authored_depth, authored_shapes, overlap_cause
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import origin_transform
from schemas.vocabulary import OverlapCause
from tests.assets import box_obj, joint, link, mesh, read, robot, shape, written
from tests.builders import double_sided, loose_sides, without_top

X = np.array([1.0, 0.0, 0.0])


def at(x: float, y: float = 0.0, z: float = 0.0, yaw: float = 0.0) -> Array:
    return origin_transform((x, y, z), (0.0, 0.0, yaw))


def obj(item: trimesh.Trimesh) -> str:
    lines = [f"v {x} {y} {z}" for x, y, z in item.vertices]
    return "\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in item.faces]) + "\n"


def pair(folder: Path, first: str, second: str, scale: float = 1.0) -> AuthoredShapes:
    """Two links, ``a`` and ``b``, of one OBJ each."""
    links = link("base"), link("a", mesh("a.obj")), link("b", mesh("b.obj"))
    joints = (
        joint("one", "continuous", "base", "a", axis="0 0 1"),
        joint("two", "continuous", "base", "b", axis="0 0 1"),
    )
    return authored_shapes(read(written(folder, robot(*links, *joints), {"a.obj": first, "b.obj": second})), scale)


@pytest.fixture
def cubes(tmp_path: Path) -> AuthoredShapes:
    """Two closed cubes of 10 cm about their links' origins."""
    cube = box_obj((-0.05, -0.05, -0.05), (0.05, 0.05, 0.05))
    return pair(tmp_path, cube, cube)


@pytest.mark.parametrize(
    ("gap", "cause", "depth"),
    [
        (0.01, OverlapCause.HULL, 0.0),
        (-0.0015, OverlapCause.HULL, 0.002),
        (-0.003, OverlapCause.AUTHORED, 0.005),
        (-0.008, OverlapCause.AUTHORED, 0.01),
        (-0.03, OverlapCause.AUTHORED, math.inf),
    ],
)
@pytest.mark.parametrize("normal", [None, X])
def test_two_cubes_overlap_as_authored_where_they_do_by_more_than_a_touch(
    cubes: AuthoredShapes, gap: float, cause: OverlapCause, depth: float, normal: Array | None
) -> None:
    pose = at(0.1 + gap, 0.02, 0.03)
    assert overlap_cause(cubes, "a", "b", pose, normal) is cause
    assert authored_depth(cubes, "a", "b", pose, normal) == depth


def test_a_cube_turned_by_an_eighth_reaches_further(cubes: AuthoredShapes) -> None:
    # Its edge is 0.05 √2 = 70.7 mm from its centre, the other's face 50 mm.
    assert overlap_cause(cubes, "a", "b", at(0.115, yaw=math.pi / 4)) is OverlapCause.AUTHORED
    assert overlap_cause(cubes, "a", "b", at(0.125, yaw=math.pi / 4)) is OverlapCause.HULL
    assert overlap_cause(cubes, "a", "b", at(0.115)) is OverlapCause.HULL


def test_the_normal_finds_a_way_out_that_no_axis_is(cubes: AuthoredShapes) -> None:
    slant = np.array([1.0, 1.0, 0.0]) / math.sqrt(2.0)
    pose = at(0.1 - 0.0013, 0.1 - 0.0013)  # edges that overlap by 1.8 mm along the slant, by 1.3 mm along each axis
    assert authored_depth(cubes, "a", "b", pose, slant) == 0.002
    assert authored_depth(cubes, "a", "b", pose) == 0.002


@pytest.mark.parametrize("broken", [without_top, lambda box: double_sided(without_top(box)), loose_sides])
def test_what_lies_in_a_bin_touches_only_its_hull(tmp_path: Path, broken: object) -> None:
    assert callable(broken)
    bin_ = broken(trimesh.creation.box((0.2, 0.2, 0.2)))
    shapes = pair(tmp_path, obj(bin_), box_obj((-0.05, -0.05, -0.05), (0.05, 0.05, 0.05)))

    def inverse(pose: Array) -> Array:
        return np.asarray(np.linalg.inv(pose), dtype=float)

    assert overlap_cause(shapes, "b", "a", at(0.0)) is OverlapCause.HULL
    assert overlap_cause(shapes, "a", "b", inverse(at(0.0))) is OverlapCause.HULL
    assert overlap_cause(shapes, "b", "a", at(0.06)) is OverlapCause.AUTHORED  # through a side, by 10 mm
    assert overlap_cause(shapes, "a", "b", inverse(at(0.06))) is OverlapCause.AUTHORED


def test_depths_are_those_at_the_final_scale(tmp_path: Path) -> None:
    cube = box_obj((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    small = pair(tmp_path, cube, cube, scale=0.1)
    assert overlap_cause(small, "a", "b", at(0.097)) is OverlapCause.AUTHORED
    assert overlap_cause(small, "a", "b", at(0.0985)) is OverlapCause.HULL
    assert authored_depth(small, "a", "b", at(0.11)) == 0.0


def test_boxes_that_the_urdf_states_count_as_meshes_do(tmp_path: Path) -> None:
    urdf = robot(
        link("base", shape("0.1 0.1 0.1", xyz="0 0 0.2")),
        link("part", shape("0.1 0.1 0.1", "visual") + shape("0.04 0.04 0.04", "collision", xyz="0.1 0 0")),
        link("empty"),
        joint("turn", "continuous", "base", "part", axis="0 0 1"),
        joint("weld", "fixed", "base", "empty"),
    )
    shapes = authored_shapes(read(written(tmp_path, urdf)), 1.0)
    assert overlap_cause(shapes, "part", "base", at(0.0, 0.0, 0.2)) is OverlapCause.HULL  # its collision box is beside
    assert overlap_cause(shapes, "part", "base", at(-0.06, 0.0, 0.2)) is OverlapCause.AUTHORED
    assert overlap_cause(shapes, "empty", "base", at(0.0)) is OverlapCause.HULL


def test_hierarchies_are_built_once(cubes: AuthoredShapes) -> None:
    assert cubes.model("a") is cubes.model("a")
