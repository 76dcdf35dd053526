"""A refined object in a MuJoCo world, as it stands, with what uses it: what an arm's world and a hand's share."""

import math
import warnings
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from asset2sim.load import Description, load, mesh_points
from asset2sim.load.in_mujoco import MuJoCoObject
from asset2sim.physics.arrays import Array

Mask = NDArray[np.bool_]

TOOL = "tool/"
"""Prefix of the names of the bodies that use the object."""
THIN_M = 0.0005
"""Thickness that flat meshes are given, m."""
FLAT = 1e-5
"""Share of its extent below which a mesh's thickness is none."""
CONTACT_TIME_S = 0.004
"""Time constant of contacts, s, of whatever way an object was written: four time steps."""


@dataclass(eq=False)
class ObjectWorld:
    """A compiled world in which the names of the object's bodies and joints begin with ``prefix``."""

    about: Description
    prefix: str
    model: mujoco.MjModel
    data: mujoco.MjData

    @cached_property
    def object_geoms(self) -> Mask:
        """(n,) mask of geoms: the object's."""
        return self.geoms_of(self.prefix)

    @cached_property
    def tool_geoms(self) -> Mask:
        """(n,) mask of geoms: those of what uses it."""
        return self.geoms_of(TOOL)

    def geoms_of(self, prefix: str) -> Mask:
        """(n,) mask of the geoms of bodies whose names begin so."""
        return np.array([self.model.body(int(body)).name.startswith(prefix) for body in self.model.geom_bodyid])

    @cached_property
    def object_dofs(self) -> Mask:
        """(n,) mask of velocities: the object's."""
        return np.isin(self.model.dof_bodyid, self.bodies)

    @cached_property
    def root(self) -> int:
        """The number of the object's root body."""
        return self.bodies[0]

    @cached_property
    def bodies(self) -> list[int]:
        """The numbers of the object's bodies."""
        names = (self.model.body(number).name for number in range(self.model.nbody))
        return [number for number, name in enumerate(names) if name.startswith(self.prefix)]

    def joint(self, name: str) -> int:
        """The number of an object's joint."""
        return int(self.model.joint(self.prefix + name).id)

    def place(self, name: str) -> int:
        """The place of an object's joint among positions."""
        return int(self.model.jnt_qposadr[self.joint(name)])

    def position(self, name: str) -> float:
        """An object's joint's position, rad or m."""
        return float(self.data.qpos[self.place(name)])

    def edge_m(self, name: str, points: Array) -> float:
        """Distance of the farthest of (n, 3) points, world, from a hinge's axis, m; 1 of a slider."""
        number = self.joint(name)
        if self.model.jnt_type[number] == mujoco.mjtJoint.mjJNT_SLIDE:
            return 1.0
        off = np.cross(self.data.xaxis[number], points - self.data.xanchor[number])
        return float(np.linalg.norm(off, axis=1).max(initial=0.0))

    def first_met(
        self, source: Array, towards: Array, but: int = -1, data: mujoco.MjData | None = None
    ) -> tuple[float, int]:
        """Distance along a ray to the first geom, m, infinite where it meets none, and that geom; geoms of the body
        ``but`` are not seen. Bodies are where ``data`` has them, by itself the world's."""
        geom = np.array([-1], dtype=np.int32)
        met = mujoco.mj_ray(self.model, self.data if data is None else data, source, towards, None, 1, but, geom)
        return (met, int(geom[0])) if met >= 0.0 else (math.inf, -1)


def body_pose(data: mujoco.MjData, body: int) -> Array:
    """(4, 4) pose of a body in the world."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = data.xmat[body].reshape(3, 3), data.xpos[body]
    return pose


def body_subtree(model: mujoco.MjModel, body: int) -> frozenset[int]:
    """A body and all that hang on it."""
    found = {body}
    for index in range(body + 1, model.nbody):
        if int(model.body_parentid[index]) in found:
            found.add(index)
    return frozenset(found)


def welded_bodies(model: mujoco.MjModel, body: int) -> frozenset[int]:
    """A body and those that are welded to it."""
    return frozenset(index for index in range(model.nbody) if model.body_weldid[index] == model.body_weldid[body])


def object_spec(folder: Path, timestep_s: float, fixed: bool | None = None) -> tuple[mujoco.MjSpec, MuJoCoObject]:
    """A floor and a refined object at the origin in its initial state, to be compiled (``compiled_object``); its root
    is held or free as ``load`` has it. Raises LoadError as ``load`` does."""
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.integrator = timestep_s, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 100.0
    spec.option.iterations, spec.option.tolerance = 100, 1e-10
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 0.05))
    loaded = load(folder, engine="mujoco", into=spec, position=(0.0, 0.0), timestep_s=timestep_s, fixed=fixed)
    leave_out_looks(spec)
    thicken_flat(spec)
    for geom in spec.geoms:
        geom.solref = (CONTACT_TIME_S, 1.0)
    return spec, loaded


def compiled_object(
    spec: mujoco.MjSpec, loaded: MuJoCoObject
) -> tuple[Description, str, mujoco.MjModel, mujoco.MjData]:
    """First fields of an ``ObjectWorld`` of a complete specification, compiled, the object in its initial state.
    Raises ValueError where MuJoCo refuses it."""
    with warnings.catch_warnings(action="ignore"):  # of texture coordinates, which are not used
        model = spec.compile()
    data = mujoco.MjData(model)
    loaded.finish(model, data)
    return loaded.about, loaded.prefix, model, data


def leave_out_looks(spec: mujoco.MjSpec) -> None:
    """Remove what an exported object shows and nothing touches: the scene is the same as without the export."""
    for geom in [one for one in spec.geoms if not one.contype and not one.conaffinity]:
        spec.delete(geom)
    shown = {geom.meshname for geom in spec.geoms}
    for mesh in [one for one in spec.meshes if one.name not in shown]:
        spec.delete(mesh)


def thicken_flat(spec: mujoco.MjSpec) -> None:
    """Give flat meshes a thickness of ``THIN_M``: MuJoCo refuses them, and refined objects alone have none."""
    for mesh in spec.meshes:
        if not mesh.file.lower().endswith(".obj"):
            continue
        points = mesh_points(Path(mesh.file), True)
        _, sizes, directions = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
        if sizes[2] > FLAT * sizes[0]:
            continue
        half = directions[2] * THIN_M / 2.0 / float(np.abs(mesh.scale).max())
        mesh.file, mesh.content_type = "", ""
        mesh.uservert = np.concatenate([points + half, points - half]).ravel().tolist()
