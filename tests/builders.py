"""Tiny URDFs, meshes and joint trees for tests, made where the test wants them and simple enough to compute by hand."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from asset2sim.assets.urdf.numbers import BIAS
from asset2sim.engines.pybullet_object import PyBulletItem
from asset2sim.engines.pybullet_world import PyBulletWorld
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, origin_transform
from schemas.base import Inertia6, Vector3
from schemas.features import JointFeatures
from schemas.mechanism import Bias

ORIGIN: Vector3 = (0.0, 0.0, 0.0)


def cylinder_inertia(mass: float, radius: float, length: float) -> Array:
    """(3, 3) inertia of a solid cylinder along z about its centre: m (3 r² + h²) / 12 across and m r² / 2 along."""
    across = mass * (3.0 * radius**2 + length**2) / 12.0
    diagonal: Array = np.diag([across, across, mass * radius**2 / 2.0])
    return diagonal


def is_physical(tensor: Array) -> bool:
    """Whether a tensor is positive definite and its principal moments obey the triangle inequality."""
    moments = np.linalg.eigvalsh(tensor)
    return bool(moments[0] > 0.0 and moments[2] <= (moments[0] + moments[1]) * (1.0 + 1e-9))


def ball_inertia(moment: float) -> Inertia6:
    """The same moment about every axis, kg·m²."""
    return (moment, 0.0, 0.0, moment, 0.0, moment)


CENTI = ball_inertia(0.01)


@dataclass(frozen=True)
class UrdfLink:
    """A link with an inertial, and collision shapes as (URDF geometry, its origin in the link's frame)."""

    name: str
    mass: float = 1.0
    com: Vector3 = ORIGIN
    inertia: Inertia6 = CENTI
    shapes: tuple[tuple[str, Vector3], ...] = ()


@dataclass(frozen=True)
class UrdfJoint:
    """A joint with its terms; ``reference`` is where its spring is relaxed, ``bias`` what a mechanism exerts."""

    name: str
    type: str
    parent: str
    child: str
    axis: Vector3 = (0.0, 0.0, 1.0)
    xyz: Vector3 = ORIGIN
    lower: float = -3.0
    upper: float = 3.0
    damping: float = 0.0
    friction: float = 0.0
    stiffness: float = 0.0
    reference: float = 0.0
    armature: float = 0.0
    bias: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)


def box(x: float, y: float, z: float) -> str:
    """A URDF box of these edge lengths, m."""
    return f'<box size="{x} {y} {z}"/>'


def sphere(radius: float) -> str:
    """A URDF sphere."""
    return f'<sphere radius="{radius}"/>'


def mesh(filename: str) -> str:
    """A URDF mesh reference."""
    return f'<mesh filename="{filename}"/>'


CUBE = ((box(0.1, 0.1, 0.1), ORIGIN),)
"""The shapes of a link that is a cube of 0.1 m."""


def write_urdf(folder: Path, links: Sequence[UrdfLink], joints: Sequence[UrdfJoint] = ()) -> Path:
    """Write ``object.urdf`` into the folder."""
    path = folder / "object.urdf"
    body = "".join([_link_text(link) for link in links] + [_joint_text(joint) for joint in joints])
    path.write_text(f'<robot name="object">{body}</robot>', encoding="utf-8")
    return path


def _words(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _link_text(link: UrdfLink) -> str:
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    moments = " ".join(f'{key}="{value!r}"' for key, value in zip(keys, link.inertia, strict=True))
    shapes = "".join(
        f'<collision><origin xyz="{_words(origin)}"/><geometry>{geometry}</geometry></collision>'
        for geometry, origin in link.shapes
    )
    return (
        f'<link name="{link.name}"><inertial><origin xyz="{_words(link.com)}"/><mass value="{link.mass!r}"/>'
        f"<inertia {moments}/></inertial>{shapes}</link>"
    )


def bias_of(joint: UrdfJoint) -> Bias | None:
    """Effort of the joint's mechanism, as an overlay has it; None without one."""
    terms = dict(zip(("slope", "none_at", "least", "most", "period"), joint.bias, strict=False))
    return Bias(kind="detent" if terms.get("period") else "seal", **terms) if joint.bias[0] != 0.0 else None


def _joint_text(joint: UrdfJoint) -> str:
    bias = " ".join(f'{name}="{value!r}"' for name, value in zip(BIAS, joint.bias, strict=False) if joint.bias[0])
    return (
        f'<joint name="{joint.name}" type="{joint.type}"><origin xyz="{_words(joint.xyz)}"/>'
        f'<parent link="{joint.parent}"/><child link="{joint.child}"/><axis xyz="{_words(joint.axis)}"/>'
        f'<limit lower="{joint.lower!r}" upper="{joint.upper!r}" effort="100" velocity="100"/>'
        f'<dynamics damping="{joint.damping!r}" friction="{joint.friction!r}" spring_stiffness="{joint.stiffness!r}" '
        f'spring_reference="{joint.reference!r}" armature="{joint.armature!r}" {bias}/></joint>'
    )


def swing(folder: Path, link: UrdfLink, **joint: object) -> Path:
    """One link on a joint ``j`` under a 10 kg base ``base`` without shapes; ``joint`` holds fields of ``UrdfJoint``."""
    base = UrdfLink("base", mass=10.0, inertia=ball_inertia(1.0))
    fields: dict[str, object] = {"name": "j", "type": "revolute", "parent": "base", "child": link.name}
    return write_urdf(folder, [base, link], [UrdfJoint(**(fields | joint))])  # type: ignore[arg-type]


def siblings(folder: Path, reach: float) -> Path:
    """Two boxes of 0.1 m on one root that overlap by ``reach`` along x with ``slide`` at zero."""
    links = [UrdfLink("root"), UrdfLink("left", shapes=CUBE), UrdfLink("right", shapes=CUBE)]
    joints = [
        UrdfJoint("other", "revolute", "root", "left", friction=1.0),
        UrdfJoint("slide", "prismatic", "root", "right", axis=(1.0, 0.0, 0.0), xyz=(0.1 - reach, 0.0, 0.0)),
    ]
    return write_urdf(folder, links, joints)


def block_urdf(folder: Path, size: Vector3 = (0.1, 0.1, 0.1), mass: float = 1.0, com: Vector3 = ORIGIN) -> Path:
    """One solid box."""
    x, y, z = (edge**2 for edge in size)
    inertia = (mass * (y + z) / 12, 0.0, 0.0, mass * (x + z) / 12, 0.0, mass * (x + y) / 12)
    return write_urdf(folder, [UrdfLink("block", mass, com, inertia, ((box(*size), ORIGIN),))])


def joint_track(item: PyBulletItem, seconds: float) -> Array:
    """(n + 1,) positions of the object's first joint over the next seconds, the present one first."""
    step = float(item.client.getPhysicsEngineParameters()["fixedTimeStep"])
    world = PyBulletWorld(item, step, plane=False)
    positions = [float(item.positions()[0])]
    for _ in range(round(seconds / step)):
        world.step()
        positions.append(float(item.positions()[0]))
    return np.array(positions)


def tree_joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    axis: Vector3 = (0.0, 0.0, 1.0),
    xyz: Vector3 = ORIGIN,
    rpy: Vector3 = ORIGIN,
) -> TreeJoint:
    """A joint of a tree, its axis made a unit vector."""
    direction = np.asarray(axis, dtype=float)
    return TreeJoint(name, kind, parent, child, origin_transform(xyz, rpy), direction / np.linalg.norm(direction))


def joint_features(
    name: str, kind: str, parent: str, child: str, xyz: Vector3 = ORIGIN, axis: Vector3 = (0, 0, 1)
) -> JointFeatures:
    """A joint as extraction reads it, without limits or dynamics."""
    return JointFeatures(
        name=name, type=kind, parent=parent, child=child, origin_xyz=xyz, origin_rpy=ORIGIN, axis=axis,
        axis_in_root=axis, lower=None, upper=None, effort=None, velocity=None, damping=None, friction=None, mimic=None,
        closed=None, open=None, openness_confidence=0.0,
    )  # fmt: skip


def corners(low: Vector3, high: Vector3) -> Array:
    """(8, 3) corners of a box."""
    return np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def standing_block(x: float, y: float, z: float) -> Array:
    """(8, 3) corners of a block of these edges that stands on the plane, centred over the origin."""
    return corners((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z))


def shifted(points: Array, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Array:
    """(n, 3) points moved."""
    moved: Array = points + np.array([x, y, z])
    return moved


def double_sided(shell: trimesh.Trimesh) -> trimesh.Trimesh:
    """Every face drawn a second time the other way round, on the same vertices."""
    return trimesh.Trimesh(shell.vertices, np.vstack([shell.faces, shell.faces[:, ::-1]]), process=False)


def without_top(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    """A box whose upper face (+z) is missing."""
    return trimesh.Trimesh(solid.vertices, solid.faces[solid.face_normals[:, 2] < 0.5], process=False)


def loose_sides(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    """The same box drawn as six quads that share no vertex."""
    sides = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            faces = solid.faces[sign * solid.face_normals[:, axis] > 0.5]
            used, renumbered = np.unique(faces, return_inverse=True)
            sides.append(trimesh.Trimesh(solid.vertices[used], renumbered.reshape(-1, 3), process=False))
    return joined(*sides)


def joined(*shells: trimesh.Trimesh) -> trimesh.Trimesh:
    """Several shells in one mesh, no vertex merged."""
    offsets = np.cumsum([0, *(len(shell.vertices) for shell in shells)])
    faces = [shell.faces + offset for shell, offset in zip(shells, offsets, strict=False)]
    return trimesh.Trimesh(np.vstack([shell.vertices for shell in shells]), np.vstack(faces), process=False)
