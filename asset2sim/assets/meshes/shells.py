"""Convex pieces of a mesh: the hull of each connected shell, in place of the hull that an engine would make.

Engines disagree on a mesh's collision shape: PyBullet takes one hull per OBJ group, MuJoCo one per file, and both close
the gaps between separate shells. Written out as convex pieces, every engine simulates the same shapes.
"""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from asset2sim.assets.meshes.hull import Hull, hull_of

MOST_SHELLS = 24
"""Shells above which the whole hull is kept: a mesh of many fragments is one part drawn in pieces, not many parts."""
LOOSE_SHARE = 0.5
"""Share of the area in flat shells from which the shells are faces of one solid (a box drawn as six loose sides)."""


@dataclass(frozen=True)
class ConvexShell:
    """A convex piece and the (m,) indices of the mesh's faces that it replaces."""

    hull: Hull
    faces: NDArray[np.int64]


def shells(mesh: trimesh.Trimesh, whole: Hull) -> tuple[ConvexShell, ...]:
    """The convex pieces of a mesh, in its frame, with their faces; ``whole`` is the mesh's own hull. Flat shells among
    solid ones are decals: they are left out."""
    points = np.asarray(mesh.vertices, dtype=float)
    edges = mesh.edges
    adjacency = coo_matrix((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(len(points), len(points)))
    count, label = connected_components(adjacency, directed=False)
    one = (ConvexShell(whole, np.arange(len(mesh.faces))),)
    if count == 1 or count > MOST_SHELLS:
        return one
    face_label = label[mesh.faces[:, 0]]
    found, flat_area = [], 0.0
    for shell in range(count):
        hull = hull_of(points[label == shell])
        if hull is None:
            flat_area += float(mesh.area_faces[face_label == shell].sum())
        else:
            found.append(ConvexShell(hull, np.flatnonzero(face_label == shell)))
    if not found or flat_area > LOOSE_SHARE * float(mesh.area):
        return one
    return tuple(found)
