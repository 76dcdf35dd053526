"""The support of a written object at rest, from its collision shapes and masses."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from asset2sim.assets.urdf.collision_points import collision_points
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.checks.mechanism import Mechanism, poses_at
from asset2sim.physics.arrays import Array
from asset2sim.physics.support_polygon import SupportPolygon, standing_on

Clouds = Mapping[str, Array]
"""Link → (n, 3) points that span its collision shapes, in the link's frame, m."""


def point_clouds(urdf: Path) -> dict[str, Array]:
    """Link → (n, 3) points that span its collision shapes, in the link's frame, m; none for a link without shapes."""
    links = parsed_root(urdf).findall("link")
    clouds = {str(element.get("name")): collision_points(element, urdf.parent) for element in links}
    return {name: points for name, points in clouds.items() if len(points)}


def support_polygon_of(item: Mechanism, clouds: Clouds, up: Array, positions: Mapping[str, float]) -> SupportPolygon:
    """The support of an object at rest on a plane, (3,) ``up`` being the world's in the root's frame, joints at
    ``positions`` (rad or m)."""
    poses = poses_at(item, positions)
    points = np.vstack(
        [np.zeros((0, 3))]
        + [cloud @ poses[name][:3, :3].T + poses[name][:3, 3] for name, cloud in clouds.items() if name in poses]
    )
    mass = sum(body.mass for body in item.bodies.values())
    if not len(points) or mass <= 0.0:
        return standing_on(np.zeros((1, 3)), np.zeros(3), mass, up)
    center = sum(body.mass * (poses[n][:3, :3] @ body.com + poses[n][:3, 3]) for n, body in item.bodies.items()) / mass
    return standing_on(points, np.asarray(center), mass, up)
