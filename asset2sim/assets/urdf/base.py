"""A fixed object's URDF hung from a link ``world``, for readers that know no other way to hold a root."""

from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.edit import serialised

WORLD = "world"
"""The link's name that Drake, Gazebo and ROS take for the world."""
JOINT = "world_to_base"


def hung_from_world(document: bytes, height_m: float) -> bytes:
    """The document with its root link hung from a link ``world`` by a fixed joint, its root's origin ``height_m`` above
    the world's; unchanged where its root is called so already."""
    robot = etree.fromstring(document)
    links = [str(link.get("name")) for link in robot.findall("link")]
    children = {str(child.get("link")) for child in robot.iterfind("joint/child")}
    root = next(name for name in links if name not in children)
    if root == WORLD:
        return document
    joint = etree.Element("joint", name=free_name(robot), type="fixed")
    etree.SubElement(joint, "origin", xyz=f"0 0 {height_m!r}", rpy="0 0 0")
    etree.SubElement(joint, "parent", link=WORLD)
    etree.SubElement(joint, "child", link=root)
    first = robot.index(next(robot.iterchildren("link")))
    robot.insert(first, joint)
    robot.insert(first, etree.Element("link", name=WORLD))
    etree.indent(robot, space="  ")
    return serialised(robot)


def taken_from_world(document: bytes, root: str) -> bytes:
    """The document as it was before ``hung_from_world``, of an object whose own root is this link."""
    robot = etree.fromstring(document)
    for joint in robot.findall(f"joint/child[@link='{root}']/.."):
        robot.remove(joint)
        for link in robot.findall(f"link[@name='{WORLD}']"):
            robot.remove(link)
    return serialised(robot)


def free_name(robot: Element) -> str:
    """A name for the joint that no other has."""
    taken, name = {joint.get("name") for joint in robot.findall("joint")}, JOINT
    while name in taken:
        name += "_"
    return name
