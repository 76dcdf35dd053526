"""Many worlds of one model in MuJoCo Warp, on a GPU or the processor: one action of all, and what is read of them."""

from dataclasses import dataclass
from typing import cast

import mujoco
import mujoco_warp
import numpy as np
import trimesh
import warp
from numpy.typing import NDArray

from asset2sim.gym.subject import TrialSubject
from lab.learning.warp_kernels import blend, nearest, touching

CONTACTS, ROWS = 96, 512
"""Room for contacts and for rows of constraints of a world: pushes of the paper's nine have at most 14 and 46."""

LEFT_OUT = int(
    mujoco_warp.OverflowType.NEFC
    | mujoco_warp.OverflowType.NJMAX_NNZ
    | mujoco_warp.OverflowType.BROADPHASE
    | mujoco_warp.OverflowType.NARROWPHASE
)

warp.config.quiet = True


@dataclass(frozen=True, eq=False)
class Read:
    """Readings of n worlds after an action, NumPy: positions and speeds (n, nq) and (n, nv), the arm's joint axes
    and anchors (n, 7, 3), the tool's point (n, 3) and hand's axes (n, 3, 3), world; ``to_part`` (n, 3), m; ``touched``
    (n,) in the last 4 ms."""

    positions: NDArray[np.float32]
    speeds: NDArray[np.float32]
    axes: NDArray[np.float32]
    anchors: NDArray[np.float32]
    tool: NDArray[np.float32]
    hand: NDArray[np.float32]
    to_part: NDArray[np.float32]
    touched: NDArray[np.bool_]


class WarpWorlds:
    """``count`` worlds of a subject's model. ``device`` is Warp's name of one, as ``cuda:0`` or ``cpu``, or None for
    the first GPU, else the processor. An action is ``samples`` times ``steps`` time steps; on a GPU it is one captured
    graph."""

    def __init__(self, subject: TrialSubject, count: int, samples: int, steps: int, device: str | None = None) -> None:
        self.subject, self.count, self.samples, self.steps = subject, count, samples, steps
        self.device = warp.get_device(device)
        model = subject.stage.model
        self.arm = [int(model.dof_jntid[dof]) for dof in subject.arm_dofs]
        parts = part_surfaces(model, subject.part_geoms)
        sides = subject.stage.tool_geoms.astype(np.int32) + 2 * subject.stage.object_geoms.astype(np.int32)
        with warp.ScopedDevice(self.device):
            self.model = mujoco_warp.put_model(model)
            start = mujoco.MjData(model)
            mujoco.mj_forward(model, start)
            self.data = mujoco_warp.put_data(model, start, nworld=count, nconmax=CONTACTS, njmax=ROWS)
            self.before = warp.zeros((count, model.nu), dtype=float)
            self.after = warp.zeros((count, model.nu), dtype=float)
            self.bodies = warp.array(list(parts), dtype=int)
            self.meshes = [
                warp.Mesh(warp.array(part.vertices, dtype=warp.vec3), warp.array(part.faces.ravel(), dtype=int))
                for part in parts.values()
            ]
            self.surfaces = warp.array([mesh.id for mesh in self.meshes], dtype=warp.uint64)
            self.sides = warp.array(sides, dtype=int)
            self.found = warp.zeros(count, dtype=warp.vec3)
            self.touched = warp.zeros(count, dtype=int)
        self.graph = None

    def place(self, positions: NDArray[np.float32], speeds: NDArray[np.float32], commands: NDArray[np.float32]) -> None:
        """Set (n, nq) positions, (n, nv) speeds and (n, nu) commands of all worlds; what the solver remembered goes."""
        self.data.qpos.assign(positions)
        self.data.qvel.assign(speeds)
        self.data.ctrl.assign(commands)
        self.data.qacc_warmstart.zero_()

    def act(self, before: NDArray[np.float32], after: NDArray[np.float32]) -> None:
        """Do one action, in which (n, nu) commands change evenly from those before to those after."""
        self.before.assign(before)
        self.after.assign(after)
        with warp.ScopedDevice(self.device):
            if self.graph is not None:
                warp.capture_launch(self.graph)
            elif self.device.is_cuda:
                self._act()  # which compiles; capturing alone does nothing
                with warp.ScopedCapture() as captured:
                    self._act()
                self.graph = captured.graph
            else:
                self._act()

    def _act(self) -> None:
        data = self.data
        for part in range(1, self.samples + 1):
            shares = [self.before, self.after, part / self.samples, data.ctrl]
            warp.launch(blend, dim=data.ctrl.shape, inputs=shares)
            if part == self.samples:
                self.touched.zero_()
            for _ in range(self.steps):
                mujoco_warp.step(self.model, data)
                if part == self.samples:
                    self._feel()

    def _feel(self) -> None:
        contact = self.data.contact
        told = [self.data.nacon, contact.geom, contact.worldid, contact.efc_address, self.data.efc.force, self.sides]
        warp.launch(touching, dim=contact.geom.shape[0], inputs=told, outputs=[self.touched])

    def read(self) -> Read:
        """Where everything is now."""
        data = self.data
        with warp.ScopedDevice(self.device):
            mujoco_warp.kinematics(self.model, data)
            mujoco_warp.com_pos(self.model, data)
            seen = [self.subject.tool_geom, data.geom_xpos, data.xpos, data.xmat, self.bodies, self.surfaces]
            warp.launch(nearest, dim=self.count, inputs=seen, outputs=[self.found])
        return Read(
            data.qpos.numpy(), data.qvel.numpy(), data.xaxis.numpy()[:, self.arm], data.xanchor.numpy()[:, self.arm],
            data.geom_xpos.numpy()[:, self.subject.tool_geom], data.xmat.numpy()[:, self.subject.hand],
            self.found.numpy(), self.touched.numpy().astype(bool),
        )  # fmt: skip

    def overflowed(self) -> bool:
        """Whether a world has had more contacts or constraints than there is room for, so that some were left out."""
        return bool((self.data.overflow.numpy() & LEFT_OUT).any())


def part_surfaces(model: mujoco.MjModel, geoms: NDArray[np.int64]) -> dict[int, trimesh.Trimesh]:
    """Body → the surfaces of its collision shapes in its frame, m. Raises ValueError for a kind that is not ours."""
    found: dict[int, list[trimesh.Trimesh]] = {}
    for geom in map(int, geoms):
        place, turn = np.eye(4), np.zeros(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        place[:3, :3], place[:3, 3] = turn.reshape(3, 3), model.geom_pos[geom]
        found.setdefault(int(model.geom_bodyid[geom]), []).append(surface(model, geom).apply_transform(place))
    return {body: cast(trimesh.Trimesh, trimesh.util.concatenate(some)) for body, some in found.items()}


def surface(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    """The surface of one shape in its own frame, m; of a mesh that of its hull, with which MuJoCo collides."""
    made: trimesh.Trimesh
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        made = trimesh.PointCloud(model.mesh_vert[first : first + count].astype(float)).convex_hull
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        made = trimesh.creation.box(extents=2.0 * size)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        made = trimesh.creation.cylinder(radius=size[0], height=2.0 * size[1], sections=64)
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        made = trimesh.creation.capsule(radius=size[0], height=2.0 * size[1])
    elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        made = trimesh.creation.icosphere(radius=size[0])
    else:
        raise ValueError(f"shape {geom} is a {kind.name}, which no refined object has")
    return made
