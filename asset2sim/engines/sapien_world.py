"""The ``World`` interface over one object in SAPIEN: PhysX on the CPU, no graphics."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

import numpy as np
import yourdfpy
from scipy.spatial.transform import Rotation

from asset2sim.assets.links import read_inertial
from asset2sim.assets.urdf.read import root_of, tree_joint
from asset2sim.engines.contacts import ContactPoint
from asset2sim.engines.sapien_object import SapienItem, loaded
from asset2sim.engines.world import DeclaredEngine, bias_efforts, nothing_collides, with_followers
from asset2sim.physics.arrays import Array
from asset2sim.physics.inertia import tensor_of
from asset2sim.physics.kinematics import follower_positions, mimics_of, parents_first
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body, joint_space
from schemas.vocabulary import Engine

TAKEN_BACK = 0.25
"""Share of an error that a step takes back. An acceleration a that the coupling bears leaves an error of a·Δt² over
this: 0.7 mrad at 10 rad/s² and 1/240 s."""
DAMPED = 0.5
"""Share of an error's speed that a step takes away. With both, what an error moves may weigh a third of what it did
where the object was placed before the coupling oscillates (semi-implicit steps are stable while a + 2 d < 4)."""


class Coupling:
    """Mimics of one object of n joints, in ``names``' order: efforts that bind each follower to its leader.

    PhysX has no mimic joint. SAPIEN's own URDF loader binds them by tendons, which want all joints between the two to
    move, and let a pair of bars of ratio 2 accelerate 2.5 times as fast as they should (their ``recip_coefficients``),
    so that no effort could be measured. Here a spring and a damper act on the error, and, times the ratio, back on the
    leader. Both are as stiff as a step allows, by the inertia that an error moves at the pose where the object was
    placed.
    """

    def __init__(self, robot: yourdfpy.Robot, names: tuple[str, ...], held: bool, timestep_s: float) -> None:
        self.tree = parents_first([tree_joint(joint) for joint in robot.joints])
        self.root, self.names, self.held, self.step = root_of(robot), names, held, timestep_s
        self.mimics = mimics_of(self.tree)
        self.bodies = {str(link.name): body_of(link) for link in robot.links} if self.mimics else {}
        # Rows of q_follower − multiplier · q_leader = offset.
        self.rows, self.offsets = np.zeros((len(self.mimics), len(names))), np.zeros(len(self.mimics))
        for row, (name, mimic) in enumerate(self.mimics.items()):
            self.rows[row, names.index(name)] = 1.0
            self.rows[row, names.index(mimic.joint)] -= mimic.multiplier
            self.offsets[row] = mimic.offset
        self.inertia: Array = np.zeros((len(self.mimics), len(self.mimics)))

    def measure(self, positions: Mapping[str, float], armature: Mapping[str, float]) -> None:
        """Take the inertia that errors move from the object with its joints at ``positions``."""
        if not self.mimics:
            return
        space = joint_space(self.tree, self.root, self.bodies, positions, self.held).geared(armature)
        order = [space.names.index(name) for name in self.names]
        mobility = space.mobility[np.ix_(order, order)]
        self.inertia = np.asarray(np.linalg.inv(self.rows @ mobility @ self.rows.T), dtype=np.float64)

    def efforts(self, positions: Array, velocities: Array) -> Array:
        """(n,) efforts of the coupling, N·m or N, at these (n,) joint positions and velocities."""
        error, speed = self.rows @ positions - self.offsets, self.rows @ velocities
        wanted = -(TAKEN_BACK * error / self.step + DAMPED * speed) / self.step
        found: Array = self.rows.T @ (self.inertia @ wanted)
        return found


def body_of(link: yourdfpy.Link) -> Body:
    """A link's mass, centre of mass and inertia; nothing where it states none."""
    inertial = read_inertial(link.inertial)
    if inertial is None:
        return Body(0.0, np.zeros(3), np.zeros((3, 3)))
    return Body(inertial.mass_kg, np.asarray(inertial.com), tensor_of(inertial.inertia))


LOOK_S = 1e-7
"""Time step of a contact query, s: PhysX finds contacts only while stepping, at the poses before the step."""

RUNS_AWAY = 1e5
"""Speed of a joint, rad/s or m/s, from which the world stops: steps later it is no number, of which PhysX dies."""

AT_STOP = 1e-7
"""Distance from a limit within which a joint stands at it, rad or m: single precision at a tenth of a metre."""


@contextmanager
def open_sapien(
    urdf: Path, *, plane: bool, timestep_s: float, contact_friction: float, gravity_m_s2: float = GRAVITY_M_S2
) -> Iterator["SapienWorld"]:
    """A world in SAPIEN (see ``Opener``), the object placed with its joints at zero."""
    with loaded(
        urdf, plane=plane, timestep_s=timestep_s, contact_friction=contact_friction, gravity_m_s2=gravity_m_s2
    ) as item:
        world = SapienWorld(item, timestep_s, plane)
        world.place({})
        yield world


class SapienWorld:
    """One object in one PhysX scene."""

    engine = Engine.SAPIEN
    skin_m = 0.0

    def __init__(self, item: SapienItem, timestep_s: float, plane: bool) -> None:
        self.item = item
        self.timestep_s = timestep_s
        self.plane = plane
        self.console = item.console
        self.link_names = tuple(link.name for link in item.links)
        self.joint_names = tuple(joint.name for joint in item.articulation.active_joints)
        self.index = {name: i for i, name in enumerate(self.joint_names)}
        terms = [item.dynamics[name] for name in self.joint_names]
        self.stiffness = np.array([term.stiffness for term in terms])
        self.reference = np.array([term.spring_reference for term in terms])
        self.bias = np.array([term.bias for term in terms]).reshape(-1, 5)
        self.efforts = np.zeros(len(self.joint_names))
        self.coupling = Coupling(item.robot, self.joint_names, not plane, timestep_s)
        self.armature = {name: item.dynamics[name].armature for name in self.joint_names}
        self.biased = bool(self.bias.any())
        self.sprung = bool(self.stiffness.any()) or self.biased or bool(self.coupling.mimics)
        self.limits = np.array(item.articulation.get_qlimits(), dtype=float).reshape(-1, 2)
        self.at_rest = np.zeros(len(self.joint_names), dtype=np.float32)
        self.pose = import_module("sapien").Pose
        self.lost = False

    def place(
        self,
        positions: Mapping[str, float],
        *,
        height_m: float = 0.0,
        shift_m: tuple[float, float] = (0.0, 0.0),
        tilt_rad: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """See ``World``. Raises AssetError (engine_crash) where nothing could stand on the plane."""
        body, self.lost = self.item.articulation, False
        x, y, z, w = Rotation.from_rotvec(tilt_rad).as_quat()
        self.stand((shift_m[0], shift_m[1], 0.0), (w, x, y, z))
        self.push({})
        if self.joint_names:
            positions = follower_positions(self.coupling.mimics, positions)
            self.coupling.measure(positions, self.armature)
            body.set_qpos(np.array([positions.get(name, 0.0) for name in self.joint_names], dtype=np.float32))
            body.set_qvel(self.at_rest)
        if not self.plane:
            return
        height = self.lowest_m()
        if not np.isfinite(height):
            raise nothing_collides()
        self.stand((shift_m[0], shift_m[1], height_m - height), (w, x, y, z))

    def stand(self, position: tuple[float, float, float], orientation: tuple[float, float, float, float]) -> None:
        """Set a free root's pose (orientation wxyz) at rest."""
        if self.plane:
            body = self.item.articulation
            body.set_root_pose(self.pose(position, orientation))
            body.set_root_linear_velocity(np.zeros(3))
            body.set_root_angular_velocity(np.zeros(3))

    def step(self, count: int = 1) -> None:
        body, system = self.item.articulation, self.item.system
        for _ in range(count):
            speeds = body.get_qvel()
            if len(speeds) and not np.abs(speeds).max() <= RUNS_AWAY:
                self.lost = True
                return
            if self.sprung:
                # An effort, not PhysX' implicit spring, which loses energy by itself.
                positions = body.get_qpos()
                springs = self.stiffness * (self.reference - positions)
                if self.biased:
                    springs += bias_efforts(self.bias, positions)
                if self.coupling.mimics:
                    springs += self.coupling.efforts(positions, speeds)
                body.set_qf((springs + self.efforts).astype(np.float32))
            system.step()

    def root_pose(self) -> tuple[Array, Array]:
        """See ``World``: the root link's frame."""
        pose = self.item.articulation.get_root_pose()
        w, x, y, z = pose.q
        return np.array(pose.p, dtype=float), np.array([x, y, z, w], dtype=float)

    def root_center(self) -> Array:
        root = self.item.articulation.get_root()
        return np.array((root.pose * root.cmass_local_pose).p, dtype=float)

    def positions(self) -> Array:
        return np.array(self.item.articulation.get_qpos(), dtype=float)

    def velocities(self) -> Array:
        """See ``World``. PhysX reports speeds into a stop of parts that a spring presses on it: they count as none."""
        if not self.joint_names:
            return np.zeros(0)
        present, speeds = self.positions(), np.array(self.item.articulation.get_qvel(), dtype=float)
        low, high = self.limits[:, 0] + AT_STOP, self.limits[:, 1] - AT_STOP
        speeds[((present >= high) & (speeds > 0.0)) | ((present <= low) & (speeds < 0.0))] = 0.0
        return speeds

    def kick(self, velocities: Mapping[str, float]) -> None:
        present = self.velocities()
        for name, velocity in with_followers(self.coupling.mimics, velocities).items():
            present[self.index[name]] = velocity
        self.item.articulation.set_qvel(present.astype(np.float32))

    def push(self, efforts: Mapping[str, float]) -> None:
        if self.joint_names:
            self.efforts = np.array([efforts.get(name, 0.0) for name in self.joint_names])
            self.item.articulation.set_qf(self.efforts.astype(np.float32))

    def link_speeds(self) -> Array:
        """See ``World``; infinite once it has stopped, since something ran away."""
        if self.lost:
            return np.full(len(self.item.links), np.inf)
        speeds: Array = np.linalg.norm([link.linear_velocity for link in self.item.links], axis=1).astype(float)
        return speeds

    def lowest_m(self) -> float:
        """See ``World``; infinite where the object has no collision shape."""
        frames = np.array([link.pose.to_transformation_matrix() for link in self.item.links], dtype=float)
        return self.item.cloud.lowest_m(frames[:, :3, :3], frames[:, :3, 3])

    def contacts(self) -> list[ContactPoint]:
        """See ``World``: no contacts of a link with its parent. The state is restored afterwards."""
        body, system = self.item.articulation, self.item.system
        positions, velocities, pose = body.get_qpos(), body.get_qvel(), body.get_root_pose()
        linear, angular = body.get_root_linear_velocity(), body.get_root_angular_velocity()
        system.set_timestep(LOOK_S)
        system.step()
        system.set_timestep(self.timestep_s)
        if self.joint_names:
            body.set_qpos(positions)
            body.set_qvel(velocities)
        if self.plane:
            body.set_root_pose(pose)
            body.set_root_linear_velocity(linear)
            body.set_root_angular_velocity(angular)
        return [
            ContactPoint(contact.bodies[0].name, contact.bodies[1].name, float(point.separation))
            for contact in system.get_contacts()
            if all(other.name for other in contact.bodies)
            for point in contact.points
            # PhysX also lists points that are still apart.
            if point.separation <= 0.0
        ]


ENGINE = DeclaredEngine(Engine.SAPIEN, open_sapien, started=(SapienWorld, "__init__"))
