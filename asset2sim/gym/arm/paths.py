"""Where a tool goes: its points and directions through a task, planned from the object's geometry alone."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import mujoco
import numpy as np

from asset2sim.gym.arm.scene import CompiledScene, place_joints
from asset2sim.gym.arm.tasks import Verb
from asset2sim.gym.world import body_pose, welded_bodies
from asset2sim.physics.arrays import Array
from schemas.overlay import JointPhysics

PRESSED_M = 0.004
"""How far beyond the surface the tool is led, so that it pushes."""
CLEAR_M = 0.07
"""Distance from the surface from which the tool sets out, and to which it goes back."""
PACE_M = 0.006
"""Distance between two points of a push, m."""
BEYOND_M = 0.004
"""How far a push is led beyond where the part stops."""
ALONG = (0.5, 0.3, 0.7, 0.15, 0.85)
"""Where along the axis, shares of the part's extent, a place to push at is looked for, best first."""
OUT = (0.88, 0.95, 0.75, 0.6)
"""How far from the axis, shares of the part's reach."""
LEANS = (0.35, 0.0, 0.7, 1.0)
"""Directions of the fingers: 0 down, 1 along the push."""


@dataclass(frozen=True, eq=False)
class ToolPath:
    """A tool's way in the object's world: (n, 3) ``points``, m, (n, 3) ``axes`` to which the fingers point, (n, 3)
    ``across`` along which they open, or None where that is free, (n,) ``opening`` of the fingers, m, and the
    ``phases``."""

    points: Array
    axes: Array
    across: Array | None
    opening: Array
    phases: tuple[str, ...]
    positions: Array
    """(n,) where the task's joint is meanwhile, rad or m; zeros where there is none."""


def push_paths(stage: CompiledScene, joint: JointPhysics, target: float, verb: Verb) -> Iterator[ToolPath]:
    """Ways to push a part from where it starts to a target, each at another place or with another hand, best first.
    None where no place of the part can be seen from the side that must be pushed."""
    body = int(stage.model.jnt_bodyid[stage.joint(joint.name)])
    start = stage.about.positions_at()[joint.name]
    for contact, normal in pushed_places(stage, joint, body, math.copysign(1.0, start - target)):
        for lean in LEANS:
            path = push_path(stage, joint, body, contact, normal, (start, target), lean, verb)
            if path is not None:
                yield path


def pushed_places(stage: CompiledScene, joint: JointPhysics, body: int, away: float) -> Iterator[tuple[Array, Array]]:
    """Places of a part and the directions away from it there, m, world, in which it moves when its joint goes ``away``
    (1 or -1): found by rays from that side."""
    number = stage.joint(joint.name)
    axis, anchor = stage.data.xaxis[number].copy(), stage.data.xanchor[number].copy()
    bodies = welded_bodies(stage.model, body)
    points = vertices(stage, bodies) - anchor
    if not len(points):
        return
    along = points @ axis
    if joint.type == "prismatic":
        normal = away * axis
        flat = points - np.outer(along, axis)
        low, high = flat.min(axis=0), flat.max(axis=0)
        up = np.array([0.0, 0.0, 1.0])
        side = np.cross(up, axis)
        for height, across in product((0.0, 0.2, -0.2), (0.0, 0.25, -0.25)):
            middle = (
                anchor + (low + high) / 2.0 + (height * up * np.ptp(flat @ up) + across * side * np.ptp(flat @ side))
            )
            yield from first_hit(stage, bodies, middle + axis * along.mean(), normal, float(np.ptp(along)))
        return
    radial = points - np.outer(along, axis)
    outward = (radial * np.linalg.norm(radial, axis=1, keepdims=True)).sum(axis=0)
    outward /= max(float(np.linalg.norm(outward)), 1e-9)
    reach = float((radial @ outward).max())
    normal = away * np.cross(axis, outward)
    for out, share in product(OUT, ALONG):
        place_at = anchor + axis * (along.min() + share * np.ptp(along)) + outward * out * reach
        yield from first_hit(stage, bodies, place_at, normal, float(np.ptp(radial @ normal)))


def first_hit(
    stage: CompiledScene, bodies: frozenset[int], middle: Array, normal: Array, thick: float
) -> Iterator[tuple[Array, Array]]:
    """The first place of these bodies that a ray against ``normal`` through a point meets, if no other's is before."""
    source = middle + normal * (thick + CLEAR_M)
    distance, geom = stage.first_met(source, -normal)
    if distance < math.inf and int(stage.model.geom_bodyid[geom]) in bodies:
        yield source - normal * distance, normal


def vertices(stage: CompiledScene, bodies: frozenset[int]) -> Array:
    """(n, 3) vertices of the collision shapes of these bodies, m, world."""
    model, data, found = stage.model, stage.data, []
    for geom in range(model.ngeom):
        if int(model.geom_bodyid[geom]) not in bodies:
            continue
        mesh = int(model.geom_dataid[geom])
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH and mesh >= 0:
            first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            local = model.mesh_vert[first : first + count]
        else:
            local = model.geom_aabb[geom, :3] + model.geom_aabb[geom, 3:] * np.array(list(product((-1, 1), repeat=3)))
        found.append(local @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    return np.concatenate(found) if found else np.zeros((0, 3))


def push_path(
    stage: CompiledScene, joint: JointPhysics, body: int, contact: Array, normal: Array, way: tuple[float, float],
    lean: float,
    verb: Verb,
) -> ToolPath | None:  # fmt: skip
    """The way of a push at one place: to it, along with the part, further, and back. None with fingers upwards."""
    start, target = way
    name = joint.name
    place_joints(stage, {name: start})
    here = body_pose(stage.data, body)
    local, local_normal = here[:3, :3].T @ (contact - here[:3, 3]), here[:3, :3].T @ normal
    arm = float(np.linalg.norm(contact - stage.data.xanchor[stage.joint(name)]))
    length = abs(target - start) * (1.0 if joint.type == "prismatic" else max(arm, 0.02))
    count = max(4, math.ceil(length / PACE_M))
    points, normals, at = [], [], []
    for share in np.linspace(0.0, 1.0, count):
        position = start + share * (target - start)
        place_joints(stage, {name: position})
        pose = body_pose(stage.data, body)
        normals.append(pose[:3, :3] @ local_normal)
        points.append(pose[:3, :3] @ local + pose[:3, 3] + normals[-1] * (stage.gripper.finger_m - PRESSED_M))
        at.append(position)
    place_joints(stage, {name: start})
    points.append(points[-1] - normals[-1] * BEYOND_M)
    normals.append(normals[-1])
    at.append(target)
    first, last = points[0] + normals[0] * CLEAR_M, points[-1] + normals[-1] * (CLEAR_M + BEYOND_M)
    route = np.array([first, *points, last])
    facing = np.array([normals[0], *normals, normals[-1]])
    axes = -lean * facing + np.array([0.0, 0.0, -(1.0 - lean)])
    axes /= np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-9)
    if (axes[:, 2] > 0.2).any():
        return None
    phases = ("approach", *[verb.value] * len(points), "retreat")
    return ToolPath(route, axes, None, np.zeros(len(route)), phases, np.array([start, *at, target]))
