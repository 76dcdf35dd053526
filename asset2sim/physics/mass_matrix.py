"""The floating-base mass matrix of an articulated object, and what a joint feels: effective inertia and gravity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.arrays import Array
from asset2sim.kinematics import TreeJoint, link_to_root, subtree

GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class Body:
    """One link's mass (kg), (3,) centre of mass and (3, 3) inertia about it, in the link's frame."""

    mass: float
    com: Array
    inertia: Array


@dataclass(frozen=True)
class JointSpace:
    """The object at one pose. ``matrix`` is (6 + n, 6 + n): the free base's six, then the n movable joints in
    ``names``' order.

    ``gravity`` is (n,): the generalised force of gravity along -z of the root frame on each joint, N·m or N.
    """

    names: tuple[str, ...]
    matrix: Array
    gravity: Array

    def effective_inertia(self) -> dict[str, float]:
        """Joint → 1 / (M⁻¹)ⱼⱼ: the inertia that a torque on this joint alone accelerates, all else free, kg·m²
        or kg."""
        inverse = np.linalg.inv(self.matrix)
        return {name: float(1.0 / inverse[6 + i, 6 + i]) for i, name in enumerate(self.names)}

    def fastest_decay(self, damping: Mapping[str, float]) -> float:
        """The largest eigenvalue of M⁻¹ D over the joints, 1/s: explicit damping is stable while this times Δt
        is below 2."""
        terms = np.sqrt([damping.get(name, 0.0) for name in self.names])
        if not len(terms) or not terms.any():
            return 0.0
        block = np.linalg.inv(self.matrix)[6:, 6:]
        return float(np.linalg.eigvalsh(terms[:, None] * block * terms[None, :])[-1])


def joint_space(
    tree: Sequence[TreeJoint], root: str, bodies: Mapping[str, Body], positions: Mapping[str, float]
) -> JointSpace:
    """The mass matrix Σ m JᵥᵀJᵥ + JωᵀIJω over the links at these positions, all frames the root's."""
    movable = [joint for joint in tree if joint.type != "fixed"]
    poses = link_to_root(tree, root, positions)
    size = 6 + len(movable)
    matrix = np.zeros((size, size))
    gravity = np.zeros(len(movable))
    moved = {joint.name: set(subtree(tree, joint.name)) for joint in movable}
    axes, origins = [], []
    for joint in movable:
        frame = poses[joint.parent] @ joint.child_to_parent
        axes.append(frame[:3, :3] @ joint.axis)
        origins.append(frame[:3, 3])
    for name, body in bodies.items():
        pose = poses[name]
        com = pose[:3, :3] @ body.com + pose[:3, 3]
        linear, angular = np.zeros((3, size)), np.zeros((3, size))
        linear[:, :3] = np.eye(3)
        linear[:, 3:6] = -cross_matrix(com)
        angular[:, 3:6] = np.eye(3)
        for index, joint in enumerate(movable):
            if name not in moved[joint.name]:
                continue
            if joint.type == "prismatic":
                linear[:, 6 + index] = axes[index]
            else:
                linear[:, 6 + index] = np.cross(axes[index], com - origins[index])
                angular[:, 6 + index] = axes[index]
        inertia = pose[:3, :3] @ body.inertia @ pose[:3, :3].T
        matrix += body.mass * linear.T @ linear + angular.T @ inertia @ angular
        gravity -= body.mass * GRAVITY_M_S2 * linear[2, 6:]
    return JointSpace(tuple(joint.name for joint in movable), matrix, gravity)


def cross_matrix(vector: Array) -> Array:
    """(3, 3) matrix of v ×."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
