"""A fixed object's URDF hung from a link ``world``, for readers that know no other way to hold a root; free names."""

from lxml import etree

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
    taken = {str(joint.get("name")) for joint in robot.findall("joint")}
    joint = etree.Element("joint", name=unused(JOINT, taken), type="fixed")
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


def unused(name: str, taken: set[str]) -> str:
    """The name, with underscores after it where it is taken; it is taken from now on."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name
