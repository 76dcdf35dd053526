"""One object in one PyBullet client, with joint damping, friction and stiffness honoured as its URDF states them.

PyBullet applies damping from URDF but neither friction nor stiffness, runs a hidden velocity motor on every joint, and
damps every body (design.md); it leaves a joint beyond its limit where it has overshot it. Here the hidden motor
provides dry friction, a torque acts as the spring, body damping is 0, and limits are enforced.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import pybullet
from pybullet_utils.bullet_client import BulletClient

from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.mimic import read_mimics
from asset2sim.assets.urdf.read import Dynamics, passing_pairs, read_dynamics
from asset2sim.engines.console import captured_console
from asset2sim.engines.contacts import ContactPoint, LocatedContact
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import follower_positions
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.errors import AssetError
from schemas.features import Mimic
from schemas.vocabulary import FailureMode

FLAGS = (
    pybullet.URDF_USE_INERTIA_FROM_FILE
    | pybullet.URDF_USE_SELF_COLLISION
    | pybullet.URDF_IGNORE_VISUAL_SHAPES
    | pybullet.URDF_USE_IMPLICIT_CYLINDER
)
"""Authored inertia, self-collision with PyBullet's default filter (no contacts of a link with its parent), and
cylinders that are round: else they have 32 corners, over which a wheel does not roll."""
MOST_SPEED = 1e6
"""Joint speed at which PyBullet cuts off, rad/s or m/s, instead of its own 100: it cuts before it solves for friction,
which at 100 stops whatever moves less inertia than friction · Δt / 100, under any torque: a camera's knob."""
JOINT_ITERATIONS = 4
"""Rounds over the joints' own rows for each round over the contacts. With one, friction of joints in series lets go as
soon as anything else of the object touches: a lid on a tank sank at 5 cm/s under 2/3 of the load it bears."""
RESIDUAL = 1e-10
"""Largest correction, squared, at which the solver stops early. At its own 1e-7 a lid that friction holds creeps by
2 mrad/s on an object that stands on a plane."""


GEAR_ERP = 0.2
"""Share of its error that a gear takes back in a step, as Bullet's own joints do."""
GEAR_FORCE = 1e6
"""Largest force of a gear, N·m or N: far more than any part of a household object bears."""


@dataclass(frozen=True)
class PyBulletItem:
    """A loaded object: its client and body, link names by index (-1 is the root), and its movable joints in order."""

    client: BulletClient
    body: int
    link_names: dict[int, str]
    joint_index: dict[str, int]
    dynamics: dict[str, Dynamics]
    console: tuple[str, ...]
    mimics: Mapping[str, Mimic] = field(default_factory=dict)

    def place(self, positions: Mapping[str, float]) -> None:
        """Set joint positions (rad, m) at rest; joints not named go to zero, those that follow others with these."""
        if not self.joint_index:
            return
        positions = follower_positions(self.mimics, positions)
        joints = list(self.joint_index.values())
        # All at once: each call moves every link.
        placed = [[float(positions.get(name, 0.0))] for name in self.joint_index]
        self.client.resetJointStatesMultiDof(self.body, joints, placed, [[0.0]] * len(joints))

    def ignore(self, pairs: Iterable[tuple[str, str]]) -> None:
        """Make no contacts between these links."""
        index = {name: number for number, name in self.link_names.items()}
        for a, b in pairs:
            self.client.setCollisionFilterPair(self.body, self.body, index[a], index[b], 0)

    def positions(self) -> Array:
        """(n,) joint positions in ``joint_index``' order, rad or m."""
        return self._joint_states(0)

    def velocities(self) -> Array:
        """(n,) joint velocities in ``joint_index``' order, rad/s or m/s."""
        return self._joint_states(1)

    def contacts(self) -> list[ContactPoint]:
        """The object's contact points with itself as it is, under the filter that it was loaded with."""
        self.client.performCollisionDetection()
        names = self.link_names
        return [
            ContactPoint(names[point[3]], names[point[4]], float(point[8]))
            for point in self.client.getContactPoints(self.body, self.body)
        ]

    def located_contacts(self) -> list[LocatedContact]:
        """``contacts`` with places and normals; in the world's frame, which a held root link shares."""
        self.client.performCollisionDetection()
        names = self.link_names
        return [
            LocatedContact(names[point[3]], names[point[4]], float(point[8]), tuple(point[6]), tuple(point[7]))
            for point in self.client.getContactPoints(self.body, self.body)
        ]

    def boxes(self) -> dict[str, tuple[Array, Array]]:
        """Link → lowest and highest corner, (3,) each, m, of its collision shapes' box along the world's axes."""
        found = {name: self.client.getAABB(self.body, index) for index, name in self.link_names.items()}
        return {name: (np.array(low), np.array(high)) for name, (low, high) in found.items()}

    def _joint_states(self, column: int) -> Array:
        # Asked for no joints, PyBullet answers None.
        states = self._ask() if self.joint_index else []
        return np.array([state[column] for state in states], dtype=float)

    @cached_property
    def _ask(self) -> Callable[[], list[tuple[float, ...]]]:
        """Call that reads all joint states, bound once because every step needs it."""
        return partial(self.client.getJointStates, self.body, list(self.joint_index.values()))


class Client(BulletClient):  # type: ignore[misc]
    """A client that looks each of PyBullet's functions up once: anew at each call, that is a twentieth of a check."""

    def __getattr__(self, name: str) -> Any:
        found = super().__getattr__(name)
        if name != "disconnect":  # which marks the client as closed
            self.__dict__[name] = found
        return found


IDLE: list[BulletClient] = []
"""Clients between two uses: to connect one takes 15 ms in the kernel, to empty one 0.6 ms."""


@contextmanager
def empty_client() -> Iterator[BulletClient]:
    """A client without bodies and with PyBullet's own solver; its time step is of its last use, gravity is none."""
    client = IDLE.pop() if IDLE else Client(connection_mode=pybullet.DIRECT)
    # Else a mesh file is read once in a process, whatever is written to it afterwards.
    client.setPhysicsEngineParameter(enableFileCaching=0)
    try:
        yield client
    finally:
        client.resetSimulation()
        IDLE.append(client)


def keep_clients() -> None:
    """Connect as many clients as a check has worlds at once; what forks from this process has them ready."""
    with empty_client(), empty_client(), empty_client():
        pass


@contextmanager
def loaded(
    urdf: Path, *, fixed_base: bool, timestep_s: float, gravity_m_s2: float = GRAVITY_M_S2, flags: int = FLAGS
) -> Iterator[PyBulletItem]:
    """Load a URDF into a client of its own, gravity along -z, joint dynamics applied, until the block ends.
    Raises AssetError (engine_refused) where PyBullet refuses the file, with what it printed."""
    with empty_client() as client:
        client.setTimeStep(timestep_s)
        client.setGravity(0.0, 0.0, -gravity_m_s2)
        # Else a joint that has overshot its limit in one step is stopped there, and never brought back.
        client.setPhysicsEngineParameter(
            useSplitImpulse=0, numNonContactInnerIterations=JOINT_ITERATIONS, solverResidualThreshold=RESIDUAL
        )
        with captured_console() as console:
            try:
                body = client.loadURDF(str(urdf), useFixedBase=fixed_base, flags=flags)
            except pybullet.error:
                body = -1
        if body < 0:
            said = "; ".join(line for line in console if "argv" not in line)[-400:] or "nothing"
            message = f"PyBullet refuses {urdf.name} and says: {said}"
            raise AssetError(FailureMode.ENGINE_REFUSED, "engine_refused", message)
        item = prepared(client, body, read_dynamics(urdf), tuple(console), read_mimics(parsed_root(urdf)))
        item.ignore(passing_pairs(parsed_root(urdf)))
        yield item


def prepared(
    client: BulletClient,
    body: int,
    dynamics: dict[str, Dynamics],
    console: tuple[str, ...],
    mimics: Mapping[str, Mimic],
) -> PyBulletItem:
    """The object without PyBullet's own damping and motors, its joints' terms applied and its followers geared."""
    link_names = {-1: client.getBodyInfo(body)[0].decode()}
    joint_index: dict[str, int] = {}
    client.changeDynamics(body, -1, linearDamping=0.0, angularDamping=0.0)
    for index in range(client.getNumJoints(body)):
        info = client.getJointInfo(body, index)
        name, kind = info[1].decode(), info[2]
        link_names[index] = info[12].decode()
        client.changeDynamics(body, index, linearDamping=0.0, angularDamping=0.0)
        if kind == pybullet.JOINT_FIXED:
            continue
        joint_index[name] = index
        terms = dynamics[name]
        # A call of its own: beside it PyBullet forgets the damping.
        client.changeDynamics(body, index, maxJointVelocity=MOST_SPEED)
        client.changeDynamics(body, index, jointDamping=terms.damping)
        # A velocity motor at rest with a bounded force is Coulomb friction; force 0 switches the hidden motor off.
        client.setJointMotorControl2(body, index, pybullet.VELOCITY_CONTROL, targetVelocity=0.0, force=terms.friction)
    for name, mimic in mimics.items():
        couple_joints(client, body, joint_index[name], joint_index[mimic.joint], mimic)
    dynamics = {name: dynamics[name] for name in joint_index}
    return PyBulletItem(client, body, link_names, joint_index, dynamics, console, mimics)


def couple_joints(client: BulletClient, body: int, follower: int, leader: int, mimic: Mimic) -> None:
    """Bind two joints of one body, q_follower − multiplier · q_leader = offset: PyBullet ignores URDF's mimic."""
    nowhere = (0.0, 0.0, 0.0)
    made = client.createConstraint(body, follower, body, leader, pybullet.JOINT_GEAR, (0.0, 0.0, 1.0), nowhere, nowhere)
    client.changeConstraint(
        made, gearRatio=-mimic.multiplier, relativePositionTarget=mimic.offset, erp=GEAR_ERP, maxForce=GEAR_FORCE
    )


def static_pybullet(urdf: Path, timestep_s: float, *, parents: bool = False) -> AbstractContextManager[PyBulletItem]:
    """``StaticObject``; ``parents``: a link collides with its parent, too."""
    flags = FLAGS | (pybullet.URDF_USE_SELF_COLLISION_INCLUDE_PARENT if parents else 0)
    return loaded(urdf, fixed_base=True, timestep_s=timestep_s, gravity_m_s2=0.0, flags=flags)
