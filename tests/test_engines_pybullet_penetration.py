"""Φ in PyBullet at many positions of one loaded object."""

from pathlib import Path

import numpy as np
import pytest

from asset2sim.checks import rest
from asset2sim.engines.contacts import penetration
from asset2sim.engines.static_object import contact_points, contacts_at, static_object
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine
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


def glued(folder: Path, kind: str, count: int = 2) -> Path:
    """A root with ``count`` boxes of 0.1 m in a row, each 10 mm into the next, on joints of one kind along x."""
    folder.mkdir()
    shape = ((box(0.1, 0.1, 0.1), ORIGIN),)
    names = [f"box{n}" for n in range(count)]
    links = [UrdfLink("root"), *(UrdfLink(name, shapes=shape) for name in names)]
    places = [(0.09 * n, 0.0, 0.2) for n in range(count)]
    joints = [
        UrdfJoint(f"on_{name}", kind, "root", name, axis=(1.0, 0.0, 0.0), xyz=place)
        for n, (name, place) in enumerate(zip(names, places, strict=True))
    ]
    file = write_urdf(folder, links, joints)
    file.write_text(file.read_text().replace("><", ">\n<"))  # PyBullet breaks long lines
    return file


def phi_in(engine: Engine, urdf: Path) -> float:
    """Φ in one engine with all joints at zero, m."""
    return penetration(rest.contacts_at(engine, urdf, {}, SETTINGS))


@pytest.mark.parametrize("engine", ["pybullet", "mujoco", "sapien"])
@pytest.mark.parametrize("count", [2, 40])
def test_links_that_fixed_joints_hold_at_their_places_do_not_penetrate(engine: str, count: int, tmp_path: Path) -> None:
    """Of PhysX' 30 bits of filters, 40 links take two."""
    apart = phi_in(Engine(engine), glued(tmp_path / "slides", "prismatic"))
    assert apart > 0.009, "what a joint can move apart counts"
    assert phi_in(Engine(engine), glued(tmp_path / "glued", "fixed", count)) == 0.0
