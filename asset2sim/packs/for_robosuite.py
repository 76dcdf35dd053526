"""Pack for robosuite: a ``MujocoXMLObject`` an object, and what robosuite's merge leaves out of its MJCF."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

from asset2sim.assets.exports.refined_object import MJCF_NAME, read_object
from asset2sim.assets.urdf.edit import ensure_child, serialised, short_numbers
from asset2sim.packs.declared_pack import Pack, PackedObject
from asset2sim.physics.kinematics import apply
from schemas.vocabulary import Export

OBJECT_XML = "object.xml"
"""The MJCF of an object as robosuite takes one."""


def write_objects(target: Path, objects: Sequence[PackedObject], given: Mapping[str, Any]) -> None:
    """Write ``object.xml`` of each object: its body as ``object`` in a body of robosuite's, with the sites by which
    robosuite places it. The root's free joint is robosuite's own; the state is set by ``reset``."""
    for item in objects:
        root = etree.parse(str(item.folder / MJCF_NAME)).getroot()
        world = ensure_child(root, "worldbody")
        body = ensure_child(world, "body")
        for free in body.findall("freejoint"):
            body.remove(free)
        renamed(root, str(body.get("name")))
        body.set("name", "object")
        body.set("pos", "0 0 0")
        outer = etree.SubElement(world, "body")
        outer.append(body)
        low, high = object_corners(item)
        radius = float(np.linalg.norm(np.maximum(np.abs(low[:2]), np.abs(high[:2]))))
        for name, place in (("bottom", (0.0, 0.0, low[2])), ("top", (0.0, 0.0, high[2])),
                            ("horizontal_radius", (radius, 0.0, 0.0))):  # fmt: skip
            etree.SubElement(outer, "site", name=f"{name}_site", pos=short_numbers(place), size="0.005", rgba="0 0 0 0")
        for tag in ("keyframe", "option", "statistic", "visual"):
            for old in root.findall(tag):
                root.remove(old)
        (item.folder / OBJECT_XML).write_bytes(serialised(root))


def renamed(root: "etree._Element", old: str) -> None:
    """Let what names the root's body name it ``object``."""
    for element in root.iterfind("contact/*"):
        for key in ("body1", "body2"):
            if element.get(key) == old:
                element.set(key, "object")


def object_corners(item: PackedObject) -> tuple[np.ndarray, np.ndarray]:
    """(3,) lowest and highest corners of an object's shapes in its initial state, in its root's frame, m."""
    read = read_object(item.folder, item.overlay)
    poses = read.poses(read.initial)
    points = np.vstack([apply(poses[body.name], shape.points) for body in read.bodies.values()
                        for shape in body.shapes])  # fmt: skip
    return points.min(axis=0), points.max(axis=0)


PACKS = (
    Pack(
        name="robosuite",
        title="robosuite",
        contents="`refined_objects.py` has `RefinedObject(name)`, a `MujocoXMLObject` for any task; `complete(task)` "
        "adds the exclusions, couplings and mechanisms that robosuite's merge leaves out, `reset(sim)` its state.",
        opens="python -c 'from refined_objects import RefinedObject; print(RefinedObject(\"NAME\").joints)'",
        exports=(Export.MJCF,),
        finish=write_objects,
    ),
)
