"""Springs of joints with an armature in PyBullet, which has none: a joint motor of bounded force.

A torque as the spring would throw a key of 1 g, whose spring asks for sixteen times what the time step bears. So the
adapter steps the joint's own motion, part and armature under spring, damper, friction, gravity and pushes, and gives
the velocity that comes out to the joint's motor as its target. The motor's force is bounded by what spring, damper and
armature exert meanwhile: a contact, of which that step knows nothing, meets the spring's force and no more. (The spring
alone stepped implicitly, as a torque, would lose 1 + k Δt² / m of its force also where a finger holds the key still.)
What Bullet's solver cannot do stays: a part far lighter than what rests on it bears too little in its few rounds.
"""

from collections.abc import Iterable

import numpy as np
import pybullet
from scipy.spatial.transform import Rotation

from asset2sim.engines.pybullet_object import PyBulletItem
from asset2sim.physics.arrays import Array

SLACK = 1.01
"""Bound of a motor over what spring, damper and armature exert: at equality, rounding alone lets go of a part that has
a thousandth of its armature's inertia."""

STOP_GAP = 1e-7
"""Distance before a limit at which a motor stops its part, rad or m: at the limit itself Bullet would solve a second
constraint beside it, twice as many for a keyboard at rest."""


class ArmatureSprings:
    """The joints of an object that have an armature; (n,) arrays in ``names``' order, rad or m, N·m or N, kg·m² or kg.

    ``moved`` is the inertia of what each moves and ``pull`` gravity's force on it, both as the object was placed: a key
    weighs a hundredth of what its spring presses.
    """

    def __init__(self, item: PyBulletItem, timestep_s: float) -> None:
        self.item, self.step = item, timestep_s
        self.names = tuple(name for name, term in item.dynamics.items() if term.armature > 0.0)
        terms = [item.dynamics[name] for name in self.names]
        self.joints = [item.joint_index[name] for name in self.names]
        self.stiffness, self.reference = array(t.stiffness for t in terms), array(t.spring_reference for t in terms)
        self.damping, self.friction = array(t.damping for t in terms), array(t.friction for t in terms)
        self.armature = array(t.armature for t in terms)
        self.weigh(np.zeros(len(terms)), np.zeros(len(terms)))
        limits = [item.client.getJointInfo(item.body, index)[8:10] for index in self.joints]
        # Bullet takes a lower limit above the upper one as none.
        self.low = array(low if low <= high else -np.inf for low, high in limits) + STOP_GAP
        self.high = array(high if low <= high else np.inf for low, high in limits) - STOP_GAP
        for index in self.joints:
            item.client.changeDynamics(item.body, index, jointDamping=0.0)

    def weigh(self, moved: Array, pull: Array) -> None:
        """Take ``moved`` and ``pull``, and what follows of them for each step."""
        self.moved, self.pull = moved, pull
        self.total = moved + self.armature
        self.resists = self.total + self.step * self.damping
        self.slowed = self.step * self.friction / self.resists

    def measure(self) -> None:
        """Take ``moved`` and ``pull`` from the object as it is."""
        if not self.joints:
            return
        client, body = self.item.client, self.item.body
        count = client.getNumJoints(body)
        states = client.getLinkStates(body, list(range(count)), computeForwardKinematics=1)
        parents = [client.getJointInfo(body, index)[16] for index in range(count)]
        dynamics = [client.getDynamicsInfo(body, index) for index in range(count)]
        gravity = client.getPhysicsEngineParameters()["gravityAccelerationZ"]
        centers, origins = (np.array([state[i] for state in states]) for i in (0, 4))
        inertial, frames = (Rotation.from_quat([state[i] for state in states]) for i in (1, 5))
        infos = [client.getJointInfo(body, joint) for joint in self.joints]
        axes = frames[self.joints].apply([info[13] for info in infos])
        slides = np.array([info[2] == pybullet.JOINT_PRISMATIC for info in infos])
        moves = np.zeros((len(self.joints), count))  # 1 where the joint moves the link
        for link, parent in enumerate(parents):  # children have larger indices than their parents
            moves[:, link] = (np.array(self.joints) == link) | ((moves[:, parent] > 0.0) if parent >= 0 else False)
        levers = centers - origins[self.joints][:, None]
        along = np.where(slides[:, None, None], axes[:, None], np.cross(axes[:, None], levers))
        masses, moments = np.array([item[0] for item in dynamics]), np.array([item[2] for item in dynamics])
        turned = np.einsum("ja,lab->jlb", axes, inertial.as_matrix())
        spun = np.where(slides[:, None], 0.0, (turned**2 * moments).sum(axis=2))
        moved = (moves * (masses * (along**2).sum(axis=2) + spun)).sum(axis=1)
        self.weigh(moved, (moves * masses * along[:, :, 2]).sum(axis=1) * gravity)

    def drive(self, efforts: Array) -> None:
        """Aim the motors for the next step, (n,) ``efforts`` being pushed on the joints by the world."""
        if not self.joints:
            return
        client, body = self.item.client, self.item.body
        states = client.getJointStates(body, self.joints)
        positions, speeds = np.array([state[:2] for state in states]).T
        targets, bounds = self.aims(positions, speeds, efforts)
        client.setJointMotorControlArray(
            body, self.joints, pybullet.VELOCITY_CONTROL, targetVelocities=targets.tolist(), forces=bounds.tolist()
        )

    def aims(self, positions: Array, speeds: Array, efforts: Array) -> tuple[Array, Array]:
        """(n,) velocities after the next step, kept from passing a limit, and (n,) the largest force of spring, damper,
        armature, friction and stop on the way, at least the spring's. The spring is explicit: validation makes
        the armature large enough, and damping implicit, for which it does not."""
        step = self.step
        spring = self.stiffness * (self.reference - positions)
        targets = (self.total * speeds + step * (spring + self.pull + efforts)) / self.resists
        targets -= np.sign(targets) * np.minimum(np.abs(targets), self.slowed)
        # Beyond a limit Bullet brings it back: a motor that did would leave it with that speed.
        targets = np.maximum(targets, np.minimum(self.low - positions, 0.0) / step)
        targets = np.minimum(targets, np.maximum(self.high - positions, 0.0) / step)
        gained = targets - speeds
        exerted = spring - self.damping * targets - self.armature * gained / step
        # At a stop the motor also bears what is pushed against it.
        borne = self.moved * gained / step - self.pull - efforts
        most = np.maximum(np.maximum(np.abs(exerted), np.abs(spring)), np.abs(borne))
        return targets, SLACK * most + self.friction


def array(values: Iterable[float]) -> Array:
    """(n,) numbers."""
    found: Array = np.array(list(values), dtype=float)
    return found
