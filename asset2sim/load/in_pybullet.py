"""A refined object in PyBullet."""

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from asset2sim.load.description import Description
from asset2sim.load.loaded import (
    GRAVITY,
    Contact,
    Loaded,
    Root,
    copied_urdf,
    engine_module,
    free_name,
    pose_matrix,
    three_numbers,
)
from asset2sim.load.shapes import carried_inertia


class PyBulletObject(Loaded):
    """The object from ``loadURDF``; PyBullet's own motors and damping are off. Dry friction is a motor at rest whose
    force is bounded, ``drive`` sets the forces of springs for one step. Friction coefficients multiply: give a floor of
    yours 1. ``client`` and ``body`` are what PyBullet's functions take, ``joints`` is name → index."""

    engine = "pybullet"
    takes = "a client's id", "__index__"
    client: int
    body: int
    joints: dict[str, int]

    def __init__(self, about: Description, root: Root, into: Any, timestep_s: float) -> None:
        super().__init__(about, root)
        bullet, mu = engine_module("pybullet"), about.contact_friction
        self.bullet = bullet
        client = bullet.connect(bullet.DIRECT) if into is None else int(into)
        self.client, self.at = client, {"physicsClientId": client}
        at: dict[str, Any] = self.at
        if into is None:
            bullet.setGravity(*GRAVITY, **at)
            bullet.setTimeStep(timestep_s, **at)
            # Limits that were overshot are enforced; more rounds over joints and no early stop, or held lids creep.
            solver = {"useSplitImpulse": 0, "numNonContactInnerIterations": 4, "solverResidualThreshold": 1e-10}
            bullet.setPhysicsEngineParameter(**solver, **at)
            floor = bullet.createMultiBody(0.0, bullet.createCollisionShape(bullet.GEOM_PLANE, **at), **at)
            bullet.changeDynamics(floor, -1, lateralFriction=1.0, **at)
        # Else cylinders have 32 corners, over which a wheel does not roll.
        flags = bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_USE_SELF_COLLISION | bullet.URDF_USE_IMPLICIT_CYLINDER
        xyzw = (*root.wxyz[1:], root.wxyz[0])
        there = [bullet.getBodyInfo(bullet.getBodyUniqueId(i, **at), **at) for i in range(bullet.getNumBodies(**at))]
        self.name = free_name(root, about, {info[1].decode() for info in there}.__contains__)
        about.urdf.set("name", self.name)
        with copied_urdf(about.urdf) as path:
            body = bullet.loadURDF(path, root.position, xyzw, useFixedBase=root.fixed, flags=flags, **at)
        infos = [bullet.getJointInfo(body, index, **at) for index in range(bullet.getNumJoints(body, **at))]
        numbers = {about.root: -1} | {info[12].decode(): info[0] for info in infos}
        held = [pair for group in about.held_together for pair in combinations(group, 2)]
        for first, second in (*about.passing, *held):
            bullet.setCollisionFilterPair(body, body, numbers[first], numbers[second], 0, **at)
        joints = {info[1].decode(): info[0] for info in infos if info[2] != bullet.JOINT_FIXED}
        for index in range(-1, len(infos)):
            still = {"linearDamping": 0.0, "angularDamping": 0.0, "jointDamping": 0.0}
            bullet.changeDynamics(body, index, lateralFriction=mu, **still, **at)
        for joint in about.joints:
            index = joints[joint.name]
            bullet.changeDynamics(
                body, index, maxJointVelocity=1e6, **at
            )  # at 100 rad/s, friction stops every tiny part
            bullet.changeDynamics(
                body, index, jointDamping=joint.damping * (joint.armature * joint.stiffness == 0), **at
            )
            bullet.setJointMotorControl2(body, index, bullet.VELOCITY_CONTROL, force=joint.friction, **at)
            bullet.resetJointState(body, index, joint.initial_position, 0.0, **at)
            if joint.mimic is not None:  # the gear keeps the offset that the initial state has
                frames = (0, 0, 1), (0, 0, 0), (0, 0, 0)
                gear = bullet.createConstraint(
                    body, joints[joint.mimic[0]], body, index, bullet.JOINT_GEAR, *frames, **at
                )
                bullet.changeConstraint(gear, gearRatio=-joint.mimic[1], maxForce=1e4, erp=0.2, **at)
        self.body, self.joints, self.pushed, self.moved = body, joints, set[str](), dict[str, float]()
        self.places = [joints[name] for name in self.joint_names]
        self.weigh()
        self.links = {info[12].decode(): info[0] for info in infos}
        self.start = bullet.getBasePositionAndOrientation(body, **at)  # of the centre of mass, as it is set

    @property
    def timestep_s(self) -> float:
        return float(self.bullet.getPhysicsEngineParameters(**self.at)["fixedTimeStep"])

    def read(self) -> tuple[Any, Any]:
        states = [self.bullet.getJointState(self.body, index, **self.at) for index in self.places]
        return [state[0] for state in states], [state[1] for state in states]

    def write(self, positions: Mapping[str, float]) -> None:
        for name, value in positions.items():
            self.bullet.resetJointState(self.body, self.joints[name], value, 0.0, **self.at)
        self.weigh()

    def weigh(self) -> None:
        """Take the inertia of all that joints move, from the object as it is, where one has an armature."""
        if any(joint.armature > 0.0 for joint in self.about.joints):
            self.moved = carried_inertia(self.about.urdf, self.about.root, self.positions())

    def place(self) -> None:
        self.bullet.resetBasePositionAndOrientation(self.body, *self.start, **self.at)
        self.bullet.resetBaseVelocity(self.body, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), **self.at)

    def advance(self) -> object:
        return self.bullet.stepSimulation(**self.at)

    def push(self, efforts: Mapping[str, float]) -> None:
        bullet, body, joints, at = self.bullet, self.body, self.joints, self.at
        world = bullet.getPhysicsEngineParameters(**at)
        step, weight = float(world["fixedTimeStep"]), float(world["gravityAccelerationZ"]) / GRAVITY[2]
        for name in self.pushed - {name for name, effort in efforts.items() if effort}:
            rest = {"targetVelocity": 0.0, "force": next(one.friction for one in self.about.joints if one.name == name)}
            bullet.setJointMotorControl2(body, joints[name], bullet.VELOCITY_CONTROL, **rest, **at)
        self.pushed = {name for name, effort in efforts.items() if effort}
        for joint in (one for one in self.about.joints if one.stiffness > 0.0 or efforts.get(one.name)):
            position, speed, *_ = bullet.getJointState(body, joints[joint.name], **at)
            spring, effort = joint.stiffness * (joint.spring_reference - position), efforts.get(joint.name, 0.0)
            mode, control = bullet.TORQUE_CONTROL, {"force": spring + effort}
            if joint.armature > 0.0:
                # A torque would throw a key of 1 g: the joint's own step, armature included, gives a motor's target,
                # and what spring, damper and armature exert meanwhile, or stop and part bear, bounds the motor's force.
                damping = joint.damping if joint.stiffness > 0.0 else 0.0  # else it is the joint's own in PyBullet
                resists = (inertia := joint.armature + self.moved[joint.name]) + step * damping
                pulled = effort + joint.gravity_load * weight
                target = (inertia * speed + step * (spring + pulled)) / resists
                target -= math.copysign(min(abs(target), step * joint.friction / resists), target)
                if joint.lower is not None and joint.upper is not None:
                    low, high = min(joint.lower - position, 0.0), max(joint.upper - position, 0.0)
                    target = min(max(target, low / step), high / step)
                exerted = spring - damping * target - joint.armature * (target - speed) / step
                borne = self.moved[joint.name] * (target - speed) / step - pulled
                bound = 1.01 * max(abs(exerted), abs(spring), abs(borne)) + joint.friction
                mode, control = bullet.VELOCITY_CONTROL, {"targetVelocity": target, "force": bound}
            bullet.setJointMotorControl2(body, joints[joint.name], mode, **control, **at)

    def link_poses(self) -> dict[str, np.ndarray]:
        inertial = self.bullet.getDynamicsInfo(self.body, -1, **self.at)[3:5]
        to_frame = self.bullet.invertTransform(*inertial)
        at_com = self.bullet.getBasePositionAndOrientation(self.body, **self.at)
        frames = {self.about.root: self.bullet.multiplyTransforms(*at_com, *to_frame)}
        for name, index in self.links.items():
            state = self.bullet.getLinkState(self.body, index, computeForwardKinematics=1, **self.at)
            frames[name] = state[4:6]
        return {name: pose_matrix(place, (turned[3], *turned[:3])) for name, (place, turned) in frames.items()}

    def contacts(self) -> list[Contact]:
        names, found = {-1: self.about.root} | {index: name for name, index in self.links.items()}, []
        for _, one, other, mine, its, *_, where, _, _, force, _, _, _, _ in self.bullet.getContactPoints(
            bodyA=self.body, **self.at
        ):
            if force > 0.0:
                other_name = names[its] if one == other else self.named(other, its)
                found.append(Contact(names[mine], other_name, three_numbers(where), float(force)))
        return found

    def named(self, body: int, link: int) -> str:
        """Name by which PyBullet knows another body, or its link."""
        if link >= 0:
            return str(self.bullet.getJointInfo(body, link, **self.at)[12].decode())
        return self.bullet.getBodyInfo(body, **self.at)[1].decode() or f"body {body}"
