"""An object's triangles, and what is known at any point of them: normal, colour and opacity."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from PIL import Image

from asset2sim.assets.surfaces.scene import Scene
from asset2sim.assets.surfaces.surface import (
    PLAIN,
    Bools,
    Floats,
    Ints,
    Paint,
    Surface,
    Texture,
    decode_texture,
    face_normals,
    unit_vectors,
)
from asset2sim.physics.arrays import Array, box_of
from asset2sim.render.camera import Singles
from asset2sim.render.first_hits import Triangles

LIFT, BACK_TO_BACK = 4e-5, 1e-5
"""How far the smallest flat surface is lifted off what it lies on, and each of two triangles in one place that show
their colours to opposite sides, as shares of the object's size: a tenth of a large view's pixel and less."""
FLAT = 1e-4
"""A surface is flat if it is no thicker than this share of the object's size."""
QUANTUM = 1e-5
"""Two corners are the same point if they are within about this share of the object's size."""
INVISIBLE, OPAQUE = 0.1, 0.95
"""Opacities below which nothing is drawn, and from which nothing shows through."""
SHEEN = 0.07
"""The darkest a colour is drawn, in 0 to 1: even black plastic returns enough light to show its edges."""
STRAY = 0.2
"""Cosine of the angle between a triangle's normal and the file's from which that counts."""
SCATTERED, EVENLY = 4000, np.array([[0.7548776662], [0.5698402910]])
"""Points that cast an object's shadow, and steps whose multiples fill a square evenly."""
DIAGONALS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)][14:], dtype=float)
"""Directions along which a link's furthest points are sought, which must fit in: one of each opposite two."""


@dataclass(frozen=True, eq=False)
class Faces:
    """An object's triangles, those of ``links[i]`` together. (m, 3, 3) ``corners``, m, and ``normals``, which are zero
    where the file has none, (m, 3, 2) ``uv``, (m, 3) ``flat`` normals, and (m,) ``surface``, the index in ``surfaces``
    of the one that each is of, and ``link``."""

    corners: Floats
    normals: Floats
    uv: Floats
    flat: Floats
    surface: Ints
    link: Ints
    surfaces: tuple[Surface, ...]
    links: tuple[str, ...]

    @property
    def points(self) -> Floats:
        """(3 m, 3) corners of all triangles, m."""
        return self.corners.reshape(-1, 3)

    @cached_property
    def size_m(self) -> float:
        """The longest edge of its box, m."""
        return float(np.ptp(self.points, axis=0).max())

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

    @cached_property
    def boxes(self) -> Array:
        """(links, 8, 3) corners of each link's box, m."""
        ends = np.stack([self.extremes[..., :3].min(axis=1), self.extremes[..., :3].max(axis=1)])
        return np.stack([ends[list(which), :, [0, 1, 2]].T for which in product((0, 1), repeat=3)], axis=1)

    @cached_property
    def scattered(self) -> list[Floats]:
        """Of each link (4, n) points, homogeneous; those of all links are spread evenly over the triangles."""
        one, other = np.diff(self.corners, axis=1).transpose(1, 0, 2)
        reached = np.cumsum(np.linalg.norm(np.cross(one, other), axis=1))
        count = np.arange(SCATTERED)
        face = np.searchsorted(reached, (count + 0.5) / SCATTERED * reached[-1]).clip(max=len(reached) - 1)
        u, v = (count * EVENLY) % 1.0
        u, v = np.where(u + v > 1.0, (1.0 - u, 1.0 - v), (u, v))[..., None]
        points = self.corners[face, 0] + (u + v) * one[face] + v * other[face]
        bounds = np.searchsorted(self.link[face], np.arange(1, len(self.links)))
        return np.split(np.concatenate([points, np.ones((SCATTERED, 1))], axis=1).T, bounds, axis=1)

    @cached_property
    def _of_links(self) -> dict[tuple[tuple[int, ...], bool], tuple[Ints, Triangles]]:
        return {}

    def of_links(self, links: tuple[int, ...], clear: bool) -> tuple[Ints, Triangles]:
        """The opaque triangles of some links, or the ``clear`` ones, by number and ready to be looked at."""
        if (links, clear) not in self._of_links:
            opacity = self.paints[:, 3].copy()
            for index, skin in self.skins.items():
                opacity[index] *= skin[..., 3].min()
            chosen = np.flatnonzero(np.isin(self.link, links) & ((opacity < OPAQUE)[self.surface] == clear))
            self._of_links[links, clear] = chosen, Triangles(self.corners[chosen])
        return self._of_links[links, clear]

    @cached_property
    def rows(self) -> tuple[Singles, Singles, Singles]:
        """A row for each number of a triangle: (3, 3, m) normals and (2, 3, m) texture coordinates at the corners, and
        (3, m) flat normals. NumPy takes some four times as long for columns."""
        normals, uv = (np.ascontiguousarray(of.transpose(2, 1, 0), np.float32) for of in (self.normals, self.uv))
        return normals, uv, np.ascontiguousarray(self.flat.T, np.float32)

    @cached_property
    def paints(self) -> Singles:
        """(surfaces, 4) colours and opacities, 0 to 1, without their textures."""
        found = np.array([(item.paint or Paint(PLAIN)).color for item in self.surfaces], dtype=np.float32)
        # An exporter that writes an opacity of zero everywhere did not mean an invisible object.
        if found[:, 3].max() < INVISIBLE:
            found[:, 3] = 1.0
        found[:, :3] = SHEEN + (1.0 - SHEEN) * found[:, :3]
        return found

    @cached_property
    def skins(self) -> dict[int, Singles]:
        """Index of a surface → (h, w, 4) colours and opacities of its texture, 0 to 1, where that is a good one."""
        pictures: dict[Texture, Singles | None] = {}
        found: dict[int, Singles] = {}
        for index, item in enumerate(self.surfaces):
            texture = None if item.paint is None or item.uv is None else item.paint.texture
            if texture is not None:
                if texture not in pictures:
                    pictures[texture] = texels(texture.image)
                picture = pictures[texture]
                if picture is not None:
                    found[index] = picture
        return found

    def looks(self, face: Ints, weights: Singles) -> tuple[Singles, Singles]:
        """(n, 4) colours and opacities, 0 to 1, and (n, 3) unit normals of points on these triangles, by (3, n) weights
        of their corners: the file's own, turned to the side of the triangle's, or that, where those stray from it."""
        normals, uv, flats = self.rows
        own, flat = [between(corners, face, weights) for corners in normals], [row.take(face) for row in flats]
        along, square = (x[0] * y[0] + x[1] * y[1] + x[2] * y[2] for x, y in ((own, flat), (own, own)))
        length = np.maximum(np.sqrt(square), np.float32(1e-9))
        stray, unit = np.abs(along) < np.float32(STRAY) * length, np.copysign(1.0 / length, along)
        normal = np.stack([np.where(stray, by, at * unit) for at, by in zip(own, flat, strict=True)], axis=1)
        surface = self.surface.take(face)
        color = self.paints.take(surface, axis=0)
        for index, picture in self.skins.items():
            chosen = np.flatnonzero(surface == index)
            if len(chosen):
                height, width = picture.shape[:2]
                u, v = (between(corners, face[chosen], weights[:, chosen]) % 1.0 for corners in uv)
                row, column = ((1.0 - v) * height).astype(int) % height, (u * width).astype(int) % width
                color[chosen] *= picture[row, column]
        return color, normal


def between(corners: Singles, face: Ints, weights: Singles) -> Singles:
    """(n,) numbers of points on triangles, of the (3, m) at the triangles' corners, by (3, n) weights."""
    found = weights[0] * corners[0].take(face)
    found += weights[1] * corners[1].take(face)
    found += weights[2] * corners[2].take(face)
    return np.asarray(found)


def faces_of(scene: Scene) -> Faces:
    """The scene's triangles. Of those that lie exactly on each other the smallest surface's is kept, and one of another
    paint that is turned to the other side. Flat surfaces are lifted off what they lie on, to both sides."""
    link_of = {id(surface): link for surface, link in zip(scene.surfaces, scene.links, strict=True)}
    links = tuple(dict.fromkeys(scene.links))
    number = {name: place for place, name in enumerate(links)}
    layers = with_lifts(scene.surfaces)
    surfaces = tuple(surface for surface, _ in layers)
    corners = np.concatenate([item.vertices[item.faces] for item in surfaces])
    normals, uv = (
        np.concatenate([np.zeros((*item.faces.shape, wide)) if of is None else of[item.faces] for item, of in given])
        for wide, given in (
            (3, [(item, item.normals) for item in surfaces]), (2, [(item, item.uv) for item in surfaces])
        )
    )  # fmt: skip
    index = np.repeat(np.arange(len(surfaces)), [len(item.faces) for item in surfaces])
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max()) or 1.0
    link = np.array([number[link_of[id(surface)]] for surface in surfaces])[index]
    flat = unit_vectors(face_normals(corners))
    kept, paired = drawn_faces(corners, flat, index, [surface.paint for surface in surfaces], size)
    lift = np.array([lift for _, lift in layers])[index] + BACK_TO_BACK * size * paired
    other = kept[(lift[kept] > 0.0) & ~paired[kept]]
    side = np.concatenate([np.ones(len(kept)), -np.ones(len(other))])
    kept = np.concatenate([kept, other])
    order = np.lexsort((kept, link[kept]))
    kept, side = kept[order], side[order]
    corners = corners[kept] + (side * lift[kept])[:, None, None] * flat[kept][:, None]
    return Faces(corners, normals[kept], uv[kept], flat[kept], index[kept], link[kept], surfaces, links)


def drawn_faces(
    corners: Floats, flat: Floats, surface: Ints, paints: Sequence[Paint | None], size: float
) -> tuple[Ints, Bools]:
    """The numbers of (m, 3, 3) triangles to draw, with (m, 3) normals, the first of those in one place and the first of
    another paint that is turned round; and (m,) which have such another. ``surface`` is the (m,) place of each one's
    paint."""
    grid = np.rint(corners / (QUANTUM * size)).astype(np.int64)
    points = mixed_hashes(mixed_hashes(mixed_hashes(grid[..., 0]) + grid[..., 1]) + grid[..., 2])
    # A sum is the same for every order of the corners.
    _, first, group = np.unique(points.sum(axis=1), return_index=True, return_inverse=True)
    turned = np.einsum("ij,ij->i", flat, flat[first][group]) < 0.0
    number = {paint: place for place, paint in enumerate(dict.fromkeys(paints))}
    paint = np.array([number[paint] for paint in paints])[surface]
    other = np.flatnonzero(turned & (paint != paint[first][group]))
    other = other[np.unique(group[other], return_index=True)[1]]
    return np.concatenate([first, other]), np.isin(group, group[other])


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


def mixed_hashes(values: Ints) -> Ints:
    """Hashed integers, so that sums of them do not collide by accident."""
    stirred = values.view(np.uint64) + np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((33, 0xFF51AFD7ED558CCD), (33, 0xC4CEB9FE1A85EC53), (33, 1)):
        stirred = (stirred ^ (stirred >> np.uint64(shift))) * np.uint64(factor)
    return stirred.view(np.int64)


def texels(image: Image.Image) -> Singles | None:
    """(h, w, 4) colours and opacities of a texture, 0 to 1; None where it is broken."""
    try:
        skin = decode_texture(image)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # what Pillow raises on a bad picture
        return None
    return np.asarray(skin, dtype=np.float32) / 255.0
