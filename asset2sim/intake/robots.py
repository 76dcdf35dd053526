"""Robots and free bodies without joints that stand in a file beside its object, and are left out."""

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.read import element_joint
from asset2sim.intake.formats.format import Converted
from asset2sim.physics.kinematics import TreeJoint, parents_first, rigid_links

WORDS = re.compile(
    r"(?<![a-z])(robots?|arm|gripper|finger|wrist|panda|franka|emika|ur(3|5|10|16|20)e?|iiwa|sawyer|baxter|jaco|kinova|gen3|"
    r"[fmrl]fj\d+|thj\d+|wrj\d+|xarm\d?|lite6|fetch|widowx|viperx|vx300s?|wx250s?|aloha|yumi|robotiq|allegro|shadow|tiago|pr2|spot|go[12]|g1|h1)(?![a-z])",
    re.IGNORECASE,
)
"""Words in the names of robots' links and joints."""
LONG, LONGEST = 6, 12
"""Joints in a row from which a chain of widely turning hinges is an arm, and above which it is a hose or a chain; a
desk lamp has five."""
SHORT = 4
"""Joints in a row from which it is one where motors move it, or its names say so: small arms have four."""
FINGER, HAND = 3, 6
"""Joints in a row, and in all, from which it is a hand of several fingers where motors move it, or its names say so."""
GANTRY = 3
"""Slides in a row from which motors move a gantry or a floating hand: one along each axis."""
WIDE_RAD = math.radians(120.0)
"""Median range of an arm's joints, at least: those of a panda are between 166° and 332°."""
DRIVEN_SHARE = 0.8
"""Share of a robot's joints that have motors; a gripper's second finger has none."""


def without_robots(converted: Converted) -> Converted:
    """The file as read, without the robots that hang on its world, or on its root where that has no shape, beside
    something else; a note on each. An object that is then alone and free hangs on nothing."""
    hung = _Hung.of(converted)
    if hung is None or len(hung.tree) < SHORT:
        return converted
    try:
        spans = {str(joint.get("name")): span_of(joint) for joint in converted.robot.findall("joint")}
    except ValueError:
        return converted  # reading it says what is wrong
    robots = [top for top in hung.held if is_robot(hung.tree, {*hung.held[top]}, spans, converted.driven)]
    return hung.without(
        converted, {top: f"robot '{top}' with its {len(hung.held[top])} links is left out" for top in robots}
    )


def without_bystanders(converted: Converted) -> Converted:
    """The file as read, without what is free in it and has no joints where one thing alone has any, the cube that a
    drawer is to hold, and without what stands apart from that, the bin beside it; a note on each."""
    hung = _Hung.of(converted)
    if hung is None:
        return converted
    moved = {joint.child for joint in hung.tree if joint.type not in ("fixed", "floating")}
    moving = [top for top, links in hung.held.items() if moved & {*links}]
    rigid = [top for top in hung.held if top in converted.free and top not in moving]
    if len(moving) != 1:
        return converted
    said = dict.fromkeys(rigid, "is free and has no joints, and is left out beside what has")
    said |= {top: "stands apart from what moves, and is left out" for top in converted.beside if top in hung.held}
    return hung.without(converted, {top: f"'{top}' {why}; --split keeps it" for top, why in said.items()})


@dataclass(frozen=True, eq=False)
class _Hung:
    """The links that hang on a file's world, or on its ``root`` where that has no shape: those below each of them."""

    tree: Sequence[TreeJoint]
    root: str
    held: Mapping[str, Sequence[str]]

    @classmethod
    def of(cls, converted: Converted) -> "_Hung | None":
        """Those of a file as read; None of what is no tree, of which reading says what is wrong, and of one object."""
        links = {str(link.get("name")): link for link in converted.robot.findall("link")}
        try:
            tree = parents_first([element_joint(joint) for joint in converted.robot.findall("joint")])
        except ValueError:
            return None
        roots = [name for name in links if name not in {joint.child for joint in tree}]
        if len(roots) != 1 or not (roots[0] == converted.world or bare(links[roots[0]])):
            return None
        hung = [joint for joint in tree if joint.parent == roots[0]]
        return cls(tree, roots[0], {joint.child: rigid_links(tree, joint.name) for joint in hung})

    def without(self, converted: Converted, notes: Mapping[str, str]) -> Converted:
        """The file without what hangs below the links of ``notes``, which are added to its own; as it is where nothing
        with a shape would be left."""
        robot = converted.robot
        links = {str(link.get("name")): link for link in robot.findall("link")}
        gone = {link for top in notes for link in self.held[top]}
        if not notes or all(bare(link) for name, link in links.items() if name not in gone):
            return converted
        names = {joint.name for joint in self.tree if joint.child in gone}
        rest, free = [top for top in self.held if top not in notes], tuple(n for n in converted.free if n not in gone)
        world, told = converted.world, list(converted.notes)
        alone = len(rest) == 1 and rest[0] in free and bare(links[self.root])
        if alone or free != converted.free:
            told = [note for note in told if not note.startswith(f"{', '.join(converted.free)}: free in it")]
        if alone:
            gone.add(self.root)
            names |= {joint.name for joint in self.tree if joint.parent == self.root}
            world, free = "", ()
        for item in list(robot.iterchildren(etree.Element)):
            stated = {str(item.get(key)) for key in ("name", "reference", "link1", "link2")}
            stated |= {str(end.get("name")) for end in item.findall("joint")}
            if stated & (names if item.tag in ("joint", "transmission") else gone):
                robot.remove(item)
        for joint in robot.findall("joint"):
            for mimic in [item for item in joint.findall("mimic") if item.get("joint") in names]:
                joint.remove(mimic)
        held = "" if alone else converted.held
        return replace(converted, notes=(*told, *notes.values()), free=free, world=world, held=held)


def is_robot(
    tree: Sequence[TreeJoint], held: Collection[str], spans: Mapping[str, float], driven: Collection[str]
) -> bool:
    """Whether the links that hang together by these joints, of ranges in rad, are a robot."""
    # By a joint with a motor a gantry or a floating gripper hangs on the world; an arm's base stands there.
    moving = [joint for joint in tree if joint.child in held and joint.type != "fixed"
              and (joint.parent in held or joint.name in driven)]  # fmt: skip
    below = {joint.child: [*rigid_links(tree, joint.name)] for joint in moving}
    longest = max((sum(joint.child in links for links in below.values()) for joint in moving), default=0)
    with_motor = sum(joint.name in driven for joint in moving) >= DRIVEN_SHARE * len(moving)
    named = any(WORDS.search(text) for text in (*held, *(joint.name for joint in moving)))
    slides = {joint.child for joint in moving if joint.type == "prismatic"}
    if with_motor and any(len(slides & {*links}) >= GANTRY for links in below.values()):
        return True
    if longest < SHORT:
        return (with_motor or named) and longest >= FINGER and len(moving) >= HAND
    hinges = [spans[joint.name] for joint in moving if joint.type in ("revolute", "continuous")]
    wide = len(hinges) >= LONG <= longest and float(np.median(hinges)) >= WIDE_RAD
    return with_motor or ((named or wide) and longest <= LONGEST)


def span_of(joint: Element) -> float:
    """The range of a joint as it is written; one without limits turns for ever. Raises ValueError."""
    limit = joint.find("limit")
    if limit is None or joint.get("type") == "continuous":
        return math.inf
    return float(limit.get("upper", "0")) - float(limit.get("lower", "0"))


def bare(link: Element) -> bool:
    """Whether a link is neither seen nor collides."""
    return link.find("visual") is None and link.find("collision") is None
