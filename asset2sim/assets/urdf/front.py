"""Which way an object faces."""

from pathlib import Path

import numpy as np
import yourdfpy

from asset2sim.assets.urdf.read import root_of
from asset2sim.physics.arrays import Array

Y_UP_TO_Z_UP = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The rotation of PartNet-Mobility's fixed root joint: its objects are authored y-up and facing +z."""


def front_of(robot: yourdfpy.Robot, urdf_file: Path) -> Array:
    """(3,) the horizontal direction in the root frame that the object's front faces. PartNet-Mobility's objects face -x
    once its root joint has turned them z-up; an object is taken for one of them by that joint, by its robot's name or
    by the ``semantics.txt`` beside it. Others follow the ROS custom: x forward."""
    root = root_of(robot)
    turned = any(
        joint.parent == root
        and joint.type == "fixed"
        and joint.origin is not None
        and np.allclose(np.asarray(joint.origin)[:3, :3], Y_UP_TO_Z_UP, atol=1e-3)
        for joint in robot.joints
    )
    named = (robot.name or "").startswith("partnet_") or (urdf_file.parent / "semantics.txt").is_file()
    return np.array([-1.0 if turned or named else 1.0, 0.0, 0.0])
