"""What the tests know of a mechanism agrees with the mass matrix, and joints are batched only where that is exact."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from asset2sim.checks.joint_groups import apart_groups, depth_groups, run_in_groups
from asset2sim.checks.mechanism import mechanism, moved_inertia, poses_at, pull_on
from asset2sim.physics.mass_matrix import joint_space
from tests.builders import UrdfJoint, UrdfLink
from tests.interaction_objects import Subject, bare, solid, subject

ODD = (0.02, 0.001, 0.002, 0.03, 0.003, 0.025)


def arm(folder: Path) -> Subject:
    links = [bare("base"), UrdfLink("upper", 2.0, (0.3, 0.1, 0.05), ODD), UrdfLink("lower", 1.0, (0.2, 0.0, 0.1), ODD),
             UrdfLink("slide", 0.5, (0.0, 0.1, 0.0), ODD), bare("other", 3.0, (0.1, 0.0, 0.0))]  # fmt: skip
    joints = [
        UrdfJoint("shoulder", "revolute", "base", "upper", (0.0, 1.0, 0.2), (0.1, 0.0, 0.2)),
        UrdfJoint("elbow", "revolute", "upper", "lower", (0.3, 1.0, 0.0), (0.4, 0.0, 0.0)),
        UrdfJoint("rail", "prismatic", "lower", "slide", (1.0, 0.0, 1.0), (0.1, 0.0, 0.0), -0.2, 0.2),
        UrdfJoint("door", "revolute", "base", "other", (0.0, 0.0, 1.0)),
    ]
    return subject(folder, links, joints, start={"shoulder": 0.4, "elbow": -0.7, "rail": 0.1, "door": 1.0})


def test_pull_and_inertia_are_those_of_the_mass_matrix(tmp_path: Path) -> None:
    item = arm(tmp_path).item
    poses = poses_at(item, item.start)
    for name in item.start:
        pull = pull_on(item, name, item.start, poses)
        for position in (-1.0, 0.0, 0.8):
            space = joint_space(item.tree, item.root, item.bodies, item.start | {name: position})
            index = space.names.index(name)
            assert pull.at(np.array([position]))[0] == pytest.approx(space.gravity[index], abs=1e-9)
        space = joint_space(item.tree, item.root, item.bodies, item.start)
        index = 6 + space.names.index(name)
        assert moved_inertia(item, name, poses) == pytest.approx(space.matrix[index, index], rel=1e-9)


def test_a_joint_and_its_ancestor_are_never_in_one_batch(tmp_path: Path) -> None:
    item = arm(tmp_path).item
    assert depth_groups(item, item.start) == [("shoulder", "door"), ("elbow",), ("rail",)]
    assert depth_groups(item, ["elbow", "door"]) == [("door", "elbow")]
    matrix = joint_space(item.tree, item.root, item.bodies, item.start)
    first, second = (6 + matrix.names.index(name) for name in ("shoulder", "door"))
    assert matrix.matrix[first, second] == 0.0


def test_a_batch_that_does_badly_is_halved_until_the_culprit_is_alone(tmp_path: Path) -> None:
    links = [bare("base"), *(bare(f"k{i}") for i in range(16))]
    item = subject(tmp_path, links, [UrdfJoint(f"j{i}", "revolute", "base", f"k{i}") for i in range(16)]).item
    sizes: list[int] = []

    def run(names: Sequence[str]) -> dict[str, bool]:
        sizes.append(len(names))
        return dict.fromkeys(names, "j5" not in names)

    found = run_in_groups(item, item.start, run, bool)
    assert [name for name, good in found.items() if not good] == ["j5"]
    assert sizes[0] == 16 and sizes[-1] == 1 and len(sizes) == 9


def test_parts_whose_boxes_cannot_meet_are_swept_together(tmp_path: Path) -> None:
    links = [solid("base", (1.0, 1.0, 0.1)), *(solid(f"k{i}", (0.02, 0.02, 0.02)) for i in range(3))]
    joints = [UrdfJoint(f"j{i}", "prismatic", "base", f"k{i}", xyz=(x, 0.0, 0.2), lower=0.0, upper=0.05)
              for i, x in enumerate((0.0, 0.025, 0.1))]  # fmt: skip
    near = [[joint.name for joint in group] for group in apart_groups(subject(tmp_path, links, joints).item, 9)]
    assert near == [["j0", "j1", "j2"]]
    joints[1] = UrdfJoint("j1", "prismatic", "base", "k1", xyz=(0.015, 0.0, 0.2), lower=0.0, upper=0.05)
    item = subject(tmp_path, links, joints).item
    assert [[joint.name for joint in group] for group in apart_groups(item, 9)] == [["j0", "j2"], ["j1"]]


def test_a_door_sweeps_the_circle_that_it_goes_through(tmp_path: Path) -> None:
    links = [bare("base"), solid("door", (0.5, 0.02, 0.5), (0.25, 0.0, 0.0)), solid("key", (0.02, 0.02, 0.02))]
    joints = [UrdfJoint("hinge", "revolute", "base", "door", lower=0.0, upper=1.57),
              UrdfJoint("press", "prismatic", "base", "key", xyz=(0.3, 0.3, 0.0), lower=0.0, upper=0.01)]  # fmt: skip
    assert len(apart_groups(subject(tmp_path, links, joints).item, 25)) == 2


def test_the_mechanism_reads_mesh_boxes_and_turned_inertials(tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 2 3\nf 1 2 4\n", encoding="ascii")
    urdf = tmp_path / "object.urdf"
    urdf.write_text(
        '<robot name="o"><link name="a"><inertial><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>'
        '<inertia ixx="1" ixy="0" ixz="0" iyy="2" iyz="0" izz="3"/></inertial>'
        '<collision><origin xyz="0 0 1"/><geometry><mesh filename="m.obj" scale="0.5 0.5 -0.5"/></geometry></collision>'
        "</link></robot>",
        encoding="ascii",
    )
    (tmp_path / "arm").mkdir()
    item = mechanism(urdf, arm(tmp_path / "arm").overlay)
    assert item.joints == ()
    assert item.bodies["a"].inertia == pytest.approx(np.diag([2.0, 1.0, 3.0]))
    assert item.boxes["a"].min(axis=0) == pytest.approx([0.0, 0.0, -0.5])
    assert item.boxes["a"].max(axis=0) == pytest.approx([0.5, 1.0, 1.0])


def test_of_a_hose_a_few_joints_are_moved_one_by_one_and_all_of_its_parts(tmp_path: Path) -> None:
    """Twenty hinges one after the other, a lever at the end with a range of its own, and a door beside."""
    links = [bare("base"), *(UrdfLink(f"piece_{n}") for n in range(20)), UrdfLink("lever"), UrdfLink("door")]
    joints = [
        UrdfJoint(f"bend_{n}", "revolute", f"piece_{n - 1}" if n else "base", f"piece_{n}", lower=-0.5, upper=0.5)
        for n in range(20)
    ]
    joints += [UrdfJoint("lever", "revolute", "piece_19", "lever", lower=0.0, upper=1.5),
               UrdfJoint("door", "revolute", "base", "door", lower=0.0, upper=1.0)]  # fmt: skip
    item = subject(tmp_path, links, joints).item
    asked = [joint.name for joint in item.asked]
    assert set(asked) == {"bend_0", "bend_5", "bend_10", "bend_14", "bend_19", "lever", "door"}
    assert len(item.joints) == 22
    # Sums over them come out the same in every process, to the last digit.
    assert list(item.moved["bend_0"]) == [*(f"piece_{n}" for n in range(20)), "lever"]
    runs: list[tuple[str, ...]] = []

    def run(names: Sequence[str]) -> dict[str, bool]:
        runs.append(tuple(names))
        return {name: name != "bend_5" or len(names) == 1 for name in names}

    found = run_in_groups(item, asked, run, bool)
    assert set(found) == set(asked) and all(found.values()), "what fails in company is run again"
    assert set(runs[0]) == set(asked) - {"door"} and runs[1] == ("door",), "a chain moves as a whole"
    short = subject(tmp_path, links[:8], joints[:7]).item
    assert short.asked == short.joints
