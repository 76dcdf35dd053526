"""Batches for the renderer from surfaces: one per paint, visible from both sides, without duplicate faces."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from asset2sim.assets.surfaces.surface import (
    PLAIN,
    Batch,
    Bools,
    Floats,
    Ints,
    Paint,
    Surface,
    compact,
    face_normals,
    unit_vectors,
)
from asset2sim.physics.arrays import box_of

LIFT = 4e-5
"""How far the smallest flat surface is lifted, as a share of the object's size: a tenth of a large view's pixel."""
FLAT = 1e-4
"""A surface is flat if it is no thicker than this share of the object's size."""


def with_lifts(surfaces: Sequence[Surface]) -> list[tuple[Surface, float]]:
    """The surfaces from the smallest to the largest, each with the distance (m) that it is to be lifted along its
    normals. What lies on something is smaller than what it lies on; among equals, the textured one is on top. Only flat
    surfaces are lifted: others would gape at their edges."""
    if not surfaces:
        return []
    areas, thickness = zip(*(area_and_thickness(surface) for surface in surfaces), strict=True)
    low, high = box_of(np.concatenate([surface.vertices for surface in surfaces]))
    size = max(float((high - low).max()), 1e-9)
    largest = max(areas) or 1.0

    def on_top(index: int) -> tuple[float, bool]:
        paint = surfaces[index].paint
        return (round(areas[index] / largest, 6), paint is None or paint.texture is None)

    order = sorted(range(len(surfaces)), key=on_top)
    lift = [LIFT * size * (1.0 - (item / largest) ** 0.5) for item in areas]
    flat = [item <= FLAT * size for item in thickness]
    return [(surfaces[index], lift[index] if flat[index] else 0.0) for index in order]


def area_and_thickness(surface: Surface) -> tuple[float, float]:
    """The surface's area, m² (of both sides where both are given), and extent along its largest face's normal, m."""
    corner = surface.vertices[surface.faces]
    normal = face_normals(corner)
    double = np.linalg.norm(normal, axis=1)
    widest = int(double.argmax())
    along = corner.reshape(-1, 3) @ (normal[widest] / (double[widest] or 1.0))
    return 0.5 * float(double.sum()), float(np.ptp(along))


def outside_first(batches: Sequence[Batch]) -> list[Batch]:
    """The same batches, sorted, each with its faces sorted. Of two faces that a camera sees from the front, the one
    further out along its own normal is likely to be the nearer; that needs no camera, so one order serves all views."""
    if not batches:
        return []
    low, high = box_of(np.concatenate([box_of(batch.vertices) for batch in batches]))
    ranked = [sorted_faces(batch, 0.5 * (low + high)) for batch in batches]
    return [batch for batch, _ in sorted(ranked, key=lambda item: -item[1])]


def sorted_faces(batch: Batch, center: Floats) -> tuple[Batch, float]:
    """The batch with its outermost faces first, and the area-weighted mean of how far out they are, m."""
    corner = batch.vertices[batch.faces]
    normal = face_normals(corner)
    area = np.linalg.norm(normal, axis=1)
    out = np.einsum("ij,ij->i", corner.mean(axis=1) - center, unit_vectors(normal))
    rank = float(np.average(out, weights=area)) if area.sum() > 0.0 else 0.0
    order = np.argsort(-out, kind="stable")
    return Batch(batch.vertices, batch.normals, batch.uv, batch.faces[order], batch.paint), rank


def faces_towards(batches: Sequence[Batch], eye: Floats) -> tuple[Batch, ...]:
    """The batches without the faces that are turned away from (3,) ``eye``, none of which the renderer draws: half."""
    found = []
    for batch in batches:
        corner = batch.vertices[batch.faces]
        normal = face_normals(corner)
        seen = np.einsum("ij,ij->i", normal, eye - corner[:, 0]) > 0.0
        if seen.any():
            found.append(compact(replace(batch, faces=batch.faces[seen])))
    return tuple(found) or tuple(batches)


MAX_VERTICES = 120_000
"""Vertices a batch: PyBullet's shapes take 131072."""
MAX_FACES = 170_000
"""Triangles a batch: PyBullet's shapes take 524288 indices."""
QUANTUM = 1e-5
"""Two corners are the same point if they are within about this share of the object's size."""


def batches_of(surfaces: Sequence[Surface]) -> tuple[Batch, ...]:
    """One batch or more per paint, the outermost first, within PyBullet's limits. The renderer draws front faces only
    and lights by the vertex normal, so every face without a partner of opposite winding is given one. Of faces that lie
    exactly on each other with the same winding, that of the smallest surface is kept."""
    layers = with_lifts(surfaces)
    keep, alone = faces_to_draw([surface for surface, _ in layers])
    grouped: dict[Paint, list[Batch]] = {}
    start = 0
    for surface, lift in layers:
        stop = start + len(surface.faces)
        paint = surface.paint or Paint(PLAIN)
        batch = two_sided(surface, paint, keep[start:stop], alone[start:stop])
        if len(batch.faces):
            grouped.setdefault(paint, []).append(replace(batch, vertices=batch.vertices + lift * batch.normals))
        start = stop
    whole = [merged_batches(parts) for parts in grouped.values()]
    return tuple(piece for batch in outside_first(whole) for piece in split_batch(batch))


def faces_to_draw(surfaces: Sequence[Surface]) -> tuple[Bools, Bools]:
    """Two (m,) bool arrays over all surfaces' faces: which to draw, and which of these lack an opposite partner."""
    corners = np.concatenate([surface.vertices[surface.faces] for surface in surfaces])
    low, high = box_of(corners.reshape(-1, 3))
    size = float((high - low).max()) or 1.0
    grid = np.rint(corners / (QUANTUM * size)).astype(np.int64)
    points = mixed_hashes(mixed_hashes(mixed_hashes(grid[..., 0]) + grid[..., 1]) + grid[..., 2])
    triangles = points.sum(axis=1)  # the same for every order of the corners
    _, first, group = np.unique(triangles, return_index=True, return_inverse=True)
    normals = face_normals(corners)
    reversed_ = np.einsum("ij,ij->i", normals, normals[first][group]) < 0.0
    has_area = (points[:, 0] != points[:, 1]) & (points[:, 1] != points[:, 2]) & (points[:, 0] != points[:, 2])
    sided = 2 * group + reversed_
    _, earliest = np.unique(sided, return_index=True)
    keep = np.zeros(len(corners), dtype=bool)
    keep[earliest] = True
    present = np.bincount(sided, minlength=2 * len(first)) > 0
    return keep & has_area, ~present[sided ^ 1]


def mixed_hashes(values: Ints) -> Ints:
    """Hashed integers, so that sums of them do not collide by accident."""
    stirred = values.view(np.uint64) + np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((33, 0xFF51AFD7ED558CCD), (33, 0xC4CEB9FE1A85EC53), (33, 1)):
        stirred = (stirred ^ (stirred >> np.uint64(shift))) * np.uint64(factor)
    return stirred.view(np.int64)


def two_sided(surface: Surface, paint: Paint, keep: Bools, alone: Bools) -> Batch:
    """The surface's faces to draw, with unit normals that agree with the winding and partners for those alone."""
    faces = surface.faces[keep]
    alone = alone[keep]
    vertices, uv = surface.vertices, surface.uv if paint.texture is not None else None
    corner = vertices[faces]
    flat = unit_vectors(face_normals(corner))
    if surface.normals is not None:
        normals = surface.normals
        agreement = np.einsum("fkj,fj->fk", normals[faces], flat)
        stray = (agreement < 0.2).any(axis=1)
    else:
        normals = np.zeros_like(vertices)
        stray = np.ones(len(faces), dtype=bool)
    if stray.any():
        # These corners get vertices of their own: with the authored normal, turned round, if it only points the wrong
        # way, else with the face's normal.
        loose = faces[stray]
        own = normals[loose]
        aligned = np.einsum("fkj,fj->fk", own, flat[stray])
        usable = (np.abs(aligned) >= 0.2).all(axis=1)
        face_normal = np.repeat(flat[stray][:, None, :], 3, axis=1)
        own = np.where(usable[:, None, None], own * np.sign(aligned)[..., None], face_normal)
        faces = faces.copy()
        faces[stray] = len(vertices) + np.arange(loose.size).reshape(-1, 3)
        vertices = np.concatenate([vertices, vertices[loose].reshape(-1, 3)])
        normals = np.concatenate([normals, own.reshape(-1, 3)])
        uv = None if uv is None else np.concatenate([uv, uv[loose].reshape(-1, 2)])
    back = faces[alone][:, ::-1] + len(vertices)
    faces = np.concatenate([faces, back])
    vertices = np.concatenate([vertices, vertices])
    normals = np.concatenate([normals, -normals])
    uv = None if uv is None else np.concatenate([uv, uv])
    return compact(Batch(vertices, normals, uv, faces, paint))


def merged_batches(parts: Sequence[Batch]) -> Batch:
    """Batches of the same paint as one."""
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    uvs = [part.uv for part in parts if part.uv is not None]
    return Batch(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate(uvs) if len(uvs) == len(parts) else None,
        np.concatenate([part.faces + offset for part, offset in zip(parts, offsets, strict=True)]),
        parts[0].paint,
    )


def split_batch(batch: Batch) -> list[Batch]:
    """The batch in pieces that PyBullet takes: all faces are kept."""
    if len(batch.vertices) <= MAX_VERTICES and len(batch.faces) <= MAX_FACES:
        return [batch]
    step = MAX_VERTICES // 3  # that many faces cannot have more vertices than allowed
    chunks = [batch.faces[start : start + step] for start in range(0, len(batch.faces), step)]
    return [compact(Batch(batch.vertices, batch.normals, batch.uv, chunk, batch.paint)) for chunk in chunks]
