"""Support polygon: an object's centre of mass over the edges of its feet, and what it takes to tip it over."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.convex_hull import convex_hull
from asset2sim.physics.grip import box_middle
from asset2sim.physics.mass_matrix import GRAVITY_M_S2

DOWNWARD = 0.5
"""Share of a press that goes down from which the table or floor takes it: no hand holds the object against it."""
STANDING_M = 3e-3
"""Height over the lowest point within which points stand on the floor, m: engines' margins, and uneven feet."""
LEANING_RAD = math.radians(5.0)
"""How far an object leans at most until it stands on more of its feet; beyond, it tips over (``Thresholds``)."""


@dataclass(frozen=True)
class SupportPolygon:
    """An object at rest, in the root's frame: (3,) world ``up``, its mass (kg) and (3,) centre of mass, the ``floor``
    (m along ``up``), and the edges of what it stands on: (k, 3) outward ``normals`` along the floor and ``offsets``
    (k,), normal · x + offset being the distance (m) of a point beyond the edge. No edge where it stands on less than a
    triangle."""

    up: Array
    mass: float
    center: Array
    floor: float
    normals: Array
    offsets: Array

    @property
    def height(self) -> float:
        """Height of the centre of mass over the floor, m."""
        return float(self.center @ self.up) - self.floor

    @property
    def inside(self) -> Array:
        """(k,) distance of the centre of mass within each edge, m; negative beyond it."""
        distances: Array = -(self.normals @ self.center + self.offsets)
        return distances

    @property
    def nearest(self) -> float:
        """Distance from under the centre of mass to the nearest edge, m; 0 beyond one, or where there is none."""
        return max(float(self.inside.min()), 0.0) if len(self.offsets) else 0.0

    @property
    def furthest(self) -> float:
        """Distance from under the centre of mass to the furthest edge, m."""
        return max(float(self.inside.max()), 0.0) if len(self.offsets) else 0.0

    @property
    def rise(self) -> float:
        """The least rise of the centre of mass that topples the object, m: √(d² + h²) − h over an edge at distance d
        from under the centre of mass, which is h high."""
        return float(np.hypot(self.nearest, self.height) - self.height)

    @property
    def margin_rad(self) -> float:
        """The angle by which the object is turned about its nearest edge when it tips over, rad."""
        return math.atan2(self.nearest, max(self.height, 0.0))

    def tips_at(self, point: Array, direction: Array) -> float | None:
        """The least force (N) along the unit ``direction`` at ``point`` that tips the object over an edge, both (3,) in
        the root's frame; None where no force does."""
        beyond, high = self.normals @ point + self.offsets, float(point @ self.up) - self.floor
        # Moments about each edge: m g d holds the object down, the force turns it over.
        levers = high * (self.normals @ direction) - beyond * float(direction @ self.up)
        turning = levers > 0.0
        if not turning.any():
            return None
        return float(self.mass * GRAVITY_M_S2 * (np.maximum(self.inside[turning], 0.0) / levers[turning]).min())

    def slides_at(self, direction: Array, friction: float) -> float | None:
        """The least force (N) along the unit ``direction`` that slides the object on the floor, at this Coulomb
        coefficient; None where no force does."""
        lift = float(direction @ self.up)
        level = float(np.linalg.norm(direction - lift * self.up))
        pull = level + friction * lift
        return friction * self.mass * GRAVITY_M_S2 / pull if pull > 0.0 else None


def standing_on(points: Array, center: Array, mass: float, up: Array) -> SupportPolygon:
    """The support of a body of (n, 3) points with this mass (kg) and (3,) centre of mass."""
    heights = points @ up
    floor = float(heights.min())
    across = np.linalg.svd(up[None, :])[2][1:]
    feet = convex_hull(points[heights <= floor + STANDING_M] @ across.T)
    edges = np.zeros((0, 3)) if feet is None else feet.equations
    return SupportPolygon(up, mass, center, floor, edges[:, :2] @ across, edges[:, 2])


def leaning_on(points: Array, center: Array, mass: float, up: Array, most_rad: float = LEANING_RAD) -> SupportPolygon:
    """The support of a body where it comes to rest: as it is (``standing_on``), or where its centre of mass is beyond
    its feet, on the nearest side of its convex hull that bears it, within ``most_rad``, with ``up`` leaning."""
    stands = standing_on(points, center, mass, up)
    hull = convex_hull(points) if stands.nearest <= 0.0 else None
    if hull is None:
        return stands
    sides = hull.equations[:, :3]
    near = sides[sides @ up < -math.cos(most_rad)]
    for side in near[np.argsort(near @ up)]:
        leaning = standing_on(points, center, mass, -side)
        if leaning.nearest > 0.0:
            return leaning
    return stands


def floor_pushes(clouds: Mapping[str, Array], support: SupportPolygon) -> dict[str, float]:
    """Link → the push of the floor on it (N), of those whose (n, 3) points stand on it: at the middle of each, together
    level under the centre of mass, and as alike as that leaves them."""
    across = np.linalg.svd(support.up[None, :])[2][1:]
    feet = {name: cloud[cloud @ support.up <= support.floor + STANDING_M] for name, cloud in clouds.items()}
    places = {name: across @ (box_middle(low) - support.center) for name, low in feet.items() if len(low)}
    levers = np.array([[1.0, *place] for place in places.values()]).T
    pushes = np.linalg.pinv(levers) @ [support.mass * GRAVITY_M_S2, 0.0, 0.0]
    return dict(zip(places, np.maximum(pushes, 0.0).tolist(), strict=True))
