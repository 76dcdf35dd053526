"""Φ(q) in PyBullet: collision detection at given joint positions, nothing moving."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from asset2sim.engines.pybullet_object import PyBulletObject, loaded
from asset2sim.metrics.penetration import ContactPoint
from schemas.settings import EngineSettings


def contact_points(item: PyBulletObject, positions: Mapping[str, float]) -> list[ContactPoint]:
    """The object's contact points with itself at these joint positions, under PyBullet's default filter."""
    item.place(positions)
    item.client.performCollisionDetection()
    names = item.link_names
    return [
        ContactPoint(names[point[3]], names[point[4]], float(point[8]))
        for point in item.client.getContactPoints(item.body, item.body)
    ]


@contextmanager
def penetration_probe(urdf: Path, settings: EngineSettings) -> Iterator[PyBulletObject]:
    """The object held still, for ``contact_points`` at many joint positions."""
    with loaded(urdf, fixed_base=True, timestep_s=settings.timestep_s) as item:
        item.client.setGravity(0.0, 0.0, 0.0)
        yield item


def contacts_at(urdf: Path, positions: Mapping[str, float], settings: EngineSettings) -> list[ContactPoint]:
    """Contact points at one pose in a world of their own: contact caches make Φ depend a little on what came before."""
    with penetration_probe(urdf, settings) as item:
        return contact_points(item, positions)
