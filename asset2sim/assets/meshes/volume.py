"""Volume, centre and inertia of one mesh: signed where closed, its convex pieces where not, a slab where flat; and
area, centre and second moments of its faces: what a wall of even thickness along them weighs and where."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import QhullError

from asset2sim.assets.meshes.hull import distinct_faces, hull_of, shells, solid_moments
from asset2sim.physics.arrays import Array, Faces, cross
from asset2sim.physics.inertia import box_inertia
from schemas.vocabulary import VolumeSource

EXACT_SHARE = 0.97
"""Share of its hull that a closed mesh must fill to count as convex."""
SLAB_THICKNESS = 1e-3
"""Thickness over longest extent that a sheet is given, so that it has a mass and an inertia."""


@dataclass(frozen=True)
class SheetSurface:
    """Area (m²), (3,) centre of a sheet along the faces, and its (3, 3) inertia about that at 1 kg/m². ``opening`` is
    the area of what would close it, m²: 0 for a closed mesh, the plate's own for a plate drawn from one side."""

    area: float
    opening: float
    center: Array
    inertia: Array

    def moved(self, rotation: Array, translation: Array) -> "SheetSurface":
        """The same surface in another frame: (3, 3) rotation, then (3,) translation."""
        return SheetSurface(
            self.area, self.opening, rotation @ self.center + translation, rotation @ self.inertia @ rotation.T
        )


NO_SURFACE = SheetSurface(0.0, 0.0, np.zeros(3), np.zeros((3, 3)))
"""The surface of no faces."""


@dataclass(frozen=True)
class Solid:
    """Volume (m³), (3,) centre of mass, and (3, 3) inertia about it at unit density."""

    volume: float
    center: Array
    inertia: Array

    def moved(self, rotation: Array, translation: Array) -> "Solid":
        """The same solid in another frame: (3, 3) rotation, then (3,) translation."""
        return Solid(self.volume, rotation @ self.center + translation, rotation @ self.inertia @ rotation.T)


@dataclass(frozen=True)
class Shape:
    """Mass properties and hulls of one mesh, in the mesh's frame. ``points`` are the (n, 3) vertices of its hull, or
    all of them where it is flat; ``pieces`` the (k, 3) hull points of each convex piece, none where it is flat.
    ``surface`` is that of its distinct faces, ``area`` that of all.
    ``exact`` says that the mesh is closed and convex: it fills its one hull."""

    solid: Solid
    source: VolumeSource
    points: Array
    pieces: tuple[Array, ...]
    area: float
    surface: SheetSurface
    watertight: bool
    n_faces: int
    exact: bool

    @property
    def flat(self) -> bool:
        """Whether the mesh is a sheet that encloses nothing."""
        return not self.pieces


def shape_of(mesh: trimesh.Trimesh) -> Shape:
    """The shape of a mesh that has at least one face and merged vertices."""
    points = np.asarray(mesh.vertices, dtype=float)
    watertight = bool(mesh.is_watertight)
    surface = surface_of(points, np.asarray(mesh.faces, dtype=np.int64))
    hull = hull_of(points)
    if hull is None:
        drawn = (float(mesh.area), surface, watertight, len(mesh.faces))
        return Shape(sheet_as_slab(points), VolumeSource.BOX, points, (), *drawn, exact=False)
    pieces = [shell.hull for shell in shells(mesh, hull)]
    body, source = combined_solid([Solid(*solid_moments(piece.triangles)) for piece in pieces]), VolumeSource.HULL
    if watertight:
        volume, center, inertia = solid_moments(np.asarray(mesh.triangles, dtype=float))
        sign = float(np.sign(volume))
        # An inside-out or self-crossing shell integrates to nonsense; no solid exceeds its hull.
        if (
            0.0 < abs(volume) <= 1.001 * solid_moments(hull.triangles)[0]
            and np.linalg.eigvalsh(inertia * sign)[0] > 0.0
        ):
            body, source = Solid(abs(volume), center, inertia * sign), VolumeSource.SIGNED
    return Shape(
        body,
        source,
        hull.points,
        tuple(piece.points for piece in pieces),
        float(mesh.area),
        surface,
        watertight,
        len(mesh.faces),
        source is VolumeSource.SIGNED and len(pieces) == 1 and fills_its_hull(body.volume, pieces[0].points),
    )


def fills_its_hull(volume: float, points: Array) -> bool:
    """Whether a solid of this volume, m³, is all of the hull of its (n, 3) points."""
    hull = hull_of(points)
    return hull is not None and volume >= EXACT_SHARE * float(solid_moments(hull.triangles)[0])


def sheet_as_slab(points: Array) -> Solid:
    """A sheet as the smallest rectangle around it in its own plane, a thousandth of its extent thick."""
    center = points.mean(axis=0)
    plane = np.linalg.svd(points - center, full_matrices=True)[2]
    flat = (points - center) @ plane[:2].T
    to_rectangle, size = smallest_rectangle(flat)
    turn = to_rectangle[:2, :2]
    middle = center + plane[:2].T @ (-turn.T @ to_rectangle[:2, 2])
    axes = np.vstack([turn @ plane[:2], plane[2]])
    edges = np.append(size, 0.0)
    edges = np.maximum(edges, SLAB_THICKNESS * max(float(edges.max()), 1e-9))
    volume = float(edges.prod())
    return Solid(volume, middle, axes.T @ box_inertia(volume, edges) @ axes)


def smallest_rectangle(points: Array) -> tuple[Array, Array]:
    """The (3, 3) planar transform that brings (n, 2) points to the origin along their smallest rectangle, and its size.
    Points on one line have a rectangle of no width along it."""
    try:
        transform, size = trimesh.bounds.oriented_bounds_2D(points)
        return np.asarray(transform, dtype=float), np.asarray(size, dtype=float)
    except (QhullError, ValueError):
        direction = np.linalg.svd(points - points.mean(axis=0), full_matrices=True)[2]
        along = points @ direction.T
        low, high = along.min(axis=0), along.max(axis=0)
        matrix = np.eye(3)
        matrix[:2, :2] = direction
        matrix[:2, 2] = -(low + high) / 2.0
        return matrix, high - low


def combined_solid(solids: Sequence[Solid]) -> Solid:
    """Several solids in one frame as one (parallel-axis theorem); overlaps count twice."""
    volume = sum(item.volume for item in solids)
    center = np.sum([item.volume * item.center for item in solids], axis=0) / volume
    inertia = np.zeros((3, 3))
    for item in solids:
        offset = item.center - center
        inertia += item.inertia + item.volume * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return Solid(float(volume), center, inertia)


def surface_of(vertices: Array, faces: Faces) -> SheetSurface:
    """Surface of (n, 3) merged vertices and (k, 3) faces. A face drawn twice, once for either side, counts once."""
    triangles = np.asarray(vertices, dtype=float)[faces[distinct_faces(faces)]]
    normals = cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2.0
    area = np.linalg.norm(normals, axis=1)
    whole = float(area.sum())
    if whole <= 0.0:
        return SheetSurface(0.0, 0.0, triangles.reshape(-1, 3).mean(axis=0), np.zeros((3, 3)))
    center = (area @ triangles.sum(axis=1)) / (3.0 * whole)
    # ∫ x xᵀ over a triangle is A/12 · (Σ vᵢ vᵢᵀ + s sᵀ), with its corners vᵢ and their sum s.
    corners = triangles - center
    sums = corners.sum(axis=1)
    second = np.einsum("k,kvi,kvj->ij", area, corners, corners) + np.einsum("k,ki,kj->ij", area, sums, sums)
    second /= 12.0
    # The area vectors of a closed surface sum to zero, so what is left is that of its openings.
    opening = float(np.linalg.norm(normals.sum(axis=0)))
    return SheetSurface(whole, opening, center, np.trace(second) * np.eye(3) - second)


def joined_surfaces(surfaces: Sequence[SheetSurface]) -> SheetSurface:
    """Several surfaces in one frame as one (parallel-axis theorem)."""
    area = sum(item.area for item in surfaces)
    if area <= 0.0:
        return NO_SURFACE
    center = np.sum([item.area * item.center for item in surfaces], axis=0) / area
    inertia = np.zeros((3, 3))
    for item in surfaces:
        offset = item.center - center
        inertia += item.inertia + item.area * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return SheetSurface(float(area), sum(item.opening for item in surfaces), center, inertia)
