"""The floating-base mass matrix of an articulated object, with each joint's effective inertia and gravity force."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.inertia import tensor_of
from asset2sim.physics.kinematics import TreeJoint, apply, link_to_root, rigid_links
from schemas.overlay import PhysicsOverlay

GRAVITY_M_S2 = 9.81
"""Along -z of the root frame, and of every engine's world."""


@dataclass(frozen=True)
class Pull:
    """Gravity's generalised force (N·m or N, towards larger positions) at ``position`` (rad or m), and its slope."""

    position: float
    force: float
    slope: float = 0.0
    prismatic: bool = False

    def at(self, positions: Array | float) -> Array:
        """(n,) the force at these positions: F cos δ + F' sin δ about a hinge, δ the angle from ``position``."""
        if self.prismatic:
            constant: Array = np.full(np.shape(positions), self.force)
            return constant
        angle = np.asarray(positions, dtype=float) - self.position
        wave: Array = self.force * np.cos(angle) + self.slope * np.sin(angle)
        return wave


@dataclass(frozen=True)
class Body:
    """One link's mass (kg), (3,) centre of mass and (3, 3) inertia about it, in the link's frame."""

    mass: float
    com: Array
    inertia: Array


def bodies_of(overlay: PhysicsOverlay) -> dict[str, Body]:
    """Link → its body, as an overlay has them."""
    return {link.name: Body(link.mass_kg, np.asarray(link.com), tensor_of(link.inertia)) for link in overlay.links}


@dataclass(frozen=True)
class JointSpace:
    """Joint-space dynamics at one pose; ``matrix``, (6 + n, 6 + n), has the free base's six, then the n ``names``.

    ``gravity`` is (n,): its generalised force along -z of the root frame on each joint, N·m or N; ``pulls`` how that
    changes as the joint alone moves; ``largest_gravity``, (n,), its largest magnitude over all directions of gravity.
    Where the base is ``held``, joints accelerate what they move on it.
    """

    names: tuple[str, ...]
    matrix: Array
    gravity: Array
    pulls: tuple[Pull, ...]
    largest_gravity: Array
    held: bool = False

    @cached_property
    def mobility(self) -> Array:
        """(n, n) acceleration of each joint per unit force on each, the other joints free, and the base unless held."""
        if self.held:
            return np.asarray(np.linalg.inv(self.matrix[6:, 6:]), dtype=np.float64)
        return np.asarray(np.linalg.inv(self.matrix)[6:, 6:], dtype=np.float64)

    def geared(self, armature: Mapping[str, float]) -> "JointSpace":
        """The same with these reflected inertias (kg·m² or kg) on the joints' diagonal, as engines add armature."""
        added = [armature.get(name, 0.0) for name in self.names]
        return replace(self, matrix=self.matrix + np.diag(np.concatenate([np.zeros(6), added])))

    def effective_inertia(self) -> dict[str, float]:
        """Joint → 1 / (M⁻¹)ⱼⱼ: the inertia that a torque on it alone accelerates, kg·m² or kg."""
        return {name: float(1.0 / self.mobility[i, i]) for i, name in enumerate(self.names)}

    def held_inertia(self) -> dict[str, float]:
        """Joint → Mⱼⱼ: what it moves while the root is held and every other joint stays, kg·m² or kg."""
        return {name: float(self.matrix[6 + i, 6 + i]) for i, name in enumerate(self.names)}

    def fastest_decay(self, terms: Mapping[str, float]) -> float:
        """The largest eigenvalue of M⁻¹ D over the joints, D having these terms on its diagonal.

        For damping, in 1/s: stepped explicitly, it is stable while this times Δt is below 2. For stiffness, in 1/s²:
        a spring stepped explicitly is stable while this times Δt² is below 4.
        """
        roots = np.sqrt([terms.get(name, 0.0) for name in self.names])
        if not len(roots) or not roots.any():
            return 0.0
        return float(np.linalg.eigvalsh(roots[:, None] * self.mobility * roots[None, :])[-1])


def joint_space(
    tree: Sequence[TreeJoint], root: str, bodies: Mapping[str, Body], positions: Mapping[str, float], held: bool = False
) -> JointSpace:
    """The mass matrix Σ m JᵥᵀJᵥ + JωᵀIJω over the links at these positions, all frames the root's. A joint that follows
    another has a row of its own: what is derived for each adds up through the ratio."""
    movable = [joint for joint in tree if joint.type != "fixed"]
    poses = link_to_root(tree, root, positions)
    count, size = len(movable), 6 + len(movable)
    names = list(bodies)
    moved = [set(rigid_links(tree, joint.name)) for joint in movable]
    carried = np.array([[name in links for name in names] for links in moved], dtype=float)
    carried = carried.reshape(count, len(names))
    frames = [poses[joint.parent] @ joint.child_to_parent for joint in movable]
    axes = np.array([frame[:3, :3] @ joint.axis for frame, joint in zip(frames, movable, strict=True)]).reshape(-1, 3)
    origins = np.array([frame[:3, 3] for frame in frames]).reshape(-1, 3)
    slides = np.array([joint.type == "prismatic" for joint in movable], dtype=bool)

    mass = np.array([body.mass for body in bodies.values()])
    turns = np.array([poses[name][:3, :3] for name in names])
    coms = np.array([poses[name][:3, :3] @ body.com + poses[name][:3, 3] for name, body in bodies.items()])
    inertias = turns @ np.array([body.inertia for body in bodies.values()]) @ turns.transpose(0, 2, 1)

    linear, angular = np.zeros((len(names), 3, size)), np.zeros((len(names), 3, size))
    linear[:, :, :3] = np.eye(3)
    linear[:, :, 3:6] = -np.array([cross_matrix(com) for com in coms])
    angular[:, :, 3:6] = np.eye(3)
    if count:
        arms = np.cross(axes[None, :, :], coms[:, None, :] - origins[None, :, :])
        along = np.where(slides[None, :, None], axes[None, :, :], arms) * carried.T[:, :, None]
        linear[:, :, 6:] = along.transpose(0, 2, 1)
        about = np.where(slides[:, None], 0.0, axes)[None, :, :] * carried.T[:, :, None]
        angular[:, :, 6:] = about.transpose(0, 2, 1)
    rows = (np.sqrt(mass)[:, None, None] * linear).reshape(-1, size)
    matrix = rows.T @ rows + np.einsum("bik,bij,bjl->kl", angular, inertias, angular, optimize=True)
    gravity: Array = -GRAVITY_M_S2 * (mass[:, None] * linear[:, 2, 6:]).sum(axis=0)
    largest_gravity: Array = GRAVITY_M_S2 * np.linalg.norm((mass[:, None, None] * linear[:, :, 6:]).sum(axis=0), axis=0)

    moments = carried @ (mass[:, None] * coms) - (carried @ mass)[:, None] * origins
    pulls = []
    for index, joint in enumerate(movable):
        # About the axis, gravity's torque is a sinusoid of the angle; its slope is that of the lever turned by 90°.
        turned = np.cross(axes[index], np.cross(axes[index], moments[index]))
        slope = 0.0 if slides[index] else float(-GRAVITY_M_S2 * turned[2])
        pulls.append(Pull(joint.position(positions), float(gravity[index]), slope, bool(slides[index])))
    return JointSpace(tuple(joint.name for joint in movable), matrix, gravity, tuple(pulls), largest_gravity, held)


def cross_matrix(vector: Array) -> Array:
    """(3, 3) matrix of v ×."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


@dataclass(frozen=True)
class PosedObject:
    """An object with joints at ``positions`` (rad or m): its joint tree, the bodies of its links, and each link's
    (n, 3) points in its own frame, m."""

    tree: Sequence[TreeJoint]
    root: str
    bodies: Mapping[str, Body]
    points: Mapping[str, Array]
    positions: Mapping[str, float]

    @cached_property
    def poses(self) -> dict[str, Array]:
        """Link → (4, 4) link-to-root transform."""
        return link_to_root(self.tree, self.root, self.positions)

    @cached_property
    def clouds(self) -> dict[str, Array]:
        """Link → its points in the root's frame, m, of links that have any."""
        return {name: apply(self.poses[name], cloud) for name, cloud in self.points.items() if len(cloud)}

    @property
    def cloud(self) -> Array:
        """(n, 3) points of all links in the root's frame, m; the origin where there are none."""
        return np.vstack(list(self.clouds.values())) if self.clouds else np.zeros((1, 3))

    @property
    def mass(self) -> float:
        """Mass of the object, kg."""
        return sum(body.mass for body in self.bodies.values())

    @property
    def center(self) -> Array:
        """(3,) centre of mass in the root's frame, m."""
        poses = self.poses
        moment = sum(item.mass * (poses[n][:3, :3] @ item.com + poses[n][:3, 3]) for n, item in self.bodies.items())
        return np.asarray(moment / self.mass)

    def at(self, positions: Mapping[str, float]) -> "PosedObject":
        """The same object with joints at other positions."""
        return replace(self, positions=positions)
