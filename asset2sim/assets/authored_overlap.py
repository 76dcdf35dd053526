"""Overlaps of links as drawn, and the cause of one: their authored meshes, or only the convex hulls made from them.

Authored meshes are open, double-sided and partly flat, so they have no inside: two of them overlap where triangles
intersect (FCL's bounding volume hierarchies, exact on triangles). Parts that touch as authored intersect by rounding;
so an overlap is real if it remains after one part is moved by ``TOUCHING_M``.
"""

from collections.abc import Callable
from dataclasses import dataclass

import fcl
import numpy as np
import yourdfpy

from asset2sim.assets.extract import Extraction
from asset2sim.assets.meshes.load import primitive
from asset2sim.physics.arrays import Array, Faces
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from schemas.features import RestOverlap
from schemas.vocabulary import OverlapCause

TOUCHING_M = 2e-3
"""Shift that frees parts which only touch, m: what PyBullet's margins add up to, and what a checker tolerates."""
DEPTHS_M = (0.0, TOUCHING_M, 5e-3, 10e-3)
"""Shifts tried in turn to measure how deep meshes overlap, m."""
DIRECTIONS = np.vstack([np.eye(3), -np.eye(3)])
"""(6, 3) unit directions in which a part is shifted, beside the contact normal."""


@dataclass(frozen=True)
class AuthoredShapes:
    """Authored collision meshes of every link as FCL hierarchies, built on first use, queried at the final scale.
    ``read`` gives a link's triangles in its frame at the authored scale, None for none; ``models`` are the hierarchies
    at that scale, so that they serve every scale: a query divides the translation between two links by it instead."""

    read: Callable[[str], tuple[Array, Faces] | None]
    models: dict[str, fcl.BVHModel | None]
    scale: float

    def model(self, link: str) -> fcl.BVHModel | None:
        """FCL hierarchy of a link in its frame at the authored scale; None where the link has no mesh that collides."""
        if link not in self.models:
            triangles = self.read(link)
            self.models[link] = None if triangles is None else hierarchy(*triangles)
        return self.models[link]


def authored_shapes(extraction: Extraction, scale: float) -> AuthoredShapes:
    """The authored collision meshes of an asset's links, at a scale; hierarchies are kept in the extraction."""
    return AuthoredShapes(
        lambda name: link_triangles(extraction, extraction.links[name]), extraction.hierarchies, scale
    )


def link_triangles(extraction: Extraction, link: yourdfpy.Link) -> tuple[Array, Faces] | None:
    """(n, 3) vertices in the link's frame at the authored scale and (k, 3) triangles that collide; None for no mesh.
    Sheets beside solid pieces are decals and are left out, as they are from the collision hulls."""
    geometry = extraction.geometry.get(link.name)
    parts = () if geometry is None else geometry.parts
    pieces = primitives(link)
    for part in [part for part in parts if part.sheet is None] or ([] if pieces else parts):
        file = extraction.mesh_files.get(part.reference)
        if file is not None:
            vertices, faces = extraction.triangles.of(file)
            pieces.append(((vertices * part.scale) @ part.rotation.T + part.translation, faces))
    if not pieces:
        return None
    starts = np.cumsum([0] + [len(points) for points, _ in pieces])
    moved = [triangles + start for (_, triangles), start in zip(pieces, starts, strict=False)]
    return np.vstack([points for points, _ in pieces]), np.vstack(moved)


def primitives(link: yourdfpy.Link) -> list[tuple[Array, Faces]]:
    """(n, 3) vertices and (k, 3) triangles of each of the link's boxes, cylinders and spheres, in its frame at the
    authored scale; of its visuals where it has no collision element."""
    found: list[tuple[Array, Faces]] = []
    for item in link.collisions or link.visuals:
        mesh = None if item.geometry is None else primitive(item.geometry)
        if mesh is not None:
            origin = np.eye(4) if item.origin is None else np.asarray(item.origin, dtype=float)
            found.append((apply(origin, np.asarray(mesh.vertices)), np.asarray(mesh.faces)))
    return found


def hierarchy(vertices: Array, faces: Faces) -> fcl.BVHModel:
    """FCL's hierarchy over (n, 3) vertices and (k, 3) triangles."""
    model = fcl.BVHModel()
    model.beginModel(len(vertices), len(faces))
    model.addSubModel(np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
    model.endModel()
    return model


def intersect(shapes: AuthoredShapes, a: str, b: str, a_to_b: Array, shift: Array | None = None) -> bool:
    """Whether any triangle of link A meets one of link B, A at the (4, 4) pose ``a_to_b`` in B's frame. ``shift`` moves
    A by a (3,) vector in B's frame, m."""
    first, second = shapes.model(a), shapes.model(b)
    if first is None or second is None:
        return False
    place = a_to_b[:3, 3] if shift is None else a_to_b[:3, 3] + shift
    moved = fcl.Transform(a_to_b[:3, :3], place / shapes.scale)
    pair = (fcl.CollisionObject(first, moved), fcl.CollisionObject(second))
    return bool(fcl.collide(*pair, fcl.CollisionRequest(num_max_contacts=1), fcl.CollisionResult()) > 0)


def authored_depth(shapes: AuthoredShapes, a: str, b: str, a_to_b: Array, normal: Array | None = None) -> float:
    """Overlap depth of the authored meshes, m: the smallest of ``DEPTHS_M`` by which a shift of A separates them. A is
    moved along the (3,) unit ``normal`` from B to A (B's frame), if given, and along B's axes; infinite where no shift
    is enough. A part wholly inside another one does not overlap if their surfaces do not meet."""
    if not intersect(shapes, a, b, a_to_b):
        return 0.0
    ways = DIRECTIONS if normal is None else np.vstack([normal, DIRECTIONS])
    for depth in DEPTHS_M[1:]:
        if any(not intersect(shapes, a, b, a_to_b, depth * way) for way in ways):
            return depth
    return float("inf")


def overlap_cause(shapes: AuthoredShapes, a: str, b: str, a_to_b: Array, normal: Array | None = None) -> OverlapCause:
    """Cause of the overlap of links A and B, A at the (4, 4) pose ``a_to_b`` in B's frame. AUTHORED where the meshes
    intersect by more than ``TOUCHING_M`` (see ``authored_depth``), else HULL."""
    deep = authored_depth(shapes, a, b, a_to_b, normal) > TOUCHING_M
    return OverlapCause.AUTHORED if deep else OverlapCause.HULL


MOST_REPORTED = 12
"""Overlapping pairs at rest that are reported: the deepest."""
MOST_PAIRS = 200
"""Pairs of links that are looked at, those whose boxes share most: a keyboard has thousands."""


def rest_overlaps(extraction: Extraction) -> tuple[RestOverlap, ...]:
    """The pairs of links that overlap as drawn, every joint at position 0, deepest first, exact on their triangles; a
    part wholly inside another one does not count."""
    features = extraction.features
    longest = max(features.closed_size)
    if longest <= 0.0:
        return ()
    poses = link_to_root(tree_of(features.joints), features.root, {})
    clouds = {name: apply(poses[name], item.points) for name, item in extraction.geometry.items() if len(item.points)}
    boxes = {name: (cloud.min(axis=0), cloud.max(axis=0)) for name, cloud in clouds.items()}
    names, near = list(boxes), list[tuple[float, str, str]]()
    for index, first in enumerate(names):
        for second in names[index + 1 :]:
            shared = np.minimum(boxes[first][1], boxes[second][1]) - np.maximum(boxes[first][0], boxes[second][0])
            if (shared > DEPTHS_M[1] * longest).all():
                near.append((float(shared.prod()), first, second))
    # Depths are absolute: at this scale the longest edge is 1 m.
    shapes, found = authored_shapes(extraction, 1.0 / longest), list[RestOverlap]()
    for _, first, second in sorted(near, reverse=True)[:MOST_PAIRS]:
        between = np.linalg.inv(poses[second]) @ poses[first]
        between[:3, 3] /= longest
        depth = authored_depth(shapes, first, second, between)
        if depth > DEPTHS_M[1]:
            found.append(RestOverlap(link_a=first, link_b=second, depth_share=depth if depth <= DEPTHS_M[-1] else None))
    return tuple(sorted(found, key=lambda item: -(item.depth_share or 1.0))[:MOST_REPORTED])
