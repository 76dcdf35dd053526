"""How much it takes to topple an object: the least rise of its centre of mass over an edge of what it stands on."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from lxml import etree
from scipy.spatial import ConvexHull, QhullError

from asset2sim.interaction.mechanism import Mechanism, collision_points, poses_at
from asset2sim.physics.arrays import Array

STANDING_M = 3e-3
"""Height over the lowest point within which points stand on the floor, m: engines' margins, and uneven feet."""


def tipping(urdf: Path, item: Mechanism, up: Array, positions: Mapping[str, float]) -> tuple[float, float]:
    """What tips the object over, at rest with (3,) ``up`` in the root's frame: the least rise of its centre of mass,
    m, and the longest way from under it to an edge of its support, m.

    Over an edge at distance d from under the centre of mass, which is h high, it rises by √(d² + h²) − h. The rise is 0
    where the object stands on less than a triangle, or leans over an edge already.
    """
    poses = poses_at(item, positions)
    links = {str(element.get("name")): element for element in etree.parse(str(urdf)).getroot().findall("link")}
    clouds = [
        points @ poses[name][:3, :3].T + poses[name][:3, 3]
        for name, element in links.items()
        if name in poses and len(points := collision_points(element, urdf.parent))
    ]
    mass = sum(body.mass for body in item.bodies.values())
    if not clouds or mass <= 0.0:
        return 0.0, 0.0
    center = sum(body.mass * (poses[n][:3, :3] @ body.com + poses[n][:3, 3]) for n, body in item.bodies.items()) / mass
    return rise(np.vstack(clouds), np.asarray(center), up)


def rise(points: Array, center: Array, up: Array) -> tuple[float, float]:
    """The same of (n, 3) points and a (3,) centre of mass."""
    heights = points @ up
    floor = float(heights.min())
    across = np.linalg.svd(up[None, :])[2][1:]
    feet, under = points[heights <= floor + STANDING_M] @ across.T, center @ across.T
    try:
        edges = ConvexHull(feet).equations
    except (QhullError, ValueError):
        return 0.0, 0.0
    distances = -(edges[:, :2] @ under + edges[:, 2])
    height = float(center @ up) - floor
    nearest = max(float(distances.min()), 0.0)
    return float(np.hypot(nearest, height) - height), max(float(distances.max()), 0.0)
