"""The Franka Panda arm with a gripper, from PyBullet's data package: a MuJoCo specification, and its kinematics."""

import importlib.util
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from asset2sim.gym.arm.gripper import PANDA, ROBOTIQ, Gripper, add_robotiq, drive
from asset2sim.physics.arrays import Array
from schemas.errors import UsageError

JOINTS = tuple(f"panda_joint{index}" for index in range(1, 8))
FINGERS = ("panda_finger_joint1", "panda_finger_joint2")
HAND = "panda_hand"
OWN_HAND = (HAND, "panda_leftfinger", "panda_rightfinger", "panda_grasptarget")
"""Links of the arm's own gripper, the first the frame on which any is mounted."""
HOME = np.array([0.0, -0.75, 0.0, -2.35, 0.0, 1.6, 0.785])
"""Joint positions, rad, at which the arm waits: the hand points down in front of its base."""
STIFFNESS = (500.0, 500.0, 500.0, 500.0, 200.0, 200.0, 100.0)
"""Of the position servos, N·m/rad; their damping is critical for the inertia that they move (``DAMPING``)."""
DAMPING = (60.0, 60.0, 60.0, 60.0, 20.0, 20.0, 8.0)
TORQUE = (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)
"""The arm's limits, N·m, as its URDF states them."""
ARMATURE = 0.1
"""Reflected inertia of a motor and gear, kg·m²."""
GRIP_N = 40.0
"""Force of a finger, N: below the 70 N that the gripper can keep up."""
FRICTION = 1.0
"""Friction coefficient of the rubber finger tips."""
STEPS, STEP_RAD, DAMPED = 60, 0.25, 0.05
"""Inverse kinematics: iterations at most, the largest change of a joint in one, and the damping of least squares."""


def waiting(gripper: Gripper = PANDA) -> Array:
    """Commands to the servos of arm and gripper while the arm waits, the fingers closed."""
    return np.concatenate([HOME, gripper.servos(np.zeros(1))[0]])


def franka_tree(gripper: Gripper = PANDA) -> ET.Element:
    """The arm's URDF, mesh paths absolute. UsageError where PyBullet's data lacks it, or robosuite's its gripper."""
    spec = importlib.util.find_spec("pybullet_data")
    folder = Path(spec.origin or "").parent / "franka_panda" if spec else Path()
    file = folder / "panda.urdf"
    if not file.is_file():
        raise UsageError(
            "the arm's model is missing, which PyBullet brings (pybullet_data/franka_panda): pip install "
            "'asset2sim[bullet]' on Python 3.11; on a later one `pip install pybullet` has to compile it"
        )
    tree = ET.parse(file).getroot()
    for mesh in tree.iter("mesh"):
        mesh.set("filename", str(folder / str(mesh.get("filename")).removeprefix("package://")))
    if gripper is ROBOTIQ:
        for joint in tree.findall("joint"):
            child = joint.find("child")
            if child is not None and child.get("link") in OWN_HAND[1:]:
                tree.remove(joint)
        for link in tree.findall("link"):
            if link.get("name") == HAND:
                link[:] = []
            elif link.get("name") in OWN_HAND:
                tree.remove(link)
        add_robotiq(tree, HAND)
    return tree


def franka_spec(gripper: Gripper = PANDA) -> mujoco.MjSpec:
    """The arm as a specification whose position servos hold its weight; its base is at the origin. No part of it
    touches another: contacts are with what is not the arm."""
    tree = franka_tree(gripper)
    for link in tree.findall("link"):
        link[:] = [element for element in link if element.tag != "visual"]
    settings = {"strippath": "false", "fusestatic": "false", "discardvisual": "false", "balanceinertia": "true"}
    ET.SubElement(ET.SubElement(tree, "mujoco"), "compiler", settings)
    spec = mujoco.MjSpec.from_string(ET.tostring(tree, encoding="unicode"))
    for body in spec.bodies[1:]:
        body.gravcomp = 1.0
    for geom in spec.geoms:
        geom.contype, geom.conaffinity, geom.condim = 2, 1, 4
        geom.friction = (FRICTION, 5e-3, 1e-4)
    for name, stiffness, damping, torque in zip(JOINTS, STIFFNESS, DAMPING, TORQUE, strict=True):
        spec.joint(name).armature = ARMATURE
        servo(spec, name, stiffness, damping, torque)
    for name in FINGERS if gripper is PANDA else ():
        spec.joint(name).armature = 0.05
        servo(spec, name, 4000.0, 60.0, GRIP_N)
    if gripper is ROBOTIQ:
        drive(spec)
    return spec


def servo(spec: mujoco.MjSpec, joint: str, stiffness: float, damping: float, most: float) -> None:
    """Give a joint an actuator of this stiffness, damping and force (N·m/rad, N·m·s/rad, N·m; or N/m, N·s/m, N)."""
    made = spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    made.gaintype, made.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    made.gainprm[0], made.biasprm[1], made.biasprm[2] = stiffness, -stiffness, -damping
    made.forcelimited, made.forcerange = mujoco.mjtLimited.mjLIMITED_TRUE, (-most, most)


@dataclass(frozen=True, eq=False)
class ArmPose:
    """Joint positions (rad) at which the tool is where it should be, but for ``off_m`` and ``tilt_rad``."""

    joints: Array
    off_m: float
    tilt_rad: float


class Arm:
    """The arm alone, for its kinematics: nothing moves in it."""

    def __init__(self, gripper: Gripper = PANDA) -> None:
        self.gripper = gripper
        self.model = franka_spec(gripper).compile()
        self.data = mujoco.MjData(self.model)
        self.hand = int(self.model.body(HAND).id)
        self.places = np.array([int(self.model.joint(name).qposadr[0]) for name in JOINTS])
        self.lower, self.upper = np.array([self.model.joint(name).range for name in JOINTS]).T + np.array(
            [[0.02], [-0.02]]
        )

    def tool(self, joints: Array) -> tuple[Array, Array]:
        """The point between the finger tips, m, and the hand's (3, 3) axes, in the base's frame; z points to the tips,
        y is along which the fingers move."""
        self.data.qpos[self.places] = joints
        mujoco.mj_kinematics(self.model, self.data)
        axes = self.data.xmat[self.hand].reshape(3, 3).copy()
        return self.data.xpos[self.hand] + self.gripper.tip_m * axes[:, 2], axes

    def reach(self, point: Array, axis: Array, start: Array, across: Array | None = None) -> ArmPose:
        """Joint positions near ``start`` that bring the tool to a point (m, base frame), its z axis along ``axis`` and,
        if given, its y axis along ``across`` or against it, by damped least squares."""
        joints, size = np.clip(start, self.lower, self.upper), 6
        jacobian_p, jacobian_r = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        off, tilt = np.inf, np.inf
        for _ in range(STEPS):
            at, axes = self.tool(joints)
            error = np.zeros(size)
            error[:3] = point - at
            error[3:] = np.cross(axes[:, 2], axis)
            if axes[:, 2] @ axis < 0.0:  # over a right angle the cross product shrinks again
                error[3:] /= max(float(np.linalg.norm(error[3:])), 1e-6)
            if across is not None:
                along = across if axes[:, 1] @ across >= 0.0 else -across
                error[3:] += np.cross(axes[:, 1], along)
            off = float(np.linalg.norm(error[:3]))
            tilt = float(np.linalg.norm(error[3:]))
            if off < 5e-4 and tilt < 0.01:
                break
            mujoco.mj_comPos(self.model, self.data)
            mujoco.mj_jac(self.model, self.data, jacobian_p, jacobian_r, at, self.hand)
            turning = jacobian_r[:, :7]
            if across is None:  # turning about the tool's own axis is free
                turning = turning - np.outer(axes[:, 2], axes[:, 2] @ turning)
            whole = np.concatenate([jacobian_p[:, :7], 0.3 * turning])
            error[3:] *= 0.3
            inner = whole @ whole.T + (DAMPED**2 * 0.04 + 1e-6) * np.eye(size)
            pseudo = whole.T @ np.linalg.inv(inner)
            change = pseudo @ error + (np.eye(7) - pseudo @ whole) @ (0.02 * (HOME - joints))
            change *= min(1.0, STEP_RAD / max(float(np.abs(change).max()), 1e-9))
            joints = np.clip(joints + change, self.lower, self.upper)
        at, axes = self.tool(joints)
        tilt = float(np.arccos(np.clip(axes[:, 2] @ axis, -1.0, 1.0)))
        return ArmPose(joints, float(np.linalg.norm(point - at)), tilt)
