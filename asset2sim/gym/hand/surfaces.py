"""Places on the collision shapes of a part, and how thick it is there."""

import math
from collections.abc import Callable
from itertools import product

import mujoco
import numpy as np
import trimesh
from numpy.typing import NDArray

from asset2sim.gym.hand.gripper import FINGER, ROOM_M, HandWorld
from asset2sim.physics.arrays import Array
from schemas.hand_settings import FINGERTIP_M

SAMPLES = 600
"""Places of a part at which a hold is looked for."""
OFF_M, REACH_M = 0.0005, 1.0
"""Distance of a finger from what it will push, and length of the arm behind a hand, m."""
OPPOSITE = 0.8
"""Least cosine between the normals of both sides of what two fingers hold: friction of 0.8 holds up to 39°."""
PADS_M = np.array([(x, z) for x in (-0.006, 0.0, 0.006) for z in (-0.005, 0.002, 0.009)])
"""Places on a pad, across it and towards the tip, m."""
FRONT, SKIP_M = 0.6, 1e-6
"""Least cosine between a part's way and the inner normal of its front, and step past a shape that is its own, m."""
LOOKS, LEVER, FEW = 24, 0.3, 0.01
"""Directions in which a place looks out, share of the longest lever at which no hand pulls, and share of a part's
places that are no hold: what sees out through seams of convex pieces."""


def surface_places(world: HandWorld, bodies: frozenset[int]) -> tuple[Array, Array, NDArray[np.int64]]:
    """(n, 3) places on the collision shapes of these bodies and (n, 3) outward normals there, world, and their bodies:
    as many of each shape, on faces by the root of their areas, so that small faces have theirs."""
    model, data = world.model, world.data
    geoms = shapes_of(model, bodies)
    rng = np.random.default_rng(0)
    found: list[tuple[Array, Array, Array]] = []
    for geom in geoms:
        places, units = on_shape(model, geom, max(12, SAMPLES // len(geoms)), rng)
        turn, owners = data.geom_xmat[geom].reshape(3, 3), np.full(len(places), model.geom_bodyid[geom])
        found.append((places @ turn.T + data.geom_xpos[geom], units @ turn.T, owners))
    if not found:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, dtype=int)
    points, normals, owners = (np.concatenate(part) for part in zip(*found, strict=True))
    chosen = rng.permutation(len(points))[: 2 * SAMPLES]
    return points[chosen], normals[chosen], owners[chosen].astype(int)


def shapes_of(model: mujoco.MjModel, bodies: frozenset[int]) -> list[int]:
    """The collision shapes of these bodies."""
    return [geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in bodies and model.geom_contype[geom]]


def on_shape(model: mujoco.MjModel, geom: int, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """(n, 3) places on a collision shape and (n, 3) outward normals, in its frame: ``count``, or none of a plane."""
    triangles = triangles_of(model, geom)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    if not (areas > 0.0).any():
        return np.zeros((0, 3)), np.zeros((0, 3))
    weights = np.sqrt(areas)
    chosen = rng.choice(len(areas), size=count, p=weights / weights.sum())
    first, second = rng.random((2, len(chosen)))
    over = first + second > 1.0
    first[over], second[over] = 1.0 - first[over], 1.0 - second[over]
    corner, one, two = triangles[chosen].transpose(1, 0, 2)
    places = corner + first[:, None] * (one - corner) + second[:, None] * (two - corner)
    return places, normals[chosen] / areas[chosen, None]


def places_inside(world: HandWorld, bodies: frozenset[int], near: Array, off_m: float) -> Array:
    """(n, 3) places in the collision shapes of these bodies, world, no further than ``off_m`` along each axis from the
    box of the (k, 3) places ``near``: half of them on the surface."""
    model, data, rng = world.model, world.data, np.random.default_rng(0)
    geoms, found = shapes_of(model, bodies), [np.zeros((0, 3))]
    for geom in geoms:
        places = on_shape(model, geom, max(24, 4 * SAMPLES // len(geoms)), rng)[0]
        shares = np.maximum(rng.uniform(-1.0, 1.0, (len(places), 1)), 0.0)
        places = places + shares * (np.roll(places, 1, axis=0) - places)  # MuJoCo's shapes are convex
        found.append(places @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
    points = np.concatenate(found)
    points = points[((points > near.min(axis=0) - off_m) & (points < near.max(axis=0) + off_m)).all(axis=1)]
    return np.asarray(rng.permutation(points)[:SAMPLES])


def triangles_of(model: mujoco.MjModel, geom: int) -> Array:
    """(n, 3, 3) triangles of a collision shape in its own frame, m."""
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        begin, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
        return np.asarray(model.mesh_vert[first : first + count][model.mesh_face[begin : begin + faces]], dtype=float)
    if kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        return np.asarray(trimesh.creation.cylinder(size[0], 2.0 * size[1], sections=16).triangles)
    if kind in (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_ELLIPSOID):
        return np.asarray(trimesh.creation.icosphere(2).triangles * np.where(size > 0.0, size, size[0]))
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return np.asarray(trimesh.creation.capsule(2.0 * size[1], size[0], count=(8, 12)).triangles)
    return np.asarray(trimesh.creation.box(2.0 * size).triangles)


def places_before_back(
    world: HandWorld, points: Array, normals: Array, bodies: frozenset[int], most: float
) -> tuple[NDArray[np.int64], Array]:
    """Of these places, those behind which the other side of the same part is no further than ``most``, m, and faces
    away, so that it does not slip out of two fingers, and how far it is: a ray comes from beyond."""
    kept, widths, geom, facing = [], [], np.array([-1], dtype=np.int32), np.zeros(3)
    for index, (point, normal) in enumerate(zip(points, normals, strict=True)):
        source = point - normal * (most + ROOM_M)
        distance = mujoco.mj_ray(world.model, world.data, source, normal, None, 1, -1, geom, facing)
        if distance > 0.0 and int(world.model.geom_bodyid[geom[0]]) in bodies and facing @ normal < -OPPOSITE:
            width = most + ROOM_M - distance
            if width > 0.0008:
                kept.append(index)
                widths.append(width)
    return np.array(kept, dtype=int), np.array(widths)


def share_between_pads(world: HandWorld, pose: Array, half_open_m: float, bodies: frozenset[int]) -> float:
    """Share of its pads, by nine rays, between which a hand at a (4, 4) pose, so far open, has these bodies."""
    found = 0
    for x, z in PADS_M * world.scale:
        distance, geom = world.first_met(pose[:3, 3] + pose[:3, :3] @ (x, -half_open_m, z), pose[:3, 1], world.body)
        found += distance < 2.0 * half_open_m and int(world.model.geom_bodyid[geom]) in bodies
    return found / len(PADS_M)


def meets_first(world: HandWorld, pose: Array, half_open_m: float, bodies: frozenset[int]) -> bool:
    """Whether what both fingers meet first of the object as they close belongs to these bodies: rays from their faces,
    from no further apart than a fingertip's width."""
    tool = world.tool
    x = np.linspace(-1.0, 1.0, 2 * math.ceil(tool.finger[0] / FINGERTIP_M) + 1) * tool.finger[0]
    z = tool.tip_m - np.linspace(0.0, 2.0, 2 * math.ceil(tool.finger[2] / FINGERTIP_M) + 1) * tool.finger[2]
    for side in (1.0, -1.0):
        places = [pose[:3, 3] + pose[:3, :3] @ (across, side * half_open_m, along) for across, along in product(x, z)]
        met = [world.first_met(place, -side * pose[:3, 1], world.body) for place in places]
        if int(world.model.geom_bodyid[min(met)[1]]) not in bodies:
            return False
    return True


def share_of_rubbing(world: HandWorld, pose: Array, into: Array, bodies: frozenset[int]) -> float:
    """Share of nine places on a finger at a (4, 4) pose from which these bodies lie ahead within its press, (3,), m."""
    found, length = 0, float(np.linalg.norm(into))
    ahead = into / length
    tips = abs(float(ahead @ pose[:3, 2])) > abs(float(ahead @ pose[:3, 1]))  # it points at what it rubs, or lies along
    for x, z in PADS_M * world.scale:
        off = (x, z, world.tool.tip_m) if tips else (x, -2.0 * world.tool.finger[1], z)
        distance, geom = world.first_met(pose[:3, 3] + pose[:3, :3] @ off, ahead, world.body)
        found += distance < length and int(world.model.geom_bodyid[geom]) in bodies
    return found / len(PADS_M)


def is_covered(world: HandWorld, bodies: frozenset[int]) -> bool:
    """Whether no place of a part sees out, each in another direction: it is inside, and no hand gets to it."""
    points, normals, _ = surface_places(world, bodies)
    directions = np.random.default_rng(0).normal(size=points.shape)
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    directions *= np.sign(np.einsum("ij,ij->i", directions, normals))[:, None]
    return all(
        world.first_met(place, out, world.body)[0] < REACH_M
        for place, out in zip(points + OFF_M * normals, directions, strict=True)
    )


def is_flush(world: HandWorld, bodies: frozenset[int], velocity: Callable[[Array], Array]) -> bool:
    """Whether a part offers a hand nothing but its front, away from its hinge, as the velocities of its (n, 3) places
    say: hardly anywhere beside or behind it has a finger tip room and sees out, so that nothing pulls it open."""
    points, normals, _ = surface_places(world, bodies)
    way = velocity(points)
    speeds = np.linalg.norm(way, axis=1)
    beside = (np.einsum("ij,ij->i", normals, way) < FRONT * speeds) & (speeds > LEVER * speeds.max(initial=0.0))
    looks = np.random.default_rng(0).normal(size=(LOOKS, 3))
    looks /= np.linalg.norm(looks, axis=1)[:, None]

    def is_free(place: Array, towards: Array, length_m: float) -> bool:
        return world.first_met(place, towards, world.body)[0] >= length_m

    thick, seen = 2.0 * FINGER[1] * world.settings.tip_scale, 0
    for place, out in zip((points + OFF_M * normals)[beside], normals[beside], strict=True):
        seen += is_free(place, out, thick) and any(is_free(place + thick * out, look, REACH_M) for look in looks)
    return bool(seen <= FEW * np.count_nonzero(beside))


def stands_out(world: HandWorld, bodies: frozenset[int], ahead: Array) -> float:
    """How far a part stands out of the object's other collision shapes, m: the way along ``ahead``, (3,), from its
    front to the first of these shapes within half a finger tip's width, where that is longest; infinite if none is."""
    points, normals, _ = surface_places(world, bodies)
    shapes = shapes_of(world.model, frozenset(range(world.model.nbody)) - bodies)
    others = {geom for geom in shapes if world.object_geoms[geom]}
    fronts = points[normals @ ahead < -FRONT]
    if not len(fronts):
        return math.inf
    free = np.array([free_m(world, others, place - OFF_M * ahead, ahead) for place in fronts])
    near = np.linalg.norm(fronts[:, None] - fronts, axis=2) < FINGER[0] * world.settings.tip_scale
    return max(float(np.where(near, free, math.inf).min(axis=1).max()) - OFF_M, 0.0)


def free_m(world: HandWorld, others: set[int], place: Array, ahead: Array) -> float:
    """Length of the way from a place to the first of these shapes, m; infinite where none is there."""
    gone = 0.0
    while gone < REACH_M:
        distance, geom = world.first_met(place + gone * ahead, ahead, world.body)
        gone += distance
        if geom in others:
            return gone
        gone += SKIP_M
    return math.inf
