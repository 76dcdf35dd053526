"""The tree among bodies that joints tie, and kinematic loops, which a URDF's tree cannot hold: the joints of a loop are
made to follow one of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.edit import short_numbers
from asset2sim.assets.urdf.read import element_joint
from asset2sim.intake.formats.format import add_child
from asset2sim.intake.formats.mjcf_loops import loop_ties
from asset2sim.intake.formats.mjcf_ties import tie
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import link_to_root, parents_first


@dataclass(frozen=True)
class SpanningTree:
    """The ``roots``, one of each group of bodies that hang together; ``ways``, the numbers of the joints from them on,
    parents first, each with whether it is turned round: its second end is the parent; and ``loops``, the numbers of
    the joints that would close a loop."""

    roots: tuple[str, ...]
    ways: tuple[tuple[int, bool], ...]
    loops: tuple[int, ...]


def spanning(bodies: Sequence[str], ends: Sequence[tuple[str, str]]) -> SpanningTree:
    """The tree of ``bodies``, of which those to be roots come first; ``ends`` are the joints', of which those that are
    to be left out where they close a loop come last."""
    group = {body: body for body in bodies}

    def top(body: str) -> str:
        while group[body] != body:
            group[body] = body = group[group[body]]
        return body

    at: dict[str, list[tuple[int, str, bool]]] = {body: [] for body in bodies}
    loops = list[int]()
    for number, (first, second) in enumerate(ends):
        one, other = top(first), top(second)
        if one == other:
            loops.append(number)
            continue
        group[other] = one
        at[first].append((number, second, False))
        at[second].append((number, first, True))
    roots, ways, reached = list[str](), list[tuple[int, bool]](), set[str]()
    for body in bodies:
        if body in reached:
            continue
        roots.append(body)
        reached.add(body)
        waiting = [body]
        for above in waiting:
            for number, below, turned in at[above]:
                if below not in reached:
                    reached.add(below)
                    waiting.append(below)
                    ways.append((number, turned))
    return SpanningTree(tuple(roots), tuple(ways), tuple(loops))


JOINTS = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide"}
"""Kinds of joints of one freedom, and MuJoCo's words for them; what a fixed one closes has no joint of its own."""


@dataclass(frozen=True, eq=False)
class Closing:
    """A joint that closes a loop: its kind, the links at its ``ends``, its (4, 4) ``pose`` in the first as drawn, and
    its axis in that."""

    name: str
    kind: str
    ends: tuple[str, str]
    pose: Array
    axis: Array


def close_loops(robot: Element, closings: Sequence[Closing]) -> Iterator[str]:
    """Make the joints of each loop follow one of them, as the joints that the tree leaves out would; the links which
    those join may pass through one another, as all joined links may. A note for each loop, or for each joint left out
    where its loop does not have exactly one degree of freedom."""
    said, apart = set[int](), {item.ends for item in closings}
    links = {str(link.get("name")) for link in robot.findall("link")}
    usable = [item for item in closings if item.kind in (*JOINTS, "fixed") and links.issuperset(item.ends)]
    if usable:
        try:
            import mujoco
        except ModuleNotFoundError:
            usable = []
    if usable:
        model = mujoco.MjModel.from_xml_string(kinematics(robot, usable))
        found = loop_ties(mujoco, model, lambda joint: str(model.joint(joint).name))
        yield from found.notes
        yield from tie(robot, found.ties)
        apart |= {(str(model.body(one).name), str(model.body(other).name)) for one, other in found.apart}
        said = found.said
    for one, other in sorted(apart):
        if links.issuperset((one, other)):
            add_child(robot, "disable_collisions", link1=one, link2=other, reason="Never")
    for item in closings:
        if item not in usable or usable.index(item) not in said:
            yield f"joint '{item.name}' closes a loop, which a URDF cannot say: it is left out"


def kinematics(robot: Element, closings: Sequence[Closing]) -> str:
    """An MJCF of the tree's links, a kilogram each, and the ends of the ``closings``, welded to what they close on."""
    tree = [element_joint(joint) for joint in robot.findall("joint")]
    below = {joint.child: joint for joint in tree}
    names = [str(link.get("name")) for link in robot.findall("link")]
    roots = [name for name in names if name not in below]
    places = [place[:3, 3] for root in roots for place in link_to_root(parents_first(tree), root, {}).values()]
    document = etree.Element("mujoco")
    add_child(document, "compiler", angle="radian", autolimits="true")
    add_child(document, "statistic", extent=short_numbers([max(float(np.ptp(places, axis=0).max()), 1e-3)]))
    world = add_child(document, "worldbody")
    bodies = {root: add_body(world, root, np.eye(4)) for root in roots}
    for joint in parents_first(tree):
        bodies[joint.child] = add_body(bodies[joint.parent], joint.child, joint.child_to_parent)
        limit = robot.find(f"joint[@name='{joint.name}']/limit")
        ends = [] if limit is None or joint.type == "continuous" else [limit.get("lower"), limit.get("upper")]
        add_joint(bodies[joint.child], joint.name, joint.type, joint.axis, [float(end) for end in ends if end])
    ties = add_child(document, "equality")
    for number, item in enumerate(closings):
        end = add_body(bodies[item.ends[0]], f"{number} of the loops", item.pose)
        add_joint(end, item.name, item.kind, item.axis, [])
        add_child(ties, "weld", body1=str(end.get("name")), body2=item.ends[1])
    return etree.tostring(document, encoding="unicode")


def add_body(parent: Element, name: str, pose: Array) -> Element:
    """A body of a kilogram at a (4, 4) pose in what it hangs on."""
    axes = [*pose[:3, 0], *pose[:3, 1]]
    body = add_child(parent, "body", name=name, pos=short_numbers(pose[:3, 3]), xyaxes=short_numbers(axes))
    add_child(body, "inertial", pos="0 0 0", mass="1", diaginertia="1 1 1")
    return body


def add_joint(body: Element, name: str, kind: str, axis: Array, ends: Sequence[float]) -> None:
    """The joint that moves a body in what it hangs on, with its range where that has two ``ends``."""
    if kind in JOINTS:
        joint = add_child(body, "joint", name=name, type=JOINTS[kind], axis=short_numbers(axis))
        if len(ends) == 2 and ends[0] < ends[1]:
            joint.set("range", short_numbers(list(ends)))
