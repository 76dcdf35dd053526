"""The ``World`` interface over one object in MuJoCo, and ``StaticObject``, where nothing moves."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from types import MappingProxyType

import mujoco
import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from asset2sim.assets.mujoco_options import bias_name, body_name
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.mimic import read_mimics
from asset2sim.assets.urdf.read import Dynamics, read_dynamics
from asset2sim.engines import lowest
from asset2sim.engines.contacts import ContactPoint, LocatedContact
from asset2sim.engines.mujoco_spec import collected_warnings, compiled_model, give_options, object_spec
from asset2sim.engines.world import DeclaredEngine, click_near, nothing_collides, with_followers
from asset2sim.physics.arrays import Array, cross, norms
from asset2sim.physics.kinematics import follower_positions
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.vocabulary import Engine

GROUND_GRID_M = 1.0
"""Spacing of the plane's picture grid, m, which MuJoCo asks for; the plane itself is infinite."""


@contextmanager
def open_mujoco(
    urdf: Path, *, plane: bool, timestep_s: float, contact_friction: float, gravity_m_s2: float = GRAVITY_M_S2
) -> Iterator["MuJoCoWorld"]:
    """A world in MuJoCo (see ``Opener``), the object placed with its joints at zero."""
    with collected_warnings() as said:
        spec = object_spec(urdf, free=plane, contact_friction=contact_friction)
        if plane:
            size, friction = [0.0, 0.0, GROUND_GRID_M], [contact_friction, 0.0, 0.0]
            spec.worldbody.add_geom(name="ground", type=mujoco.mjtGeom.mjGEOM_PLANE, size=size, friction=friction)
        give_options(spec, timestep_s, gravity_m_s2)
        model = compiled_model(spec, urdf)
        world = MuJoCoWorld(model, plane, tuple(said), parsed_root(urdf), read_dynamics(urdf))
        world.place({})
        yield world


class MuJoCoWorld:
    """One object in one MuJoCo model. Poses and speeds are recomputed on each query after a step."""

    engine = Engine.MUJOCO
    skin_m = 0.0

    def __init__(
        self,
        model: mujoco.MjModel,
        plane: bool,
        console: tuple[str, ...],
        robot: "etree._Element",
        terms: Mapping[str, Dynamics] = MappingProxyType({}),
    ) -> None:
        self.mimics = read_mimics(robot)
        self.model, self.data = model, mujoco.MjData(model)
        self.plane = plane
        self.console = console
        self.timestep_s = float(model.opt.timestep)
        links = {str(link.get("name")) for link in robot.findall("link")}
        link_of = {body_name(name, links): name for name in links}
        self.link_names = tuple(link_of[model.body(index).name] for index in range(1, model.nbody))
        self.joints = [i for i in range(model.njnt) if model.jnt_type[i] != mujoco.mjtJoint.mjJNT_FREE]
        self.joint_names = tuple(model.joint(index).name for index in self.joints)
        self.qpos = model.jnt_qposadr[self.joints]
        self.qvel = model.jnt_dofadr[self.joints]
        self.index = {name: i for i, name in enumerate(self.joint_names)}
        self.cloud = shapes_of(model)
        clicking = [name for name in self.joint_names if name in terms and terms[name].bias[4] > 0.0]
        self.clicks = np.array([terms[name].bias for name in clicking]).reshape(-1, 5)
        self.clicked = [model.actuator(bias_name(name)).id for name in clicking]
        self.turned = self.qpos[[self.index[name] for name in clicking]]

    def place(
        self,
        positions: Mapping[str, float],
        *,
        height_m: float = 0.0,
        shift_m: tuple[float, float] = (0.0, 0.0),
        tilt_rad: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """See ``World``. Raises AssetError (engine_crash) where nothing could stand on the plane."""
        mujoco.mj_resetData(self.model, self.data)
        positions = follower_positions(self.mimics, positions)
        self.data.qpos[self.qpos] = [positions.get(name, 0.0) for name in self.joint_names]
        if not self.plane:
            return
        x, y, z, w = Rotation.from_rotvec(tilt_rad).as_quat()
        self.data.qpos[:7] = (*shift_m, 0.0, w, x, y, z)
        height = self.lowest_m()
        if not np.isfinite(height):
            raise nothing_collides()
        self.data.qpos[2] = height_m - height

    def step(self, count: int = 1) -> None:
        if not self.clicked:
            mujoco.mj_step(self.model, self.data, nstep=count)
            return
        for _ in range(count):
            # MuJoCo's actuators have no period: they are moved to the click that is nearest.
            nearest = click_near(self.clicks, self.data.qpos[self.turned])
            self.model.actuator_biasprm[self.clicked, 0] = -self.clicks[:, 0] * nearest
            mujoco.mj_step(self.model, self.data)

    def root_pose(self) -> tuple[Array, Array]:
        """See ``World``: the root link's frame."""
        if not self.plane:
            mujoco.mj_kinematics(self.model, self.data)
        position = self.data.qpos[:3] if self.plane else self.data.xpos[1]
        w, x, y, z = self.data.qpos[3:7] if self.plane else self.data.xquat[1]
        return np.array(position), np.array([x, y, z, w])

    def root_center(self) -> Array:
        mujoco.mj_kinematics(self.model, self.data)
        return np.array(self.data.xipos[1])

    def positions(self) -> Array:
        values: Array = self.data.qpos[self.qpos]
        return values

    def velocities(self) -> Array:
        values: Array = self.data.qvel[self.qvel]
        return values

    def kick(self, velocities: Mapping[str, float]) -> None:
        for name, velocity in with_followers(self.mimics, velocities).items():
            self.data.qvel[self.qvel[self.index[name]]] = velocity

    def push(self, efforts: Mapping[str, float]) -> None:
        self.data.qfrc_applied[self.qvel] = [efforts.get(name, 0.0) for name in self.joint_names]

    def link_speeds(self) -> Array:
        model, data = self.model, self.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        # A body's velocity is given as at the centre of mass of its tree.
        arms = data.xipos[1:] - data.subtree_com[model.body_rootid[1:]]
        speeds: Array = norms(data.cvel[1:, 3:] + cross(data.cvel[1:, :3], arms))
        return speeds

    def lowest_m(self) -> float:
        """See ``World``; infinite where the object has no collision shape."""
        mujoco.mj_kinematics(self.model, self.data)
        return self.cloud.lowest_m(self.data.xmat.reshape(-1, 3, 3), self.data.xpos)

    def contacts(self) -> list[ContactPoint]:
        """See ``World``: no contacts of a link with its parent."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_collision(self.model, self.data)
        contact = self.data.contact
        bodies = self.model.geom_bodyid[contact.geom]
        return [
            ContactPoint(self.link_names[a - 1], self.link_names[b - 1], float(distance))
            for (a, b), distance in zip(bodies.tolist(), contact.dist.tolist(), strict=True)
            if a and b
        ]


def shapes_of(model: mujoco.MjModel) -> lowest.BallCloud:
    """The collision shapes of all links, by body."""
    shapes: list[tuple[int, lowest.Balls, Array]] = []
    for index in range(model.ngeom):
        body = int(model.geom_bodyid[index])
        if body == 0:
            continue
        pose = np.eye(4)
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, model.geom_quat[index])
        pose[:3, :3], pose[:3, 3] = matrix.reshape(3, 3), model.geom_pos[index]
        shapes.append((body, shape_of(model, index), pose))
    return lowest.lowest_cloud(shapes)


def shape_of(model: mujoco.MjModel, index: int) -> lowest.Balls:
    """One geom's shape in its own frame."""
    size, kind = model.geom_size[index], model.geom_type[index]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[index]
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        return lowest.corners(model.mesh_vert[start : start + count])
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return lowest.box(size)
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        return lowest.sphere(float(size[0]))
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return lowest.capsule(float(size[0]), float(size[1]), 2)
    return lowest.cylinder(float(size[0]), float(size[1]), 2)


ENGINE = DeclaredEngine(Engine.MUJOCO, open_mujoco, started=(MuJoCoWorld, "__init__"))


CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
"""(8, 3) signs of a box's corners."""


class StaticMuJoCo(MuJoCoWorld):
    """``StaticObject`` in one MuJoCo model."""

    def located_contacts(self) -> list[LocatedContact]:
        """See ``StaticObject``."""
        points, contact = self.contacts(), self.data.contact
        # MuJoCo's normal leads from its first geom to its second.
        return [
            LocatedContact(point.link_a, point.link_b, point.separation_m, tuple(place), tuple(-frame[:3]))
            for point, place, frame in zip(points, contact.pos.tolist(), contact.frame, strict=True)
        ]

    def boxes(self) -> dict[str, tuple[Array, Array]]:
        """See ``StaticObject``."""
        mujoco.mj_kinematics(self.model, self.data)
        found: dict[str, tuple[Array, Array]] = {}
        for geom, body in enumerate(self.model.geom_bodyid.tolist()):
            middle, half = self.model.geom_aabb[geom].reshape(2, 3)
            corners = (middle + CORNERS * half) @ self.data.geom_xmat[geom].reshape(3, 3).T + self.data.geom_xpos[geom]
            low, high = found.get(name := self.link_names[body - 1], (corners[0], corners[0]))
            found[name] = np.minimum(low, corners.min(axis=0)), np.maximum(high, corners.max(axis=0))
        return found


@contextmanager
def static_mujoco(urdf: Path, timestep_s: float, *, parents: bool = False) -> Iterator[StaticMuJoCo]:
    """The object with its root held and no gravity; ``parents``: a link collides with its parent, too."""
    with collected_warnings() as said:
        # A free root, which stays where it is, keeps the pairs that are excluded by name out of it.
        spec = object_spec(urdf, free=parents, contact_friction=0.0)
        give_options(spec, timestep_s, 0.0)
        if parents:
            spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
        model = compiled_model(spec, urdf)
        world = StaticMuJoCo(model, False, tuple(said), parsed_root(urdf))
        world.place({})
        yield world
