"""A scene put together again: its refined parts, each where it stood, in one URDF, one MJCF and one USD.

The URDF holds every part by a fixed joint on a link ``world``: a URDF is one tree, so what is free is held in it, too.
MJCF and USD attach and refer to the parts' own exports, each in its folder: what is free is free there.
"""

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element
from scipy.spatial.transform import Rotation

from asset2sim.assets import mujoco_options
from asset2sim.assets.exports import has_usd
from asset2sim.assets.exports.mjcf import HOME, exact_numbers, export_mjcf, pos_and_quat, write_options
from asset2sim.assets.exports.refined_object import MJCF_NAME, USD_NAME, ExportObject, read_object, wxyz_of
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.base import WORLD
from asset2sim.assets.urdf.edit import serialised, short_numbers
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import rpy_of
from schemas.overlay import PhysicsOverlay

PLACEMENT_NAME = "placement.json"
PARTS = "parts"
"""Folder of the parts' own folders."""
URDF_SCENE, MJCF_SCENE, USD_SCENE = "scene.urdf", "scene.xml", "scene.usda"


@dataclass(frozen=True, eq=False)
class PlacedPart:
    """A part's ``name``, its refined ``folder`` below the scene's, its overlay, the (4, 4) pose of its authored root in
    the scene, and what became of it: ``refined``, or ``authored`` geometry that is held."""

    name: str
    folder: Path
    overlay: PhysicsOverlay
    to_scene: Array
    made: str

    @property
    def root_to_scene(self) -> Array:
        """(4, 4) pose of the refined root in the scene, in which the part may be turned."""
        pose = self.to_scene.copy()
        pose[:3, :3] = pose[:3, :3] @ Rotation.from_rotvec(self.overlay.turned_rad).as_matrix().T
        return pose


def write_urdf(folder: Path, name: str, parts: Sequence[PlacedPart]) -> Path:
    """Write the scene's URDF; its path."""
    path = folder / URDF_SCENE
    path.write_bytes(serialised(whole_urdf(folder, name, parts)))
    return path


def write_whole(
    folder: Path, name: str, parts: Sequence[PlacedPart], passing: Collection[frozenset[str]], timestep_s: float
) -> None:
    """Write MJCF and placement of the scene of these parts beside its URDF, and USD where ``usd-core`` is installed;
    ``passing`` are pairs of links of different parts that do not collide. Raises what the exports raise."""
    items = [read_object(part.folder, part.overlay) for part in parts]
    moved = {name for item in items for name in moved_links(item)}
    owner = {link: index for index, item in enumerate(items) for link in item.bodies}
    every = sorted(tuple(sorted(pair, key=lambda link: (owner[link], link))) for pair in passing)
    pairs = [pair for pair in every if moved.intersection(pair)]
    robot = etree.parse(str(folder / URDF_SCENE)).getroot()
    for first, second in every:
        etree.SubElement(robot, "disable_collisions", link1=first, link2=second, reason="Never")
    (folder / URDF_SCENE).write_bytes(serialised(robot))
    for part in parts:
        export_mjcf(part.folder, part.overlay, timestep_s)
    document = whole_mjcf(folder, name, parts, items, timestep_s)
    contact = etree.SubElement(document, "contact")
    bodies = {link: f"{part.name}/{mujoco_options.body_name(link, item.bodies)}"
              for part, item in zip(parts, items, strict=True) for link in item.bodies}  # fmt: skip
    for first, second in pairs:
        etree.SubElement(contact, "exclude", body1=bodies[first], body2=bodies[second])
    etree.indent(document, space="  ")
    (folder / MJCF_SCENE).write_bytes(etree.tostring(document, encoding="utf-8", pretty_print=True))
    if has_usd():
        write_usd(folder, name, parts, items, pairs, timestep_s)
    rows = [part_placement(folder, part, item) for part, item in zip(parts, items, strict=True)]
    text = json.dumps({"scene": name, "parts": rows, "do_not_collide": pairs}, indent=1, ensure_ascii=False)
    (folder / PLACEMENT_NAME).write_text(text, encoding="utf-8")


def moved_links(item: ExportObject) -> set[str]:
    """The links that can move in the scene: all of a free object, of one that is held those beyond its joints."""
    found = set[str]() if item.fixed else {*item.bodies}
    for joint in item.joints:
        if joint.moves or joint.tree.parent in found:
            found.add(joint.tree.child)
    return found


def part_placement(folder: Path, part: PlacedPart, item: ExportObject) -> dict[str, object]:
    """Place and state of one part: of its root in the scene, m and (x y z w), and its joints, rad or m."""
    pose = part.root_to_scene
    return {
        "part": part.name,
        "asset_id": part.overlay.asset_id,
        "folder": part.folder.relative_to(folder).as_posix(),
        "root": item.root,
        "free": not item.fixed,
        "made": part.made,
        "position_m": pose[:3, 3].tolist(),
        "quaternion_xyzw": Rotation.from_matrix(pose[:3, :3]).as_quat().tolist(),
        "joints": item.initial,
    }


def whole_urdf(folder: Path, name: str, parts: Sequence[PlacedPart]) -> Element:
    """The URDF of all parts, which keep the names of their links and joints; no two have one name in their scene."""
    documents = [etree.parse(str(part.folder / URDF_NAME)).getroot() for part in parts]
    robot, world = etree.Element("robot", name=name), WORLD
    taken = {item.get("name") for document in documents for item in document}
    while world in taken:
        world += "_"
    etree.SubElement(robot, "link", name=world)
    for part, document in zip(parts, documents, strict=True):
        children = {child.get("link") for child in document.iterfind("joint/child")}
        root = next(str(link.get("name")) for link in document.findall("link") if link.get("name") not in children)
        for element in document.iter("mesh", "texture"):
            element.set("filename", f"{part.folder.relative_to(folder).as_posix()}/{element.get('filename')}")
        joint = etree.SubElement(robot, "joint", name=f"{world}_to_{root}", type="fixed")
        pose = part.root_to_scene
        etree.SubElement(joint, "origin", xyz=short_numbers(pose[:3, 3]), rpy=short_numbers(rpy_of(pose[:3, :3])))
        etree.SubElement(joint, "parent", link=world)
        etree.SubElement(joint, "child", link=root)
        known = {item.get("name") for item in robot.findall("material")}
        robot.extend([item for item in document if item.tag != "material" or item.get("name") not in known])
    return robot


def whole_mjcf(
    folder: Path, name: str, parts: Sequence[PlacedPart], items: Sequence[ExportObject], timestep_s: float
) -> Element:
    """The MJCF that attaches each part's own, its names behind ``<part>/``; ``home`` is the initial state of all."""
    root = etree.Element("mujoco", model=name)
    etree.SubElement(root, "compiler", angle="radian", autolimits="true")
    write_options(root, timestep_s)
    assets, world = etree.SubElement(root, "asset"), etree.SubElement(root, "worldbody")
    state: list[float] = []
    for part, item in zip(parts, items, strict=True):
        file = (part.folder / MJCF_NAME).relative_to(folder).as_posix()
        etree.SubElement(assets, "model", name=part.name, file=file)
        frame = etree.SubElement(
            world, "frame", pos_and_quat(pose_in_scene(part, item, item.initial if item.fixed else {}))
        )
        body = mujoco_options.body_name(item.root, item.bodies)
        etree.SubElement(frame, "attach", model=part.name, body=body, prefix=f"{part.name}/")
        own = etree.parse(str(part.folder / MJCF_NAME)).find(f"keyframe/key[@name='{HOME}']")
        values = [] if own is None else [float(word) for word in str(own.get("qpos")).split()]
        pose = part.root_to_scene
        state += values if item.fixed else [*pose[:3, 3], *wxyz_of(pose[:3, :3]), *values[7:]]
    etree.SubElement(etree.SubElement(root, "keyframe"), "key", name=HOME, qpos=exact_numbers(state))
    return root


def pose_in_scene(part: PlacedPart, item: ExportObject, positions: dict[str, float]) -> Array:
    """(4, 4) pose of an export of the part in the scene; the export stands on its own z = 0 at these positions."""
    down = np.eye(4)
    down[2, 3] = -item.height_to_stand(positions)
    return np.asarray(part.root_to_scene @ down)


def write_usd(
    folder: Path,
    name: str,
    parts: Sequence[PlacedPart],
    items: Sequence[ExportObject],
    passing: Sequence[tuple[str, ...]],
    timestep_s: float,
) -> None:
    """Write each part's own USD, and one that refers to them; pairs of links that are ``passing`` do not collide."""
    from pxr import Usd, UsdGeom, UsdPhysics

    from asset2sim.assets.exports.usd import export_usd, filter_pairs
    from asset2sim.assets.exports.usd_collision import set_transform
    from asset2sim.assets.exports.usd_looks import PrimPaths, identifier, unique_paths

    for part in parts:
        export_usd(part.folder, part.overlay, timestep_s)
    path = folder / USD_SCENE
    path.unlink(missing_ok=True)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    top = f"/{identifier(name)}"
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, top).GetPrim())
    prims, bodies = unique_paths(top, (part.name for part in parts)), dict[str, str]()
    for part, item in zip(parts, items, strict=True):
        xform = UsdGeom.Xform.Define(stage, prims[part.name])
        file = (part.folder / USD_NAME).relative_to(folder).as_posix()
        xform.GetPrim().GetReferences().AddReference(f"./{file}")
        set_transform(xform, pose_in_scene(part, item, item.initial))
        own = PrimPaths(item)
        bodies |= {link: prims[part.name] + at.removeprefix(own.top) for link, at in own.links.items()}
    filter_pairs(stage, passing, bodies)
    stage.Save()
