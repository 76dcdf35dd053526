"""Which of a link's shapes give its mass properties: its collision meshes, unless they do not match its visuals."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from asset2sim.assets.meshes.volume import Shape
from asset2sim.physics.arrays import Array, box_of
from asset2sim.physics.convex_hull import hull_volume

SIZE_FACTOR = 2.0
"""Ratio of the box diagonals of collision meshes and visuals, either way, above which they differ in unit or part."""
OFF_SHARE = 0.5
"""Distance of the boxes' centres, as a share of the visuals' diagonal, above which they do not match."""
PANEL_SHARE = 0.25
"""How far a sheet must reach beyond a link's solids, as a share of its own longest edge, to be a part of its own."""
FILLED_FACTOR = 3.0
"""Volume of the collision meshes over that of the visuals' solids above which they fill the interior: a hull over
panels that enclose a room has five times their volume and more."""

APART_SHARE = 0.01
"""Distance of a face from the collision hulls, as a share of their longest edge, from which it does not touch them."""


@dataclass(frozen=True)
class PlacedShape:
    """A shape in its link's frame: (3, 3) rotation and (3,) translation of its mesh. ``mesh`` is the reference and (3,)
    scale of a mesh file, None for a primitive."""

    shape: Shape
    rotation: Array
    translation: Array
    mesh: tuple[str, Array] | None

    def points(self, points: Array) -> Array:
        """(n, 3) points of the mesh's frame in the link's."""
        return np.asarray(points @ self.rotation.T + self.translation)


def collision_mismatch(
    collision: list[PlacedShape], looks: list[PlacedShape], lost: int, holed: Collection[str]
) -> str | None:
    """Why a link's collision meshes do not match its visuals, or None where they do. ``lost`` is how many of the
    collision references could not be read, ``holed`` names those with holes. Only separate collision meshes are
    doubted: primitives are deliberate, and a mesh that is also a visual cannot mismatch."""
    if not looks or not any(item.shape.pieces for item in looks):
        return None
    seen = {item.mesh[0] for item in looks if item.mesh is not None}
    if any(item.mesh is None or item.mesh[0] in seen for item in collision):
        return None
    if lost:
        return f"{lost} of its {lost + len(collision)} collision meshes cannot be read"
    if not collision:
        return None
    if any(item.shape.flat for item in collision):
        return "a collision mesh is flat"
    if any(item.mesh is not None and item.mesh[0] in holed for item in collision):
        return "a collision mesh has holes"
    (low, high), (seen_low, seen_high) = box_of_shapes(collision), box_of_shapes(looks)
    extent, seen_extent = float(np.linalg.norm(high - low)), float(np.linalg.norm(seen_high - seen_low))
    ratio = extent / max(seen_extent, 1e-12)
    if not 1.0 / SIZE_FACTOR <= ratio <= SIZE_FACTOR:
        return f"its collision meshes are {ratio:.4g} times as large as what one sees"
    apart = float(np.linalg.norm(low + high - seen_low - seen_high) / 2.0)
    if apart > OFF_SHARE * seen_extent:
        return f"its collision meshes lie {apart:.3g} m from what one sees"
    filled, solid = volume_of_shapes(collision), volume_of_shapes(looks)
    if filled > FILLED_FACTOR * solid:
        return f"its collision meshes hold {filled / solid:.3g} times the volume of what one sees: they fill its inside"
    return None


def left_out(
    looks: list[PlacedShape], collision: list[PlacedShape], mesh_of: Callable[[str, Array], trimesh.Trimesh]
) -> list[PlacedShape]:
    """Visual meshes that a link's collision leaves out: that consists of others of its visual meshes, and most of these
    meshes' area lies outside of all its hulls. ``mesh_of`` reads a mesh by its reference and (3,) scale."""
    seen = {item.mesh[0] for item in looks if item.mesh is not None}
    colliding = {item.mesh[0] for item in collision if item.mesh is not None}
    if not colliding & seen or not seen - colliding:
        return []
    low, high = box_of_shapes(collision)
    apart = APART_SHARE * float((high - low).max())
    planes = [ConvexHull(item.points(piece)).equations for item in collision for piece in item.shape.pieces]
    found = []
    for item in looks:
        if item.mesh is None or item.mesh[0] in colliding or item.shape.flat:
            continue
        mesh = mesh_of(*item.mesh)
        centers, outside = item.points(mesh.triangles_center), np.ones(len(mesh.faces), bool)
        for plane in planes:
            outside &= (centers @ plane[:, :3].T + plane[:, 3]).max(axis=1) > apart
        if float(mesh.area_faces[outside].sum()) > 0.5 * float(mesh.area):
            found.append(item)
    return found


def shapes_with_mass(items: list[PlacedShape]) -> list[PlacedShape]:
    """The shapes that have a mass: all solids, and the sheets that are panels. A sheet on a solid is a decal; one that
    reaches beyond the solids by ``PANEL_SHARE`` of its own size is a pane or a panel that they are fixed to."""
    solids = [item for item in items if not item.shape.flat]
    if not solids:
        return items
    low, high = box_of_shapes(solids)
    kept = []
    for item in items:
        if item.shape.flat:
            sheet_low, sheet_high = box_of_shapes([item])
            beyond = float(np.maximum(low - sheet_low, sheet_high - high).max())
            if beyond <= PANEL_SHARE * float((sheet_high - sheet_low).max()):
                continue
        kept.append(item)
    return kept


def box_of_shapes(items: list[PlacedShape]) -> tuple[Array, Array]:
    """The (3,) minimum and maximum of these shapes in the link's frame, m."""
    return box_of(np.vstack([item.points(item.shape.points) for item in items]))


def volume_of_shapes(items: list[PlacedShape]) -> float:
    """The volume of these shapes' solids, m³: pieces overlap, so never more than their common hull."""
    whole = hull_volume(np.vstack([item.points(item.shape.points) for item in items]))
    return min(sum(item.shape.solid.volume for item in items if not item.shape.flat), whole)
