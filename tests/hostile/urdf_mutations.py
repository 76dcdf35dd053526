"""Mutations of a URDF: numbers, attributes, elements, structure, references, and the bytes of the file itself."""

import copy
from collections.abc import Callable
from random import Random

from lxml import etree
from lxml.etree import _Element as Element

from tests.hostile.byte_mutations import bombed, cut, encoded, flipped, replaced, spliced
from tests.hostile.mutation_values import FILES, NAMES, NUMBERS, SCALES, TAGS, TYPES

TreeMutation = Callable[[Element, Random], None]
ByteMutation = Callable[[bytes, Random], bytes]


def elements(robot: Element, *tags: str) -> list[Element]:
    """The document's elements of these tags, of all without any, the root left out."""
    return [item for item in robot.iter(*(tags or (etree.Element,))) if item is not robot]


def one(robot: Element, rng: Random, *tags: str) -> Element:
    """One element of these tags, made in a random place where there is none."""
    found = elements(robot, *tags)
    if not found and tags:
        places = elements(robot, "link", "joint") or [robot]
        return etree.SubElement(rng.choice(places), rng.choice(tags))
    return rng.choice(found or [robot])


def number(robot: Element, rng: Random) -> None:
    """Replace a number, or one of several in an attribute."""
    holders = [(item, key) for item in elements(robot) for key, text in item.attrib.items() if is_numeric(str(text))]
    if not holders:
        return
    item, key = rng.choice(holders)
    words = str(item.get(key)).split() or [""]
    words[rng.randrange(len(words))] = rng.choice(NUMBERS)
    item.set(key, " ".join(words))


def is_numeric(text: str) -> bool:
    """Whether a text is one number or several."""
    try:
        return bool([float(word) for word in text.split()])
    except ValueError:
        return False


def attribute_removed(robot: Element, rng: Random) -> None:
    """Remove an attribute."""
    item = one(robot, rng)
    if item.attrib:
        del item.attrib[rng.choice(list(item.attrib))]


def attribute_renamed(robot: Element, rng: Random) -> None:
    """Rename an attribute."""
    item = one(robot, rng)
    if item.attrib:
        key = rng.choice([str(key) for key in item.attrib])
        item.set(rng.choice(("Name", "value", "xyz", "link", "size", f"{key}_")), item.attrib.pop(key))


def element_removed(robot: Element, rng: Random) -> None:
    """Remove an element with all in it."""
    item = one(robot, rng)
    parent = item.getparent()
    if parent is not None:
        parent.remove(item)


def element_repeated(robot: Element, rng: Random) -> None:
    """Repeat an element, at times a thousand times."""
    item = one(robot, rng)
    for _ in range(rng.choice((1, 1, 1, 2, 1000)) if len(item) < 5 else 1):
        item.addnext(copy.deepcopy(item)) if item.getparent() is not None else None


def element_renamed(robot: Element, rng: Random) -> None:
    """Give an element another tag."""
    one(robot, rng).tag = rng.choice(TAGS)


def element_moved(robot: Element, rng: Random) -> None:
    """Move an element below another that is not in it."""
    item, place = one(robot, rng), one(robot, rng)
    if item is not robot and item not in (place, *place.iterancestors()):
        place.append(item)


def element_added(robot: Element, rng: Random) -> None:
    """Add an element with numbers that may make no sense."""
    item = etree.SubElement(one(robot, rng), rng.choice(TAGS))
    for key in rng.sample(("xyz", "rpy", "value", "ixx", "lower", "upper", "damping", "size", "radius", "filename"), 3):
        item.set(key, rng.choice(NUMBERS))


def renamed(robot: Element, rng: Random) -> None:
    """Give a link or a joint another name, in a third of cases everywhere."""
    item = one(robot, rng, "link", "joint")
    old, new = item.get("name"), rng.choice(NAMES)
    item.set("name", new)
    if rng.random() < 1 / 3:
        for end in robot.iter("parent", "child"):
            if end.get("link") == old:
                end.set("link", new)


def twin_names(robot: Element, rng: Random) -> None:
    """Give two links or two joints the same name."""
    found = elements(robot, rng.choice(("link", "joint")))
    if len(found) > 1:
        first, second = rng.sample(found, 2)
        second.set("name", str(first.get("name")))


def reparented(robot: Element, rng: Random) -> None:
    """Hang a joint from another link, or another link from it: cycles, several roots, strangers, itself."""
    names = [str(link.get("name")) for link in elements(robot, "link")] + ["ghost", ""]
    one(robot, rng, "parent", "child").set("link", rng.choice(names))


def joint_type(robot: Element, rng: Random) -> None:
    """Another joint type."""
    one(robot, rng, "joint").set("type", rng.choice(TYPES))


def axis_and_limits(robot: Element, rng: Random) -> None:
    """An axis without direction, limits the wrong way round, equal, huge or in degrees."""
    joint = one(robot, rng, "joint")
    for tag in ("axis", "limit"):
        if joint.find(tag) is None:
            etree.SubElement(joint, tag)
    axis, limit = joint.find("axis"), joint.find("limit")
    if axis is None or limit is None:
        return
    if rng.random() < 0.5:
        axis.set("xyz", rng.choice(("0 0 0", "1e-30 0 0", "1e30 0 0", "1 1", "", "1 0 0 0", "-0 -0 -0", "nan 0 0")))
    else:
        pairs = (("1", "-1"), ("0", "0"), ("-1e30", "1e30"), ("0", "90"), ("", "1"), ("nan", "1"), ("1e-300", "1e-299"))
        lower, upper = rng.choice(pairs)
        limit.set("lower", lower)
        limit.set("upper", upper)


def mimic(robot: Element, rng: Random) -> None:
    """Joints that follow others, themselves, a joint that is missing, or each other in a circle."""
    names = [str(joint.get("name")) for joint in elements(robot, "joint")] + ["ghost", ""]
    for joint in rng.sample(elements(robot, "joint"), min(len(names) - 2, rng.choice((1, 2, 3)))):
        follower = etree.SubElement(joint, "mimic", joint=rng.choice(names))
        follower.set("multiplier", rng.choice(("1", "-2", *NUMBERS)))
        follower.set("offset", rng.choice(("0", "0.1", *NUMBERS)))


def dynamics(robot: Element, rng: Random) -> None:
    """Joint terms that make no sense."""
    item = one(robot, rng, "dynamics")
    for key in ("damping", "friction", "spring_stiffness", "spring_reference", "armature"):
        item.set(key, rng.choice(NUMBERS))


def inertial(robot: Element, rng: Random) -> None:
    """A mass and an inertia that make no sense."""
    item = etree.SubElement(one(robot, rng, "link"), "inertial")
    etree.SubElement(item, "origin", xyz=f"0 0 {rng.choice(NUMBERS)}", rpy=rng.choice(("0 0 0", "1 1", "nan 0 0")))
    etree.SubElement(item, "mass", value=rng.choice(NUMBERS))
    tensor = etree.SubElement(item, "inertia")
    for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
        if rng.random() < 0.8:
            tensor.set(key, rng.choice(("1", "0.1", *NUMBERS)))


def shape(robot: Element, rng: Random) -> None:
    """A shape of another kind, size or number."""
    geometry = one(robot, rng, "geometry")
    if rng.random() < 0.5:
        for old in list(geometry):
            geometry.remove(old)
    item = etree.SubElement(geometry, rng.choice(("box", "sphere", "cylinder", "capsule", "mesh", "plane", "torus")))
    for key, text in (("size", "1 1 1"), ("radius", "1"), ("length", "1"), ("filename", "gone.obj")):
        if rng.random() < 0.7:
            item.set(key, rng.choice((text, *NUMBERS)))


def material(robot: Element, rng: Random) -> None:
    """Colours and pictures that are none."""
    item = one(robot, rng, "material")
    etree.SubElement(
        item, "color", rgba=rng.choice(("1 0 0", "nan 0 0 1", "1e30 0 0 1", "", "a b c d", "2 2 2 2", "1"))
    )
    etree.SubElement(item, "texture", filename=rng.choice(FILES))


def mesh_scale(robot: Element, rng: Random) -> None:
    """A scale of a mesh that leaves nothing of it, mirrors it or is none."""
    one(robot, rng, "mesh").set("scale", rng.choice(SCALES))


def mesh_file(robot: Element, rng: Random) -> None:
    """A mesh that is outside, no mesh, or not there."""
    one(robot, rng, "mesh").set("filename", rng.choice(FILES))


def nested(robot: Element, rng: Random) -> None:
    """An element deep within others."""
    item = one(robot, rng)
    parent = item.getparent()
    if parent is None:
        return
    place = etree.SubElement(parent, "link")
    for _ in range(rng.choice((1, 10, 200, 300, 3000))):
        place = etree.SubElement(place, rng.choice(("link", "geometry", "robot")))
    place.append(item)


def chained(robot: Element, rng: Random) -> None:
    """A chain of many links, deeper than a stack of calls."""
    names = [str(link.get("name")) for link in elements(robot, "link")] or ["base"]
    before = rng.choice(names)
    for place in range(rng.choice((3, 30, 300, 1200))):
        link = etree.SubElement(robot, "link", name=f"chain_{place}")
        if rng.random() < 0.1:
            box = etree.SubElement(etree.SubElement(link, "visual"), "geometry")
            etree.SubElement(box, "box", size="0.1 0.1 0.1")
        kind = rng.choice(("fixed", "fixed", "continuous"))
        joint = etree.SubElement(robot, "joint", name=f"chain_joint_{place}", type=kind)
        etree.SubElement(joint, "parent", link=before)
        etree.SubElement(joint, "child", link=f"chain_{place}")
        before = f"chain_{place}"


def emptied(robot: Element, rng: Random) -> None:
    """A document without links, joints, or either."""
    for tag in rng.choice((("link",), ("joint",), ("link", "joint"), ("visual", "collision"))):
        for item in elements(robot, tag):
            parent = item.getparent()
            if parent is not None:
                parent.remove(item)


TREE: tuple[TreeMutation, ...] = (
    *(number, number, number, number, attribute_removed, attribute_renamed, element_removed, element_repeated),
    *(element_renamed, element_moved, element_added, renamed, twin_names, reparented, joint_type, mimic),
    *(axis_and_limits, dynamics, inertial, shape, material, mesh_scale, mesh_scale, mesh_file, mesh_file),
    *(nested, chained, emptied),
)  # fmt: skip
BYTES: tuple[ByteMutation, ...] = (cut, flipped, spliced, encoded, bombed, replaced)
BYTE_SHARE = 0.15
"""Share of mutants whose bytes are changed as well."""


def mutant(document: bytes, rng: Random) -> tuple[bytes, tuple[str, ...]]:
    """A mutated URDF, and the names of one to three mutations that it has."""
    robot = etree.fromstring(document)
    chosen = rng.choices(TREE, k=rng.choice((1, 1, 2, 3)))
    for change in chosen:
        change(robot, rng)
    changed = etree.tostring(robot, xml_declaration=True, encoding="utf-8")
    names = [change.__name__ for change in chosen]
    if rng.random() < BYTE_SHARE:
        last = rng.choice(BYTES)
        changed, names = last(changed, rng), [*names, last.__name__]
    return changed, tuple(names)
