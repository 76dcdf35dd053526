"""A closed surface of a mesh: one side of double-sided faces, and open sheets as thin walls."""

from dataclasses import dataclass

import numpy as np
import trimesh

from asset2sim.physics.arrays import Array, Faces

HOLE_SHARE = 0.05
"""Area over the whole mesh's up to which a hole of three or four edges is a missing face, not an opening."""


@dataclass(frozen=True)
class ClosedSurface:
    """A closed (n, 3), (m, 3) triangle surface, the volume it encloses, and whether the mesh was closed as authored."""

    vertices: Array
    faces: Faces
    volume: float
    authored: bool


def surface_of(vertices: Array, faces: Faces, wall_thickness: float) -> ClosedSurface | None:
    """The closed surface of a mesh; ``wall_thickness`` is that of open sheets over the mesh's longest extent. None
    where faces meet three or more to an edge, or cannot be wound alike: no surface has an inside there."""
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    single = trimesh.Trimesh(vertices, faces[np.sort(first)], process=False)
    single.update_faces(single.nondegenerate_faces())
    single.remove_unreferenced_vertices()
    if len(single.faces) < 4:
        return None
    trimesh.repair.fix_winding(single)
    if not single.is_watertight:
        filled = single.copy()
        trimesh.repair.fill_holes(filled)
        if filled.is_watertight and filled.area - single.area <= HOLE_SHARE * single.area:
            single = filled
    authored = bool(single.is_watertight)
    extent = float(np.ptp(single.vertices, axis=0).max())
    closed = single if authored else thickened(single, wall_thickness * extent)
    if not (closed.is_watertight and closed.is_winding_consistent):
        return None
    trimesh.repair.fix_normals(closed)
    return ClosedSurface(np.asarray(closed.vertices), np.asarray(closed.faces), abs(float(closed.volume)), authored)


def thickened(sheet: trimesh.Trimesh, thickness: float) -> trimesh.Trimesh:
    """An open sheet as a closed wall: a side at half of ``thickness`` each way, joined along the sheet's border."""
    normals = np.asarray(sheet.vertex_normals) * (thickness / 2.0)
    edges = np.asarray(sheet.edges)
    _, index, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    border = edges[count[index.ravel()] == 1]
    other = border + len(normals)
    first = np.column_stack([border[:, 1], border[:, 0], other[:, 0]])
    second = np.column_stack([border[:, 1], other[:, 0], other[:, 1]])
    faces = np.vstack([sheet.faces, sheet.faces[:, ::-1] + len(normals), first, second])
    return trimesh.Trimesh(np.vstack([sheet.vertices + normals, sheet.vertices - normals]), faces, process=False)
