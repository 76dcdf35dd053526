"""Nested models of an SDF file, brought up into the model that holds them."""

from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.base import unused
from asset2sim.assets.urdf.edit import short_numbers
from asset2sim.intake.formats.sdf_includes import FRAMED_AXES
from asset2sim.intake.formats.sdf_model import SdfModel
from asset2sim.physics.kinematics import rpy_of

KINDS = ("link", "joint", "frame")
SEPARATOR = "__"
"""Between the names of a model and of what it holds, in place of SDF's ``::``, which file names do not bear."""


def name_nameless(model: Element) -> None:
    """Name each link, joint and frame of a model and those nested in it that has no name, after its kind and place."""
    for inner in model.iter("model"):
        for kind in KINDS:
            taken = {str(item.get("name")) for item in inner.findall(kind)}
            for number, item in enumerate(inner.findall(kind), 1):
                if not item.get("name"):
                    item.set("name", unused(f"{kind}_{number}", taken))


def flatten(model: Element, version: tuple[int, ...], file: Path) -> None:
    """Move links, joints and frames of nested models into ``model``, named after both, with poses relative to a frame
    that stands for the nested model; ``file`` is for messages. ``version``: SDF's, up to 1.4 of which axes are stated
    in the model's frame."""
    for inner in model.findall("model"):
        flatten(inner, version, file)
        name = str(inner.get("name"))
        frame = etree.SubElement(model, "frame", name=frame_of(name))
        frame.extend(inner.findall("pose"))
        if placement := str(inner.get("placement_frame") or ""):
            place_by(frame, SdfModel(file, inner, version), placement.replace("::", SEPARATOR))
        for item in [item for kind in KINDS for item in inner.findall(kind)]:
            item.set("name", _joined(name, str(item.get("name"))))
            _place(item, name)
            if item.tag == "joint":
                _connect(item, name, version)
            model.append(item)
        model.remove(inner)
        if inner.get("merge"):
            _unprefixed(model, name)
    for joint in model.findall("joint"):
        for end in (*joint.findall("parent"), *joint.findall("child")):
            end.text = str(end.text or "").strip().replace("::", SEPARATOR)
    _name_frames(model)


def _name_frames(model: Element) -> None:
    """Name frames that poses and axes are relative to as they are called in the flat model: ``shelf::door``, and a
    nested model by its own name."""
    items = [item for kind in KINDS for item in model.findall(kind)]
    names = {str(item.get("name")) for item in items}
    for holder in (each for item in items for each in (item, *item.findall("pose"), *item.iterfind("*/xyz"))):
        for key in ("relative_to", "attached_to", "expressed_in"):
            frame = str(holder.get(key) or "").replace("::", SEPARATOR)
            if frame:
                holder.set(key, frame_of(frame) if frame not in names and frame_of(frame) in names else frame)


def place_by(frame: Element, inner: SdfModel, placement: str) -> None:
    """Have the pose of a nested model's frame be such that a frame of that model, its ``placement``, has the pose that
    is stated for it. Raises AssetError (sdf_frame) where the model has no such frame."""
    pose = frame.find("pose")
    pose = etree.SubElement(frame, "pose") if pose is None else pose
    stated = inner.own_pose(frame) if (pose.text or "").strip() else np.eye(4)
    placed = stated @ np.linalg.inv(inner.pose(placement))
    pose.text = short_numbers([*placed[:3, 3], *rpy_of(placed[:3, :3])])
    for key in ("rotation_format", "degrees"):
        pose.attrib.pop(key, "")


def _unprefixed(model: Element, name: str) -> None:
    """Take the prefix off the names of what was merged, and wherever they are referred to."""
    start = _joined(name, "")
    for element in model.iter(etree.Element):
        for key, value in element.attrib.items():
            if str(value).startswith(start) and value != frame_of(name):
                element.set(key, str(value)[len(start) :])
        if element.tag in ("parent", "child") and str(element.text).strip().startswith(start):
            element.text = str(element.text).strip()[len(start) :]


def _joined(model: str, name: str) -> str:
    return f"{model}{SEPARATOR}{name}"


def frame_of(model: str) -> str:
    """The name of the frame that stands for a nested model."""
    return _joined(model, "model")


def _frame_in(model: str, name: str) -> str:
    return _joined(model, "model" if name in ("", "__model__") else name)


def _place(item: Element, model: str) -> None:
    """State an item's pose relative to the frame of its model, or to what it was stated relative to."""
    attached = item.get("attached_to")
    if attached:
        item.set("attached_to", _frame_in(model, attached))
    pose = item.find("pose")
    if pose is None and (item.tag == "joint" or attached):
        return  # its child's frame, or the one that it is attached to
    if pose is None:
        pose = etree.SubElement(item, "pose")
        pose.text = "0 0 0 0 0 0"
    stated = str(pose.get("relative_to") or pose.get("frame") or "")
    if stated or (item.tag == "link" or not (item.tag == "joint" or attached)):
        pose.set("relative_to", _frame_in(model, stated))


def _connect(joint: Element, model: str, version: tuple[int, ...]) -> None:
    """Name a joint's links, and the frames of its axes, as they are called outside."""
    for end in (*joint.findall("parent"), *joint.findall("child")):
        link = str(end.text or "").strip()
        end.text = link if link == "world" else _joined(model, link)
    for axis in (*joint.findall("axis"), *joint.findall("axis2")):
        direction = axis.find("xyz")
        in_model = (axis.findtext("use_parent_model_frame") or "").strip() in ("1", "true") or version <= FRAMED_AXES
        if direction is not None and (direction.get("expressed_in") or in_model):
            direction.set("expressed_in", _frame_in(model, str(direction.get("expressed_in") or "")))
        for mimic in axis.findall("mimic"):
            mimic.set("joint", _joined(model, str(mimic.get("joint"))))
