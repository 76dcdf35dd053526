"""What is said of how parts move and fall, of objects whose answers are known by hand; front is -x, left is +y."""

from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asset2sim.assets.authored_overlap import rest_overlaps
from asset2sim.intake.origin import extract
from asset2sim.models.motion_facts import Motion, joint_motions
from asset2sim.models.object_facts import synthesis_facts
from schemas.asset import AssetRef
from schemas.features import Features, RestOverlap
from tests.assets import box_obj, joint, link, robot, shape

BODY = link("body", shape("1 1 1", xyz="0 0 0.5"))


def features(folder: Path, *parts: str) -> Features:
    """A cube of 1 m on the ground with these parts, facing -x as PartNet-Mobility's objects do."""
    (folder / "model.urdf").write_text(robot(BODY, *parts))
    (folder / "semantics.txt").write_text("body free box_body\n")
    return extract(AssetRef(asset_id="7", path=str(folder))).features


def told_of(item: Features, overlaps: tuple[RestOverlap, ...] = ()) -> dict[str, Any]:
    return synthesis_facts(item, overlaps)


def motion(folder: Path, *parts: str) -> Motion:
    return joint_motions(features(folder, *parts))["j"]


def lid(limit: str) -> tuple[str, str]:
    """A board on top of the cube, hinged at its back; it opens up and back."""
    return (
        link("lid", shape("1 1 0.02", xyz="-0.5 0 0.01")),
        joint("j", "revolute", "body", "lid", xyz="0.5 0 1", axis="0 1 0", limit=limit),
    )


def test_a_lid_that_falls_shut(tmp_path: Path) -> None:
    found = motion(tmp_path, *lid("0 1.2"))
    assert found.opens == (
        "turns by 69° about a left-to-right line at its back; its far edge sets off up, ends higher and further back"
    )
    assert found.gravity == "closed: stays shut; half open: falls shut; fully open: falls shut"
    assert found.origin == pytest.approx([0.5, 0.0, 1.0])


def test_a_lid_past_vertical_falls_open(tmp_path: Path) -> None:
    found = motion(tmp_path, *lid("0 2.8"))
    assert found.gravity.startswith(
        "closed: stays shut; half open: falls shut; fully open: stays open; balances at 1.55"
    )
    # The middle of its 2 cm is 1 cm above the hinge, so that it balances a little before a right angle.
    at = float(found.gravity.split("balances at ")[1].split(" rad")[0])
    assert at == pytest.approx(np.pi / 2 - np.arctan(0.01 / 0.5), abs=0.005)


MOVES = {
    "a flap at the bottom falls open": (
        ("lid", shape("0.02 1 1", xyz="-0.01 0 0.5")), ("revolute", "-0.5 0 0", "0 -1 0", "0 1.4"),
        "*left-to-right line at its bottom; its far edge sets off forward, ends*",
        "*half open: falls open; fully open: stays open*",
    ),
    "a drawer stays": (
        ("drawer", shape("0.5 0.8 0.3")), ("prismatic", "-0.25 0 0.5", "-1 0 0", "0 0.4"),
        "slides forward by 40% of the object's longest edge", "stays wherever it is left",
    ),
    "a hinge at the left opens to the front": (
        ("door", shape("0.02 1 1", xyz="-0.01 -0.5 0.5")), ("revolute", "-0.5 0.5 0", "0 0 -1", "0 1.5"),
        "turns by 86° about an upright line at its left; its far edge sets off forward, ends*",
        "stays wherever it is left",
    ),
    "a handle without limits hangs": (
        ("bail", shape("0.02 1 0.4", xyz="0 0 0.2")), ("continuous", "0 0 1", "0 1 0", None),
        "turns without end about a left-to-right line at its bottom", "swings until it hangs at*3.14*",
    ),
    "a seat folds about its middle": (
        ("seat", shape("0.8 0.6 0.1")), ("revolute", "0 0 1.2", "0 1 0", "0 1.2"),
        "*left-to-right line through its own middle; its front edge sets off up", "*",
    ),
}  # fmt: skip
"""Part; kind, place, axis and limits of its joint; patterns of what is said of its way and of gravity."""


@pytest.mark.parametrize("name", MOVES)
def test_a_way_and_what_gravity_does_are_said_in_words(name: str, tmp_path: Path) -> None:
    (part, form), (kind, xyz, axis, limit), opens, gravity = MOVES[name]
    found = motion(tmp_path, link(part, form), joint("j", kind, "body", part, xyz=xyz, axis=axis, limit=limit))
    assert fnmatchcase(found.opens, opens) and fnmatchcase(found.gravity, gravity), found


def test_what_faces_forward_along_x_has_its_left_there(tmp_path: Path) -> None:
    (tmp_path / "model.urdf").write_text(robot(BODY))
    facts = told_of(extract(AssetRef(asset_id="7", path=str(tmp_path))).features)
    assert facts["directions"] == "up is +z, front is +x, left (to someone who stands before it) is -y"


def test_sizes_and_weights_are_those_of_the_shapes(tmp_path: Path) -> None:
    found = features(tmp_path, *lid("0 2.8"))
    facts = told_of(found)
    for row in facts["sizes"]:
        edges = np.asarray(found.closed_size) * row["scale"] * 100.0
        assert row["depth_width_height_cm"] == pytest.approx(edges, rel=0.01)
    (told,) = [item for item in facts["links"] if item["name"] == "lid"]
    longest = max(found.closed_size)
    assert longest == pytest.approx(1.02)
    assert told["kg_at_longest_1m"]["solid"] == pytest.approx(1000 * 0.02 / longest**3, rel=0.01)
    assert told["kg_at_longest_1m"]["per_mm_of_wall"] == pytest.approx(2.08 / longest**2, rel=0.01)
    assert told["volume_means"] == "block" and told["com_m"] == pytest.approx([0.0, 0.0, 1.01], abs=1e-3)
    assert "mass_kg" not in told and "materials" not in told and "volume_source" not in told


def test_words_that_an_earlier_joint_has_are_not_repeated(tmp_path: Path) -> None:
    drawers = [
        text
        for index, height in enumerate((0.3, 0.7))
        for text in (
            link(f"drawer{index}", shape("0.5 0.8 0.3")),
            joint(
                f"j{index}", "prismatic", "body", f"drawer{index}", xyz=f"-0.2 0 {height}", axis="-1 0 0", limit="0 1"
            ),
        )
    ]
    first, second = told_of(features(tmp_path, *drawers))["joints"]
    assert first["gravity"] == "stays wherever it is left" and second["moves_like"] == "j0" and "opens" not in second


@pytest.mark.parametrize(("x", "depth"), [(1.2, None), (0.97, "over 1 %"), (0.993, "up to 0.5 %")])
def test_overlaps_are_of_the_meshes_as_drawn(tmp_path: Path, x: float, depth: str | None) -> None:
    (tmp_path / "box.obj").write_text(box_obj((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)))
    mesh = '<collision><geometry><mesh filename="box.obj"/></geometry></collision>'
    second = joint("j", "prismatic", "a", "b", xyz=f"{x} 0.1 0.1", axis="1 0 0", limit="0 1")
    (tmp_path / "model.urdf").write_text(robot(link("a", mesh), link("b", mesh), second))
    extraction = extract(AssetRef(asset_id="7", path=str(tmp_path)))
    told = told_of(extraction.features, rest_overlaps(extraction))["overlaps_at_rest"]
    assert told == ([] if depth is None else [{"links": ["a", "b"], "depth": depth}])
