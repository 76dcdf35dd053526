"""Distances of single convex hulls in PyBullet, a static body each."""

from math import sqrt

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision.hull_world import HullWorld
from asset2sim.refinement.collision.trim import Key, Trimmer


class PyBulletHulls(HullWorld):
    """``HullWorld`` in one client."""

    def __init__(self, client: BulletClient, trimmer: Trimmer) -> None:
        super().__init__(trimmer)
        self.client = client
        self.bodies: dict[Key, tuple[int, Array]] = {}
        self.places: dict[Key, Array] = {}

    def closest(self, a: Key, b: Key, pose_a: Array, pose_b: Array, reach: float = 0.0) -> tuple[float, Array] | None:
        """See ``HullWorld``."""
        points = self.client.getClosestPoints(self._placed(a, pose_a), self._placed(b, pose_b), reach)
        if not points:
            return None
        worst = min(points, key=lambda point: float(point[8]))
        return float(worst[8]), np.array(worst[7], dtype=float)

    def _placed(self, key: Key, pose: Array) -> int:
        """Body index of a hull in its present shape, moved to the pose of its link."""
        points = self.trimmer.hull(key)
        known = self.bodies.get(key)
        if known is None or known[1] is not points:
            if known is not None:
                self.client.removeBody(known[0])
                self.places.pop(key, None)
            shape = self.client.createCollisionShape(pybullet.GEOM_MESH, vertices=points.tolist())
            self.bodies[key] = known = (int(self.client.createMultiBody(0.0, shape)), points)
        if self.places.get(key) is not pose:
            self.client.resetBasePositionAndOrientation(known[0], pose[:3, 3].tolist(), quaternion(pose))
            self.places[key] = pose
        return known[0]


def quaternion(pose: Array) -> tuple[float, float, float, float]:
    """The rotation of a (4, 4) pose as x, y, z, w; SciPy's takes thirty times as long for a single one."""
    (xx, xy, xz, _), (yx, yy, yz, _), (zx, zy, zz, _), _ = pose.tolist()
    # Divided by the largest of the four, which is at least a half (Shepperd 1978).
    squares = (1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz, 1.0 + xx + yy + zz)
    most = squares.index(max(squares))
    double = sqrt(squares[most])
    ways = (
        (squares[0], yx + xy, zx + xz, zy - yz),
        (yx + xy, squares[1], zy + yz, xz - zx),
        (zx + xz, zy + yz, squares[2], yx - xy),
        (zy - yz, xz - zx, yx - xy, squares[3]),
    )
    x, y, z, w = ways[most]
    return x / (2.0 * double), y / (2.0 * double), z / (2.0 * double), w / (2.0 * double)
