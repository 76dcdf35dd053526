"""Capsules, which some URDFs have: read as they are, written as a cylinder and two balls, which every loader knows."""

import copy

import yourdfpy
from lxml import etree
from lxml.etree import _Element as Element
from scipy.spatial.transform import Rotation


class Capsule(yourdfpy.Cylinder):  # type: ignore[misc]
    """A cylinder with round caps along z: ``radius``, and ``length`` between the caps' centres, m."""


def read_capsules(robot: Element, model: yourdfpy.Robot) -> None:
    """Make those cylinders of the model capsules that are capsules in the document, whose links are in the same order.
    yourdfpy knows none, and is given cylinders."""
    for element, link in zip(robot.findall("link"), model.links, strict=True):
        for tag, shapes in (("visual", link.visuals), ("collision", link.collisions)):
            for item, shape in zip(element.findall(tag), shapes, strict=True):
                if item.find("geometry/capsule") is not None:
                    cylinder = shape.geometry.cylinder
                    shape.geometry.cylinder = Capsule(radius=cylinder.radius, length=cylinder.length)


def as_cylinders(robot: Element) -> Element:
    """The document, or a copy with cylinders where it has capsules."""
    if next(robot.iter("capsule"), None) is None:
        return robot
    plain = copy.deepcopy(robot)
    for element in plain.iter("capsule"):
        element.tag = "cylinder"
    return plain


def split_capsules(link: Element) -> None:
    """Write each capsule among a link's visuals and collisions as a cylinder and two balls."""
    for item in [*link.findall("visual"), *link.findall("collision")]:
        capsule = item.find("geometry/capsule")
        if capsule is None:
            continue
        radius, half = str(capsule.get("radius")), float(str(capsule.get("length"))) / 2.0
        origin = item.find("origin")
        place, angles = (
            [float(word) for word in str("0 0 0" if origin is None else origin.get(key) or "0 0 0").split()]
            for key in ("xyz", "rpy")
        )
        along = Rotation.from_euler("xyz", angles).apply([0.0, 0.0, half])
        for sign in (-1.0, 1.0):
            ball = copy.deepcopy(item)
            ball.attrib.pop("name", "")
            replace_geometry(ball, etree.Element("sphere", radius=radius))
            for old in ball.findall("origin"):
                ball.remove(old)
            xyz = " ".join(f"{float(value):.9g}" for value in place + sign * along)
            ball.insert(0, etree.Element("origin", xyz=xyz))
            item.addnext(ball)
        replace_geometry(item, etree.Element("cylinder", radius=radius, length=str(capsule.get("length"))))


def replace_geometry(item: Element, shape: Element) -> None:
    """Give a visual or collision this shape alone."""
    geometry = item.find("geometry")
    assert geometry is not None
    for old in list(geometry):
        geometry.remove(old)
    geometry.append(shape)
