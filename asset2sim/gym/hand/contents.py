"""The check ``contents``: three bodies lie in each drawer and box and on each shelf while its parts open and close."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from scipy import ndimage
from scipy.spatial import ConvexHull, QhullError

from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.meshes.interior import FLOOR_CELLS, Interior, interiors
from asset2sim.assets.surfaces.scene import load_scene
from asset2sim.assets.surfaces.surface import Surface
from asset2sim.gym.hand.content_world import (
    BODIES,
    ContentWorld,
    joints_to_root,
    open_and_close,
    open_contents,
    orders_of_use,
)
from asset2sim.gym.hand.laid import Laid, is_free
from asset2sim.gym.hand.surfaces import shapes_of, triangles_of
from asset2sim.gym.world import body_pose, body_subtree
from asset2sim.load import Joint
from asset2sim.physics.arrays import Array, box_of
from schemas.errors import AssetError
from schemas.hand_settings import ContentSettings, HandSettings
from schemas.overlay import JointPhysics, PhysicsOverlay

APART, SMALLER = 2.1, 0.8
"""Least distance between two bodies, over their radius, and the factor by which they are made smaller to fit."""
LOOKED_AT, SEEN_FROM = 64, 24
"""Places at which it is looked whether a body may lie there, and from which it is looked what is around."""
UPRIGHT = 0.999
"""Least vertical part of the axis of a hinge that does not tilt what it turns: a door leans by at most 2.5°."""
MOST_POINTS, FLAT = 1500, 1e-3
"""Places of an interior at which it is looked whether a shape is there; and how far, as a share of its size, a surface
may be from its hull to be convex."""


@dataclass(frozen=True)
class Kept:
    """One interior: its link, the room that the mesh leaves to the smallest body, m³, the share of that which is
    ``free`` of collision shapes, the bodies' size, m, the joints that were opened and closed, and why what lay in it
    did not stay. ``shut``: no hand opens it when it is empty either."""

    link: str
    room_m3: float
    free: float
    size_m: float
    joints: tuple[str, ...] = ()
    reason: str = ""
    shut: bool = False


def content_records(folder: Path, overlay: PhysicsOverlay, hand: HandSettings, settings: ContentSettings) -> list[Kept]:
    """The record of every interior of a refined object, or of ``most_interiors`` of them, spread over all. Raises
    LoadError as ``load`` does, ValueError where MuJoCo refuses the model."""
    world = open_contents(folder, overlay, hand, settings)
    about = world.about
    closed = about.followed({joint.name: joint.closed for joint in about.joints if joint.mimic is None})
    found = found_in(folder, world, closed)
    if len(found) > settings.most_interiors:
        found = [found[round(place)] for place in np.linspace(0, len(found) - 1, settings.most_interiors)]
    return [kept for link, inside in found for kept in kept_in(world, link, inside, closed)]


def found_in(folder: Path, world: ContentWorld, closed: Mapping[str, float]) -> list[tuple[str, Interior]]:
    """The interiors of every link but those that hinges tilt, in the world with the joints closed."""
    try:
        scene = load_scene(folder / URDF_NAME, closed)
    except AssetError:  # nothing to draw: nothing is known to be hollow
        return []
    faces: dict[str, list[Array]] = {}
    for surface, link in zip(scene.surfaces, scene.links, strict=True):
        faces.setdefault(link, []).append(np.asarray(surface.vertices, dtype=float)[surface.faces])
    seen = {link: np.vstack(parts) for link, parts in faces.items()}
    size = float(np.ptp(np.vstack(list(seen.values())).reshape(-1, 3), axis=0).max())
    radius = min(world.settings.least_m, world.settings.least_share * size) / 2.0
    movers = {
        link: [joint for joint in world.about.joints if joint.name in joints_to_root(world, link)] for link in seen
    }
    slid = {link for link, joints in movers.items() if any(joint.type == "prismatic" for joint in joints)}
    shift = body_pose(world.data, world.root)[:3, 3]
    found, drawers, swept = [], list[Array](), list[Array]()
    nothing = np.zeros((0, 3, 3))
    for link, own in sorted(seen.items(), key=lambda item: item[0] not in slid):
        if not all(joint.type == "prismatic" or stays_level(world, joint) for joint in movers[link]):
            continue
        others = np.vstack([nothing, *swept, *(part for name, part in seen.items() if name != link)])
        swung = any(joint.type != "prismatic" for joint in movers[link])
        here = interiors(own, others, radius, None if link in slid else np.vstack([nothing, *drawers]), railed=swung)
        if not here and link in slid and not swung:
            here = interiors(own, others, radius, walls_of_all=True)
            here = [inside for inside in here if not lies_in_solids(inside.points, scene.surfaces)]
        if link in slid:  # it is opened for what lies beside or behind it, and nothing lies in its way
            swept += swept_faces(world, own, movers[link], radius)
            drawers += [own] if here else []
        found += [(link, replace(inside, points=inside.points + shift)) for inside in here]
    return found


def stays_level(world: ContentWorld, joint: Joint) -> bool:
    """Whether a hinge turns about the vertical, as that of a door with shelves on it."""
    return abs(float(world.data.xaxis[world.joint(joint.name)][2])) > UPRIGHT


def swept_faces(world: ContentWorld, faces: Array, joints: Sequence[Joint], step_m: float) -> list[Array]:
    """The (k, 3, 3) faces of a link's box, a step apart within it and along the ways on which these joints slide it
    open."""
    low, high = box_of(faces.reshape(-1, 3))
    depths = np.arange(0.0, max(step_m, float((high - low).min()) / 2.0), step_m)
    found = [np.asarray(trimesh.creation.box(bounds=(low + depth, high - depth)).triangles) for depth in depths]
    box = found[0]
    for joint in joints:
        way = (joint.open - joint.closed) * world.data.xaxis[int(world.model.joint(world.prefix + joint.name).id)]
        count = max(1, math.ceil(float(np.linalg.norm(way)) / step_m))
        found += [box + way * step / count for step in range(1, count + 1)]
    return found


def lies_in_solids(points: Array, surfaces: Sequence[Surface]) -> bool:
    """Whether most of these places lie in what is drawn as closed convex bodies, so that nothing is hollow there."""
    points = some_of(points)
    taken = np.zeros(len(points), dtype=bool)
    for surface in surfaces:
        corners = np.asarray(surface.vertices, dtype=float)[surface.faces]
        try:
            hull = ConvexHull(corners.reshape(-1, 3))
        except QhullError:  # flat
            continue
        planes, size = hull.equations, float(np.ptp(corners.reshape(-1, 3), axis=0).max())
        on_it = (corners.mean(axis=1) @ planes[:, :3].T + planes[:, 3]).max(axis=1) > -FLAT * size
        area = float(np.linalg.norm(np.cross(*np.diff(corners, axis=1).swapaxes(0, 1)), axis=1).sum()) / 2.0
        if on_it.all() and area > (1.0 - FLAT) * hull.area:
            taken |= (points @ planes[:, :3].T + planes[:, 3] <= 0.0).all(axis=1)
    return float(taken.mean()) > 0.5


def some_of(points: Array) -> Array:
    """At most ``MOST_POINTS`` of (n, 3) points, spread over all."""
    found: Array = points[np.linspace(0, len(points) - 1, min(len(points), MOST_POINTS)).astype(int)]
    return found


def clear_spots(inside: Interior, settings: ContentSettings) -> tuple[float, Array]:
    """The radius of three bodies, m, and (n, 3) places on the floor where one is clear of all faces, of which three are
    far enough apart; none where even the smallest do not fit."""
    radius = min(settings.most_m / 2.0, settings.room_share * float(inside.clearance_m.max()))
    while radius >= inside.radius_m:
        low = inside.height_m <= radius + FLOOR_CELLS * inside.cell_m
        fits = inside.points[(inside.clearance_m >= radius) & low]
        if len(fits):
            fits = places_off_edge(fits, inside.cell_m, settings.finger_m)
            fits = fits[np.random.default_rng(0).permutation(len(fits))[:LOOKED_AT]]
            if places_apart(fits, radius) is not None:
                return radius, fits
        radius *= SMALLER
    return 0.0, np.zeros((0, 3))


def places_apart(places: Array, radius: float) -> Array | None:
    """Three of these places as far apart as may be, the first in the middle; None where bodies of this radius touch."""
    if not len(places):
        return None
    chosen = [int(np.linalg.norm(places - np.median(places, axis=0), axis=1).argmin())]
    for _ in range(len(BODIES) - 1):
        off = np.linalg.norm(places[:, None] - places[chosen], axis=2).min(axis=1)
        if off.max() < APART * radius:
            return None
        chosen.append(int(off.argmax()))
    return places[chosen]


def places_off_edge(places: Array, cell_m: float, margin: float) -> Array:
    """Of (n, 3) places, those this far from the edge of all, m, seen from above; or the half furthest from it."""
    index = np.round(places[:, :2] / cell_m).astype(int)
    index -= index.min(axis=0) - 1
    flat = np.zeros(index.max(axis=0) + 2, dtype=bool)
    flat[tuple(index.T)] = True
    off = ndimage.distance_transform_edt(flat)[tuple(index.T)] * cell_m
    kept: Array = places[off >= min(margin, float(np.median(off)))]
    return kept


def kept_in(world: ContentWorld, link: str, inside: Interior, closed: Mapping[str, float]) -> list[Kept]:
    """The record of one interior; nothing where three bodies do not fit into it."""
    radius, fits = clear_spots(inside, world.settings)
    if not len(fits):
        return []
    world.reset(closed, radius)
    kept = Kept(link, inside.volume_m3, free_share(world, inside.points), 2.0 * radius)
    body = int(world.model.body(world.prefix + link).id)
    joints = enclosing_joints(world, body, inside.points)
    kept = replace(kept, joints=tuple(joint.name for joint in joints))
    places = places_apart(np.array([at for at in fits if is_free(world, at, radius)]), radius)
    if places is None or kept.free < world.settings.free_share:
        said = "leave no place for three bodies" if places is None else "fill it"
        return [replace(kept, reason=f"collision shapes {said}: {kept.free:.0%} of its room is free of them")]
    laid = Laid(world, body, inside, places, radius)
    laid.put_down()
    reason, stuck = open_and_close(world, joints, (), laid.left)
    if stuck:
        world.reset(closed, radius)
        joints, back, blocked = orders_of_use(world, joints)
        if blocked:
            return [replace(kept, reason=f"'{blocked}' does not open and close when empty either", shut=True)]
        world.reset(closed, radius)
        laid.put_down()
        reason, stuck = open_and_close(world, joints, back, laid.left)
    return [replace(kept, reason=reason or (f"'{stuck}' is jammed by it" if stuck else ""))]


def enclosing_joints(world: ContentWorld, body: int, places: Array) -> list[JointPhysics]:
    """The joints that a hand operates to get into an interior of this body: those of the parts that are above, below
    and beside these places in it, and on the way on which it slides open, hinges first, and its own."""
    model, known = world.model, world.operated
    own = joints_to_root(world, model.body(body).name.removeprefix(world.prefix))
    slides = [known[name] for name in own if name in known and known[name].type == "prismatic"]
    looks = [(way, math.inf, -1) for way in np.vstack([np.eye(3), -np.eye(3)])]
    for joint in slides:
        axis, length = world.data.xaxis[world.joint(joint.name)], joint.open - joint.closed
        way = math.copysign(1.0, length) * axis
        looks.append((way, front_m(world, body, way) + abs(length), body))
    met = list[str]()
    for at in places[np.linspace(0, len(places) - 1, SEEN_FROM).astype(int)]:
        for way, until, but in looks:
            distance, geom = world.first_met(at, way, but)
            if distance < until - float(at @ way) and world.object_geoms[geom]:
                name = model.body(int(model.geom_bodyid[geom])).name
                met += joints_to_root(world, name.removeprefix(world.prefix))
    found = [known[name] for name in dict.fromkeys((*met, *own)) if name in known]
    if slides:  # the drawer beside it stays shut
        found = [joint for joint in found if joint.name in own or joint.type != "prismatic"]
    return sorted(found, key=lambda joint: joint.type == "prismatic")


def front_m(world: ContentWorld, body: int, way: Array) -> float:
    """How far along a way, (3,) unit, a body's collision shapes reach, m, world."""
    model, data, front = world.model, world.data, -math.inf
    for geom in shapes_of(model, frozenset({body})):
        corners = triangles_of(model, geom).reshape(-1, 3) @ data.geom_xmat[geom].reshape(3, 3).T
        front = max(front, float(((corners + data.geom_xpos[geom]) @ way).max()))
    return front


def free_share(world: ContentWorld, points: Array) -> float:
    """Share of these places, world, that lie in no collision shape of the object."""
    points = some_of(points)
    taken = np.zeros(len(points), dtype=bool)
    for geom in shapes_of(world.model, body_subtree(world.model, world.root)):
        try:
            planes = ConvexHull(triangles_of(world.model, geom).reshape(-1, 3)).equations
        except QhullError:  # flat
            continue
        near = (points - world.data.geom_xpos[geom]) @ world.data.geom_xmat[geom].reshape(3, 3)
        taken |= (near @ planes[:, :3].T + planes[:, 3] <= 0.0).all(axis=1)
    return float(1.0 - taken.mean())
