"""An SDF model's joints as a tree of links, which begins at the world or at links that no joint carries; its gearboxes
as joints that follow one another."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.intake.formats.mjcf_ties import Tie
from asset2sim.intake.formats.sdf_model import CLOSING
from asset2sim.intake.formats.sdf_nested import SEPARATOR, frame_of
from asset2sim.intake.formats.tree_loops import spanning
from asset2sim.physics.arrays import Array

WORLD = "world"
"""SDF's name for the world at a joint's end."""
AXES = ("axis", "axis2")


def as_tree(model: Element) -> None:
    """Rewrite a flat model's joints so that they tie links, not frames, and each link is the child of one joint; those
    that would close a loop become ``CLOSING``. A link without a shape that has the world's name is the world."""
    for link in model.findall(f"link[@name='{WORLD}']"):
        if link.find("visual") is None and link.find("collision") is None:
            model.remove(link)
    joints = [joint for joint in model.findall("joint") if joint.get("type") != "gearbox"]
    ends = [(link_of(model, joint, "parent"), link_of(model, joint, "child")) for joint in joints]
    links = [str(link.get("name")) for link in model.findall("link")]
    known = {*links, WORLD}
    usable = [number for number, pair in enumerate(ends) if known.issuperset(pair)]  # of others ``check`` says it
    children = {ends[number][1] for number in usable}
    bodies = [WORLD, *dict.fromkeys(sorted(links, key=lambda link: link in children))]
    tree = spanning(bodies, [ends[number] for number in usable])
    for number in tree.loops:
        joint = joints[usable[number]]
        name = str(joint.get("name"))
        joint.tag = CLOSING
        for axis in model.iterfind("joint/axis"):
            for mimic in [mimic for mimic in axis.findall("mimic") if mimic.get("joint") == name]:
                axis.remove(mimic)
    for number, turned in tree.ways:
        if turned:
            swap_ends(joints[usable[number]])


def limits_in_axes(model: Element) -> Iterator[str]:
    """Put into a joint's one axis the limits that stand beside it, where a URDF has them; a note on each."""
    for joint in model.findall("joint"):
        axis, limit = joint.find("axis"), joint.find("limit")
        if axis is not None and limit is not None and axis.find("limit") is None:
            axis.append(limit)
            yield f"joint '{joint.get('name')}' states its limits beside its axis, not within: they are taken"


def link_of(model: Element, joint: Element, side: str) -> str:
    """The link at one side of a joint, which may name a frame or a nested model; it names the link afterwards, and the
    joint's own pose stays relative to what it was."""
    end = joint.find(side)
    if end is None:
        return ""
    stated = name = str(end.text or "").strip()
    links = [str(link.get("name")) for link in model.findall("link")]
    frames = {str(frame.get("name")): str(frame.get("attached_to") or "") for frame in model.findall("frame")}
    for _ in range(len(frames) + 1):
        if name in links or name == WORLD:
            break
        within = name if name in frames else frame_of(name)
        if within in frames and not frames[within]:
            inner = within.removesuffix(frame_of("")) if within.endswith(frame_of("")) else ""
            name = next((link for link in links if link.startswith(f"{inner}{SEPARATOR}" if inner else "")), name)
            break
        name = frames.get(within, name)
    if name != stated:
        if side == "child":
            keep_place(joint, stated if stated in frames else frame_of(stated))
        end.text = name
    return name


def keep_place(joint: Element, frame: str) -> None:
    """State that a joint's pose is relative to a frame, where it says nothing else."""
    pose = joint.find("pose")
    if pose is None:
        pose = etree.SubElement(joint, "pose")
        pose.text = "0 0 0 0 0 0"
    if not (pose.get("relative_to") or pose.get("frame")):
        pose.set("relative_to", frame)


def swap_ends(joint: Element) -> None:
    """Swap a joint's parent and child, and reverse its axes, so that its positions mean what they meant."""
    parent, child = joint.find("parent"), joint.find("child")
    if parent is None or child is None:
        return
    keep_place(joint, str(child.text).strip())
    parent.text, child.text = child.text, parent.text
    axes = [axis for axis in (joint.find(tag) for tag in AXES) if axis is not None]
    for axis, tag in zip(axes, reversed(AXES[: len(axes)]), strict=True):
        xyz = axis.find("xyz")
        if xyz is None:
            xyz = etree.SubElement(axis, "xyz")
        words = str(xyz.text or "0 0 1").split()
        xyz.text = " ".join(word[1:] if word.startswith("-") else f"-{word.lstrip('+')}" for word in words)
        axis.tag = tag


@dataclass(frozen=True)
class Hinge:
    """A hinge between two links, and its (3,) axis in the model's frame."""

    name: str
    parent: str
    child: str
    axis: Array


@dataclass(frozen=True)
class Gearbox:
    """A gearbox: the turn of ``second`` in the reference ``body``, about the second of its (3,) axes in the model's
    frame, is ``-ratio`` times that of ``first`` about the first."""

    name: str
    first: str
    second: str
    body: str
    ratio: float
    axes: tuple[Array, Array]


def gear_ties(gearboxes: Sequence[Gearbox], hinges: Sequence[Hinge]) -> Iterator[Tie | str]:
    """The tie of two hinges that each gearbox is; a note on one whose reference body has no such hinges."""
    for gear in gearboxes:
        first = turn_of(gear.first, gear.body, gear.axes[0], hinges)
        second = turn_of(gear.second, gear.body, gear.axes[1], hinges)
        if first is None or second is None or gear.ratio == 0.0:
            yield f"gearbox '{gear.name}' is left out: it ties no two hinges of its reference body '{gear.body}'"
        else:
            yield Tie(second[0], first[0], -gear.ratio * first[1] / second[1], 0.0)


def turn_of(link: str, body: str, axis: Array, hinges: Sequence[Hinge]) -> tuple[str, float] | None:
    """The hinge between a link and a body, and the sign that its position has in the link's turn about the axis."""
    for hinge in hinges:
        if {hinge.parent, hinge.child} == {link, body}:
            sign = math.copysign(1.0, float(axis @ hinge.axis))
            return hinge.name, sign if hinge.child == link else -sign
    return None
