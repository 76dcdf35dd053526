"""The parts of a scene: what hangs on the world or on one fixed root, each cut out as a URDF of its own."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, replace
from itertools import combinations, product

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element
from scipy.spatial.transform import Rotation

from asset2sim.assets.urdf.base import WORLD, unused
from asset2sim.assets.urdf.document import strip_namespace, without_commas
from asset2sim.assets.urdf.edit import short_numbers, turn_root
from asset2sim.assets.urdf.read import element_joint
from asset2sim.intake.formats.format import Converted, add_child
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, link_to_root, parents_first

KEPT = ("link", "joint", "material")
"""Elements of a URDF that a part keeps, beside those of its links that pass each other; what else is at its top may
name links of other parts."""
UPRIGHT_RAD = 1e-9
"""Turn of a frame that is rounding."""


@dataclass(frozen=True, eq=False)
class Part:
    """One object of a scene: its ``links``, the ``root`` among them (one without shape that is made for it where it
    hangs on the world by joints), and whether it is ``free`` of the world. ``to_scene`` is the (4, 4) pose of its root
    in the scene's, upright; in the part's own URDF its root's shapes and joints are turned by the (3, 3) ``tilt``.
    ``masks``: see ``Converted``."""

    name: str
    root: str
    links: frozenset[str]
    free: bool
    to_scene: Array
    tilt: Array
    masks: Mapping[str, tuple[int, int]]

    def passes(self, other: "Part") -> Iterator[tuple[str, str]]:
        """Pairs of a link of this part and one of another that the file lets pass through each other."""
        for (own, (kind, reach)), (their, (kind2, reach2)) in product(self.masks.items(), other.masks.items()):
            if not (kind & reach2 or kind2 & reach):
                yield own, their


@dataclass
class LinkGroup:
    """Links that stay together: those below ``tops``, and the link that they hang on where it ``holds`` them."""

    tops: list[str]
    holds: bool = False
    links: set[str] = field(default_factory=set)


def parts_of(converted: Converted) -> tuple[Part, ...]:
    """The parts of a scene, in the order of its links; none of a single object, of what neither moves nor is free, and
    of what is not one tree, of which reading says what is wrong.

    Cut is at the world, or at the first link with a shape or with several links on it. What floats is a part wherever
    it hangs. On a root that is not the world, links without joints of their own stay with it where it has a shape or
    joints: they are its handles and walls. Joints that follow one another stay together.
    """
    scene = _Scene.of(converted)
    groups = [] if scene is None else scene.groups()
    if scene is None or len(groups) < 2:
        return ()
    if not scene.free and all(joint.type == "fixed" for joint in scene.tree):
        return ()
    order = [str(link.get("name")) for link in converted.robot.findall("link")]
    parts = (scene.part(group) for group in groups)
    return tuple(sorted(parts, key=lambda part: min(map(order.index, part.links & {*order}))))


def passing(parts: Sequence[Part]) -> list[tuple[str, str]]:
    """Pairs of links of different parts that the file lets pass through each other."""
    return [pair for one, other in combinations(parts, 2) for pair in one.passes(other)]


def cut_out(converted: Converted, part: Part) -> Element:
    """The URDF of one part of a scene, its root upright."""
    robot = deepcopy(converted.robot)
    for element in robot.iterchildren(etree.Element):
        apart = element.tag == "disable_collisions" and part.links >= {element.get("link1"), element.get("link2")}
        if (element.tag not in KEPT and not apart) or (element.tag == "link" and element.get("name") not in part.links):
            robot.remove(element)
    hung = []
    for joint in robot.findall("joint"):
        parent, child = (str(end.get("link")) for tag in ("parent", "child") for end in joint.findall(tag))
        if child not in part.links or child == part.root:
            robot.remove(joint)
        elif parent not in part.links:
            hung.append(joint)
    if hung:
        robot.insert(0, etree.Element("link", name=part.root))
        start = element_joint(hung[0]).child_to_parent[:3, 3]
        for joint in hung:
            for end in joint.findall("parent"):
                end.set("link", part.root)
            origin = joint.find("origin")
            origin = add_child(joint, "origin") if origin is None else origin
            origin.set("xyz", short_numbers(element_joint(joint).child_to_parent[:3, 3] - start))
    robot.set("name", part.name)
    turn = Rotation.from_matrix(part.tilt)
    if turn.magnitude() > UPRIGHT_RAD:
        turn_root(robot, part.root, turn)
    return robot


@dataclass(frozen=True, eq=False)
class _Scene:
    """A tree of links, parents first, ``shaped`` those with a shape, ``free`` those that float; ``hub`` is the link on
    which the parts hang."""

    tree: tuple[TreeJoint, ...]
    root: str
    hub: str
    is_world: bool
    shaped: Collection[str]
    free: Collection[str]
    mimics: tuple[tuple[str, str], ...]
    masks: Mapping[str, tuple[int, int]]

    @classmethod
    def of(cls, converted: Converted) -> "_Scene | None":
        """The scene that a URDF describes; None where it is no tree."""
        robot = converted.robot
        strip_namespace(robot)
        without_commas(robot)
        links = {str(link.get("name")): link for link in robot.findall("link")}
        try:
            joints = parents_first([element_joint(joint) for joint in robot.findall("joint")])
        except ValueError:
            return None
        roots = links.keys() - {joint.child for joint in joints}
        known = {name for joint in joints for name in (joint.parent, joint.child)}
        if len(roots) != 1 or len(joints) != len(links) - 1 or not known <= links.keys():
            return None
        shaped = {name for name, link in links.items() if {"visual", "collision"} & {str(item.tag) for item in link}}
        free = {joint.child for joint in joints if joint.type == "floating"} | {*converted.free}
        tree = tuple(replace(joint, type="fixed") if joint.child in free else joint for joint in joints)
        mimics = tuple(
            (str(joint.find("child").get("link")), str(mimic.get("joint")))  # type: ignore[union-attr]
            for joint in robot.findall("joint")
            for mimic in joint.findall("mimic")
        )
        root = hub = roots.pop()
        while hub not in shaped:
            held = [joint for joint in tree if joint.parent == hub and joint.child not in free]
            if len(held) != 1 or held[0].type != "fixed":
                break
            hub = held[0].child
        return cls(tree, root, hub, hub in (converted.world, WORLD), shaped, free, mimics, converted.masks)

    def below(self, link: str) -> set[str]:
        """The link and all that hangs on it, without what floats."""
        found = {link}
        for joint in self.tree:
            if joint.parent in found and joint.child not in self.free:
                found.add(joint.child)
        return found

    def groups(self) -> list[LinkGroup]:
        """The links that stay together, those without any shape left out."""
        held = [joint for joint in self.tree if joint.parent == self.hub and joint.child not in self.free]
        movers = [joint.child for joint in held if joint.type != "fixed"]
        solid = self.hub in self.shaped
        gathers = solid or (bool(movers) and not self.is_world)
        moved = {joint.child for joint in self.tree if joint.type != "fixed"}
        own = LinkGroup([], True, {self.hub})
        found = [own] if gathers else []
        for joint in held:
            links = self.below(joint.child)
            stays = joint.type != "fixed" or not (self.is_world or links & moved)
            if gathers and stays:
                own.tops.append(joint.child)
                own.links |= links
            else:
                found.append(LinkGroup([joint.child], False, links))
        found += [LinkGroup([name], False, self.below(name)) for name in self.free]
        children = {joint.name: joint.child for joint in self.tree}
        for follower, leader in self.mimics:
            found = merged(found, {follower, children.get(leader, follower)})
        return [group for group in found if group.links & {*self.shaped}]

    def part(self, group: LinkGroup) -> Part:
        """The part that a group of links is."""
        poses = link_to_root(self.tree, self.root, {})
        by_child = {joint.child: joint for joint in self.tree}
        first = self.hub if group.holds else group.tops[0]
        stands = group.holds or (len(group.tops) == 1 and by_child[first].type == "fixed")
        root, pose = first, poses[first].copy()
        if not stands:
            root = unused(f"{first}_base", {*poses})
            pose = poses[self.hub].copy()
            pose[:3, 3] = (pose @ by_child[first].child_to_parent)[:3, 3]
        free = group.tops == [first] and first in self.free
        yaw, tilt = about_z(pose[:3, :3])
        pose[:3, :3] = yaw
        masks = {name: bits for name, bits in self.masks.items() if name in group.links}
        return Part(first, root, frozenset(group.links | {root}), free, pose, tilt, masks)


def merged(groups: list[LinkGroup], links: Collection[str]) -> list[LinkGroup]:
    """The groups, those that have one of the links as one."""
    touched = [group for group in groups if group.links & {*links}]
    if len(touched) < 2:
        return groups
    one = LinkGroup(
        [top for group in touched for top in group.tops],
        any(group.holds for group in touched),
        {link for group in touched for link in group.links},
    )
    return [one if group is touched[0] else group for group in groups if group not in touched[1:]]


def about_z(rotation: Array) -> tuple[Array, Array]:
    """A (3, 3) rotation as a turn about the upright axis after a tilt."""
    _, _, z, w = Rotation.from_matrix(rotation).as_quat()
    turn = Rotation.from_quat([0.0, 0.0, z, w]) if np.hypot(z, w) > UPRIGHT_RAD else Rotation.identity()
    return turn.as_matrix(), (turn.inv() * Rotation.from_matrix(rotation)).as_matrix()
