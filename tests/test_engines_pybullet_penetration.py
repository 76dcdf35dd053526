"""Φ in PyBullet at many positions of one loaded object."""

from pathlib import Path

import numpy as np
import pytest

from asset2sim.engines.contacts import penetration
from asset2sim.engines.pybullet_object import contact_points, contacts_at, static_object
from schemas.settings import EngineSettings
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, box, write_urdf

pytestmark = pytest.mark.system

SETTINGS = EngineSettings()


def siblings(folder: Path) -> Path:
    """Two boxes of 0.1 m on one root that overlap by 10 mm along x with ``slide`` at zero."""
    shape = ((box(0.1, 0.1, 0.1), ORIGIN),)
    links = [UrdfLink("root"), UrdfLink("left", shapes=shape), UrdfLink("right", shapes=shape)]
    joints = [
        UrdfJoint("glue", "fixed", "root", "left"),
        UrdfJoint("slide", "prismatic", "root", "right", axis=(1.0, 0.0, 0.0), xyz=(0.09, 0.0, 0.0)),
    ]
    return write_urdf(folder, links, joints)


def test_phi_of_two_overlapping_boxes_is_their_depth_at_every_contact_point(tmp_path: Path) -> None:
    points = contacts_at(siblings(tmp_path), {}, SETTINGS)
    assert points and {frozenset((point.link_a, point.link_b)) for point in points} == {frozenset(("left", "right"))}
    np.testing.assert_allclose([point.separation_m for point in points], -0.01, atol=1e-6)
    assert penetration(points) == pytest.approx(0.01 * len(points))


def test_phi_follows_the_joint_and_is_zero_once_apart(tmp_path: Path) -> None:
    with static_object(siblings(tmp_path), SETTINGS) as item:
        phis = [penetration(contact_points(item, {"slide": q})) for q in (-0.01, 0.0, 0.005, 0.02)]
    assert phis[0] > phis[1] > phis[2] > 0.0 and phis[3] == 0.0
