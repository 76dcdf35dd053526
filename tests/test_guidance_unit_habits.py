"""Sizes of objects of our own whose files have them in each of the field's habits: metres, a unit by mistake, a cube or
a ball of size one; nothing but names says what they are."""

import math
import re
from pathlib import Path

import pytest

from asset2sim.guidance.category import named_in_file
from asset2sim.intake.origin import extract
from asset2sim.models.ask_overlay import ask_overlay
from asset2sim.models.prompts import SYNTHESIS, overlay_request
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source
from tests.assets import box_obj, joint, link, mesh, prior, robot, written

Edges = tuple[float, float, float]
OBJECTS: dict[str, tuple[Edges, str, str]] = {
    "cabinet": ((0.3917, 0.6113, 0.7209), "carcass", "door"),
    "toolbox": ((0.2071, 0.4213, 0.1897), "box", "lid"),
    "microwave": ((0.3609, 0.4817, 0.2813), "housing", "door"),
    "laptop": ((0.2317, 0.3313, 0.0219), "base", "screen"),
    "trash_can": ((0.2711, 0.2903, 0.6107), "bin", "lid"),
}
"""Name of the folder and robot → its true edges (depth, width, height, m), and the names of its two parts."""
HABITS = ("metres", "millimetres", "centimetres", "inches", "cube", "ball")
UNITS = {"metres": 1.0, "millimetres": 1000.0, "centimetres": 100.0, "inches": 1.0 / 0.0254}
RIGHT = 1.35
"""Factor within which a size counts as right: such things vary by as much."""


def stated(edges: Edges, habit: str) -> float:
    """Length in the file of one metre of the object."""
    return UNITS.get(habit) or 1.0 / (max(edges) if habit == "cube" else math.hypot(*edges) / 2.0)


def size_over_truth(name: str, habit: str, folder: Path, named: str = "folder") -> tuple[float, bool]:
    """Longest edge that the object gets over its true one, and whether its size is its file's; the object is ``named``
    by its folder, its links, its robot or nowhere."""
    edges, body, part = OBJECTS[name]
    body, part = (
        (f"{name}_{body}", f"{name}_{part}")
        if named == "links"
        else (body, part)
        if named == "folder"
        else ("link_0", "link_1")
    )
    place = name if named == "folder" else "asset_03"
    unit = stated(edges, habit)
    x, y, z = (unit * edge for edge in edges)
    files = {"body.obj": box_obj((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z)),
             "part.obj": box_obj((0.0, 0.0, -z / 2), (0.03 * x, y, z / 2))}  # fmt: skip
    urdf = robot(link(body, mesh("body.obj")), link(part, mesh("part.obj")),
                 joint("hinge", "revolute", body, part, xyz=f"{x / 2} {-y / 2} {z / 2}", axis="0 0 1",
                       limit="0 1.5"))  # fmt: skip
    urdf = re.sub(r'<robot name="[^"]*"', f'<robot name="{name if named == "robot" else "object"}"', urdf)
    item = extract(AssetRef(asset_id=place, path=str(written(folder / habit / named / name / place, urdf, files))))
    overlay, _, _ = ask_overlay(overlay_request(SYNTHESIS, item.features, None), item.features, prior)
    done, _ = validate(item, overlay, Source.PRIOR, 0.5, PhysicsSettings())
    longest = done.scale * max(item.features.closed_size)
    return longest / max(edges), done.scale == 1.0


@pytest.mark.parametrize("habit", HABITS)
def test_an_object_has_its_size_in_whatever_unit_its_file_is(habit: str, tmp_path: Path) -> None:
    ratios = {name: size_over_truth(name, habit, tmp_path) for name in OBJECTS}
    right = {name for name, (ratio, _) in ratios.items() if 1 / RIGHT <= ratio <= RIGHT}
    if habit == "metres":
        assert right == OBJECTS.keys() and all(kept for _, kept in ratios.values()), ratios
    # A toolbox is sized as the usual one, which is smaller than this: 0.71 of it.
    assert right >= OBJECTS.keys() - {"toolbox"}, ratios
    assert not any(kept for name, (_, kept) in ratios.items() if name not in right), "a wrong size is not kept"


@pytest.mark.parametrize("named", ["links", "robot"])
def test_a_category_is_read_from_the_names_in_a_file(named: str, tmp_path: Path) -> None:
    metres, others = ({name: size_over_truth(name, habit, tmp_path, named) for name in OBJECTS} for habit in HABITS[:2])
    assert all(kept for _, kept in metres.values()), metres
    assert {name for name, (ratio, _) in others.items() if 1 / RIGHT <= ratio <= RIGHT} >= OBJECTS.keys() - {"toolbox"}


def test_names_of_parts_do_not_name_an_object() -> None:
    assert named_in_file("asset_03", "object", ["link_0", "link_1"]) == ""
    assert named_in_file("asset_03", "object", ["body", "left_door"]) == ""
    assert named_in_file("asset_03", "object", ["door", "handle"]) == ""
    assert named_in_file("asset_03", "object", ["door_frame", "door_panel"]) == "Door"
    assert named_in_file("asset_03", "MicrowaveOven_v2", ["body"]) == "Microwave"
    assert named_in_file("my_laptop", "microwave", ["body"]) == "", "its own name is read where it is sized"
