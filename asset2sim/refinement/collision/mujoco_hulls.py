"""Distances of single convex hulls in MuJoCo, a geom each, where PyBullet is not installed."""

import mujoco
import numpy as np

from asset2sim.engines.static_object import MARGIN_M
from asset2sim.physics.arrays import Array
from asset2sim.refinement.collision.hull_world import HullWorld
from asset2sim.refinement.collision.trim import Key, Trimmer

TOUCHING_M = 1e-9
"""Distance below which two hulls touch, m: what leads from one to the other has no direction then."""


class MuJoCoHulls(HullWorld):
    """``HullWorld`` in one model of all hulls, compiled again once one of them was cut: 0.14 ms a hull. MuJoCo has no
    margins; PyBullet's are counted, so that what is cut here lies apart in either engine."""

    def __init__(self, trimmer: Trimmer) -> None:
        super().__init__(trimmer)
        self.points: dict[Key, Array] = {}
        self.index: dict[Key, int] = {}
        self.model: mujoco.MjModel = None
        self.data: mujoco.MjData = None

    def closest(self, a: Key, b: Key, pose_a: Array, pose_b: Array, reach: float = 0.0) -> tuple[float, Array] | None:
        """See ``HullWorld``."""
        if any(self.points.get(key) is not self.trimmer.hull(key) for key in (a, b)):
            self._compile()
        first, second = self._placed(a, pose_a), self._placed(b, pose_b)
        ends = np.zeros(6)
        most = reach + 2.0 * MARGIN_M
        gap = mujoco.mj_geomDistance(self.model, self.data, first, second, most, ends)
        if gap >= most:
            return None
        way: Array = ends[:3] - ends[3:]
        sign = float(np.sign(gap))
        if abs(gap) < TOUCHING_M:
            way, sign = self.data.geom_xpos[first] - self.data.geom_xpos[second], 1.0
        return float(gap) - 2.0 * MARGIN_M, way / (np.linalg.norm(way) * sign)

    def _compile(self) -> None:
        spec = mujoco.MjSpec()
        spec.compiler.usethread = False
        self.points = {
            (link, i): points for link, pieces in self.trimmer.hulls.items() for i, points in enumerate(pieces)
        }
        self.index = {key: number for number, key in enumerate(self.points)}
        for key, number in self.index.items():
            # Of its surface: a hull may be too thin for a volume.
            mesh = spec.add_mesh(name=str(number), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
            mesh.uservert = self.points[key].ravel().tolist()
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=str(number))
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)

    def _placed(self, key: Key, pose: Array) -> int:
        """Number of a hull's geom, moved to the pose of its link: the geom's own frame is the mesh's principal one."""
        number, turn = self.index[key], np.zeros(9)
        mujoco.mju_quat2Mat(turn, self.model.geom_quat[number])
        self.data.geom_xpos[number] = pose[:3, :3] @ self.model.geom_pos[number] + pose[:3, 3]
        self.data.geom_xmat[number] = (pose[:3, :3] @ turn.reshape(3, 3)).ravel()
        return number
