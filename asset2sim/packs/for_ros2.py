"""Pack for ROS 2: an ament package with a URDF an object whose meshes are ``package://`` URIs, and Gazebo's models."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lxml import etree

from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.base import hung_from_world
from asset2sim.assets.urdf.edit import serialised
from asset2sim.packs.declared_pack import OBJECTS, Pack, PackedObject
from schemas.vocabulary import Export

PACKAGE, ROS_URDF = "refined_objects", "ros.urdf"


def write_urdfs(target: Path, objects: Sequence[PackedObject], given: Mapping[str, Any]) -> None:
    """Write ``ros.urdf`` beside each object's own: with package URIs, and hung from a link ``world`` where it is
    fixed, which ROS has no other word for."""
    for item in objects:
        document = (item.folder / URDF_NAME).read_bytes()
        robot = etree.fromstring(hung_from_world(document, item.stand_m) if item.fixed else document)
        for element in robot.iter("mesh", "texture"):
            element.set("filename", f"package://{PACKAGE}/{OBJECTS}/{item.name}/{element.get('filename')}")
        (item.folder / ROS_URDF).write_bytes(serialised(robot))


PACKS = (
    Pack(
        name="ros2",
        title="ROS 2",
        contents="An ament package: `ros.urdf` of each object for `robot_state_publisher`, a launch file that shows "
        "one in RViz, and a Gazebo model each, which Gazebo finds once the workspace is sourced. Name it as you like "
        "in `package.xml`, and state who maintains it.",
        opens="colcon build && . install/setup.sh && ros2 launch refined_objects view.launch.py object:=NAME",
        exports=(Export.SDF,),
        finish=write_urdfs,
    ),
)
