"""An object's triangles, and what is known at any point of them: normal, colour and opacity."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from PIL import Image

from asset2sim.assets.surfaces.scene import Scene
from asset2sim.assets.surfaces.surface import PLAIN, Floats, Ints, Paint, Surface, Texture, decode_texture, face_normals
from asset2sim.physics.arrays import Array
from asset2sim.render.batch import LIFT, QUANTUM, mixed_hashes, with_lifts
from asset2sim.render.zbuffer import Singles

DIAGONALS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)][14:], dtype=float)
"""Directions along which a link's furthest points are looked for, to know what must fit into the picture: one of each
two that are opposite."""


@dataclass(frozen=True, eq=False)
class Faces:
    """An object's triangles, none twice, those of ``links[i]`` together. (m, 3, 3) ``corners``, m, and ``normals``,
    which are zero where the file has none, (m, 3, 2) ``uv``, (m, 3) ``flat`` normals, and (m,) ``surface``, the index
    in ``surfaces`` of the one that each is of, ``lift`` from what it lies on, 0 to 1, and ``link``."""

    corners: Floats
    normals: Floats
    uv: Floats
    flat: Floats
    surface: Ints
    lift: Floats
    link: Ints
    surfaces: tuple[Surface, ...]
    links: tuple[str, ...]

    @property
    def size_m(self) -> float:
        """The longest edge of its box, m."""
        return float(np.ptp(self.corners.reshape(-1, 3), axis=0).max())

    @cached_property
    def extremes(self) -> Array:
        """(links, k, 4) points that span each link's triangles, homogeneous."""
        found = []
        bounds = np.searchsorted(self.link, np.arange(len(self.links) + 1))
        for first, last in pairwise(bounds.tolist()):
            points = self.corners[first:last].reshape(-1, 3)
            along = (DIAGONALS @ points.T) if len(points) else np.zeros((len(DIAGONALS), 1))
            ends = np.concatenate([along.argmin(axis=1), along.argmax(axis=1)])
            found.append(points[ends] if len(points) else np.zeros((len(ends), 3)))
        spans = np.array(found)
        return np.concatenate([spans, np.ones((*spans.shape[:2], 1))], axis=2)


def faces_of(scene: Scene) -> Faces:
    """The scene's triangles. Of those that lie exactly on each other, the smallest surface's is kept."""
    link_of = {id(surface): link for surface, link in zip(scene.surfaces, scene.links, strict=True)}
    links = tuple(dict.fromkeys(scene.links))
    number = {name: place for place, name in enumerate(links)}
    layers = with_lifts(scene.surfaces)
    surfaces = tuple(surface for surface, _ in layers)
    corners = np.concatenate([item.vertices[item.faces] for item in surfaces])
    normals = np.concatenate(
        [np.zeros((*item.faces.shape, 3)) if item.normals is None else item.normals[item.faces] for item in surfaces]
    )
    uv = np.concatenate(
        [np.zeros((*item.faces.shape, 2)) if item.uv is None else item.uv[item.faces] for item in surfaces]
    )
    index = np.repeat(np.arange(len(surfaces)), [len(item.faces) for item in surfaces])
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max()) or 1.0
    grid = np.rint(corners / (QUANTUM * size)).astype(np.int64)
    points = mixed_hashes(mixed_hashes(mixed_hashes(grid[..., 0]) + grid[..., 1]) + grid[..., 2])
    _, first = np.unique(points.sum(axis=1), return_index=True)
    link = np.array([number[link_of[id(surface)]] for surface in surfaces])[index]
    kept = first[np.lexsort((first, link[first]))]
    corners, index = corners[kept], index[kept]
    flat = face_normals(corners)
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    lift = np.array([lift for _, lift in layers])[index] / (LIFT * size)
    return Faces(corners, normals[kept], uv[kept], flat, index, lift, link[kept], surfaces, links)


def values_at(weights: Singles, corners: Singles, face: Ints) -> Singles:
    """(n, k) values at points of these faces, of (m, 3, k) values at the faces' corners."""
    # Taken from each corner's own rows: a third of the time of indices in two axes.
    first, second, third = (np.ascontiguousarray(corners[:, corner]).take(face, axis=0) for corner in range(3))
    found: Singles = weights[:, :1] * first
    found += weights[:, 1:2] * second
    found += weights[:, 2:] * third
    return found


def smooth_normals(faces: Faces, face: Ints, weights: Singles) -> Singles:
    """(n, 3) unit normals of points on these faces: the file's own, or the face's where those stray from it."""
    flat = faces.flat.astype(np.float32)[face]
    if not faces.normals.any():
        return flat
    own = values_at(weights, faces.normals.astype(np.float32), face)
    length = np.maximum(np.sqrt(np.einsum("nj,nj->n", own, own)), np.float32(1e-9))
    stray = np.abs(np.einsum("nj,nj->n", own, flat)) < np.float32(0.2) * length
    return np.where(stray[:, None], flat, own / length[:, None])


def painted_points(faces: Faces, face: Ints, weights: Singles) -> Singles:
    """(n, 4) colours and opacities, 0 to 1, of points on these faces."""
    paints = [item.paint or Paint(PLAIN) for item in faces.surfaces]
    surface = faces.surface.take(face)
    colors = np.array([paint.color for paint in paints], dtype=np.float32).take(surface, axis=0)
    pictures: dict[Texture, Singles | None] = {}
    for index, paint in enumerate(paints):
        if paint.texture is None or faces.surfaces[index].uv is None:
            continue
        if paint.texture not in pictures:
            pictures[paint.texture] = texels(paint.texture.image)
        picture = pictures[paint.texture]
        if picture is not None:
            chosen = np.flatnonzero(surface == index)
            height, width = picture.shape[:2]
            u, v = values_at(weights[chosen], faces.uv.astype(np.float32), face[chosen]).T % 1.0
            colors[chosen] *= picture[((1.0 - v) * height).astype(int) % height, (u * width).astype(int) % width]
    return colors


def texels(image: Image.Image) -> Singles | None:
    """(h, w, 4) colours and opacities of a texture, 0 to 1; None where it is broken."""
    try:
        skin = decode_texture(image)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # what Pillow raises on a bad picture
        return None
    color = np.asarray(skin.color, dtype=np.float32) / 255.0
    mask = np.ones_like(color) if skin.opacity is None else np.asarray(skin.opacity, dtype=np.float32) / 255.0
    return np.dstack([color, mask[..., :1]])
