"""Convex collision hulls of each link, in the link's frame at the final scale."""

import re
import shutil
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from asset2sim.assets.extract import Extraction
from asset2sim.assets.links import LinkGeometry
from asset2sim.assets.meshes.cylinder import Cylinder, cylinder_of
from asset2sim.assets.meshes.hull import hull_of, spread_directions
from asset2sim.assets.urdf.capsule import Capsule
from asset2sim.physics.arrays import Array, corners_of_box
from asset2sim.physics.kinematics import apply

Hulls = dict[str, tuple[Array, ...]]
"""Link → (k, 3) hull points of each convex piece, m at the final scale in the link's frame."""
SHEET_THICKNESS_M = 2e-3
"""Thickness given to a link that consists of sheets only, m: engines refuse or drop flat shapes."""
MOST_POINTS = 200
"""Most points of one hull: PhysX accepts at most 255, and 200 directions lie 15° apart."""
INSIDE_M = 1e-6
"""How far outside another hull a point may lie and still count as inside, m."""
DIRECTIONS = spread_directions(MOST_POINTS)


def collision_hulls(extraction: Extraction, scale: float) -> Hulls:
    """Link → convex hulls of its meshes, without pieces that lie wholly inside another piece of the link. Sheets beside
    solid pieces are decals and do not collide; a link of sheets alone is thickened."""
    return {name: link_hulls(geometry, scale) for name, geometry in extraction.geometry.items()}


def exact_links(extraction: Extraction) -> frozenset[str]:
    """Links whose hulls equal what is drawn: every mesh is closed and convex, or there is none."""
    parts = {name: geometry.parts for name, geometry in extraction.geometry.items()}
    return frozenset(name for name, own in parts.items() if all(part.exact for part in own))


def primitive_hulls(extraction: Extraction, scale: float) -> Hulls:
    """Link → the hulls of the boxes and cylinders that collide (``add_primitive_collisions``), of links that have
    some."""
    found: Hulls = {}
    for name, link in extraction.links.items():
        pieces = []
        for item in link.collisions or link.visuals:
            origin = np.eye(4) if item.origin is None else np.asarray(item.origin, dtype=float)
            form = item.geometry
            if form is not None and form.box is not None:
                half = np.asarray(form.box.size, dtype=float) / 2.0
                pieces.append(apply(origin, corners_of_box(np.array([-half, half]))) * scale)
            elif form is not None and form.cylinder is not None and not isinstance(form.cylinder, Capsule):
                own = form.cylinder
                lengths = own.radius * scale, own.length * scale
                pieces.append(Cylinder(origin[:3, 3] * scale, origin[:3, 2], *lengths).corners)
        if pieces:
            found[name] = tuple(pieces)
    return found


def link_hulls(geometry: LinkGeometry, scale: float) -> tuple[Array, ...]:
    """The hulls of one link."""
    pieces = [simplified(piece) * scale for part in geometry.parts for piece in part.pieces]
    if not pieces:
        return tuple(thickened_sheet(part.sheet * scale) for part in geometry.parts if part.sheet is not None)
    return without_enclosed(pieces)


def simplified(points: Array) -> Array:
    """Hull points, reduced to the furthest along evenly spread directions where there are more than ``MOST_POINTS``. A
    sphere loses about 2 % of its radius. PhysX refuses more points, and every engine is slower with more."""
    if len(points) <= MOST_POINTS:
        return points
    return np.asarray(points[np.unique(np.argmax(points @ DIRECTIONS.T, axis=0))])


def without_enclosed(pieces: list[Array]) -> tuple[Array, ...]:
    """The pieces that are not wholly inside another one, in their order."""
    if not pieces:
        return ()
    planes: dict[int, Array] = {}
    low, high = np.array([[piece.min(axis=0), piece.max(axis=0)] for piece in pieces]).swapaxes(0, 1)
    volume = np.prod(high - low, axis=1)
    kept: list[int] = []
    for index in np.lexsort((np.arange(len(pieces)), -volume)).tolist():
        around = (low[index] >= low[kept] - INSIDE_M) & (high[index] <= high[kept] + INSIDE_M)
        for other in np.array(kept, dtype=int)[around.all(axis=1)].tolist():
            if other not in planes:
                planes[other] = np.asarray(ConvexHull(pieces[other]).equations)
            if float((pieces[index] @ planes[other][:, :3].T + planes[other][:, 3]).max()) <= INSIDE_M:
                break
        else:
            kept.append(index)
    return tuple(pieces[index] for index in sorted(kept))


def thickened_sheet(points: Array) -> Array:
    """The points of a sheet, doubled to both sides of its plane."""
    center = points.mean(axis=0)
    normal = np.linalg.svd(points - center, full_matrices=True)[2][2]
    return np.vstack([points + normal * SHEET_THICKNESS_M / 2.0, points - normal * SHEET_THICKNESS_M / 2.0])


def box_corners(points: Array) -> Array:
    """(8, 3) corners of the box of (n, 3) points, no edge of it thinner than a sheet, m."""
    low, high = points.min(axis=0), points.max(axis=0)
    thin = np.maximum(SHEET_THICKNESS_M - (high - low), 0.0) / 2.0
    return corners_of_box(np.array([low - thin, high + thin]))


FOLDER = "collision"

CollisionFiles = dict[str, tuple[str | Cylinder, ...]]
"""Link → its hulls: the path of each one's file, relative to the asset's folder, or the cylinder that it is."""


def write_hulls(hulls: Hulls, target: Path) -> CollisionFiles:
    """Write one OBJ per hull under ``collision/``, replacing the folder's contents; cylinders, which a URDF can state,
    have no file. Hulls without volume, which no engine takes, are left out."""
    folder = target / FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    files: CollisionFiles = {}
    for number, (link, pieces) in enumerate(hulls.items()):
        # The number keeps names apart that differ only in characters that file names cannot hold.
        stem = f"{re.sub(r'[^A-Za-z0-9_-]', '_', link)[:60]}_{number}"
        names = list[str | Cylinder]()
        for index, points in enumerate(pieces):
            cylinder = cylinder_of(points)
            text = None if cylinder is not None else obj_text(points)
            if cylinder is not None:
                names.append(cylinder)
            if text is not None:
                name = f"{FOLDER}/{stem}_{index}.obj"
                (target / name).write_text(text, encoding="ascii")
                names.append(name)
        files[link] = tuple(names)
    return files


def obj_text(points: np.ndarray) -> str | None:
    """OBJ text of the hull of (n, 3) points, triangles facing outwards; None where it has no volume."""
    return _obj_text(np.ascontiguousarray(points, dtype=np.float64).tobytes())


@lru_cache(maxsize=1024)
def _obj_text(content: bytes) -> str | None:
    """``obj_text`` of an array's bytes: an asset's hulls are written thrice, and few of them change in between."""
    hull = hull_of(np.frombuffer(content).reshape(-1, 3))
    if hull is None:
        return None
    vertices, inverse = np.unique(hull.triangles.reshape(-1, 3), axis=0, return_inverse=True)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in inverse.reshape(-1, 3)]
    return "\n".join(lines) + "\n"
