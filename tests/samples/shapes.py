"""Small closed meshes for the sample objects: every one convex, watertight and wound outwards, y up. Convex on purpose:
an engine turns each collision file into its convex hull, so a concave part is several pieces."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array, Faces

Point = tuple[float, float, float]
Pair = tuple[float, float]

SIDES = ("bottom", "top", "left", "right", "back", "front")


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh: ``vertices`` (n, 3) float, object units; ``faces`` (m, 3) int; ``uv`` (m, 3, 2) float."""

    vertices: Array
    faces: Faces
    uv: Array | None = None


def signed_volume(mesh: Mesh) -> float:
    """The volume that the faces enclose, positive where they are wound outwards, object units cubed."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def loft(start: Iterable[Sequence[float]], end: Iterable[Sequence[float]]) -> Mesh:
    """The convex solid between two convex polygons of equally many corners, (n, 3) float each."""
    first, last = np.array(list(start), dtype=float), np.array(list(end), dtype=float)
    n = len(first)
    faces = [(0, i + 1, i) for i in range(1, n - 1)]
    faces += [(n, n + i, n + i + 1) for i in range(1, n - 1)]
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, j, n + j), (i, n + j, n + i)]
    mesh = Mesh(np.vstack([first, last]), np.array(faces, dtype=np.int64))
    return mesh if signed_volume(mesh) > 0.0 else Mesh(mesh.vertices, mesh.faces[:, ::-1].copy())


def block(low: Point, high: Point) -> Mesh:
    """A box with axis-parallel edges between two opposite corners."""
    return frustum(low, high, 0.0)


def frustum(low: Point, high: Point, inset: float) -> Mesh:
    """A block whose top face is smaller by ``inset`` on each of its four sides: a key cap, a foot."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    bottom = [(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)]
    a, b, c, d = x0 + inset, x1 - inset, z0 + inset, z1 - inset
    return loft(bottom, [(a, y1, c), (b, y1, c), (b, y1, d), (a, y1, d)])


def shell(low: Point, high: Point, wall: float, without: str) -> list[Mesh]:
    """The walls of a hollow box as one block each; ``without`` names the open side (of ``SIDES``, or none)."""
    present = [side for side in SIDES if side != without]
    (x0, y0, z0), (x1, y1, z1) = low, high
    # Bottom and top span everything, left and right stand between them, back and front between those: no wall overlaps.
    ya, yb = y0 + wall * ("bottom" in present), y1 - wall * ("top" in present)
    xa, xb = x0 + wall * ("left" in present), x1 - wall * ("right" in present)
    walls = {
        "bottom": block((x0, y0, z0), (x1, y0 + wall, z1)),
        "top": block((x0, y1 - wall, z0), (x1, y1, z1)),
        "left": block((x0, ya, z0), (x0 + wall, yb, z1)),
        "right": block((x1 - wall, ya, z0), (x1, yb, z1)),
        "back": block((xa, ya, z0), (xb, yb, z0 + wall)),
        "front": block((xa, ya, z1 - wall), (xb, yb, z1)),
    }
    return [walls[side] for side in present]


def disc(axis: str, centre: Point, radius: float | Pair, length: float, sides: int = 24, stretch: float = 1.0) -> Mesh:
    """A cylinder, or a frustum for two radii, along ``axis`` from ``centre``; ``stretch`` widens its second radius."""
    near, far = radius if isinstance(radius, tuple) else (radius, radius)
    turns = [2.0 * math.pi * i / sides for i in range(sides)]

    def circle(r: float, along: float) -> list[Point]:
        return [_place(axis, centre, r * math.cos(t), r * math.sin(t) * stretch, along) for t in turns]

    return loft(circle(near, 0.0), circle(far, length))


def ring(
    axis: str,
    centre: Point,
    inner: float | Pair,
    outer: float | Pair,
    length: float,
    sides: int,
    stretch: float = 1.0,
    arc: Pair = (0.0, 2.0 * math.pi),
) -> list[Mesh]:
    """A tube wall around ``axis`` as ``sides`` convex pieces over ``arc`` (radians); pairs of radii make it a cone."""
    (i0, i1), (o0, o1) = (value if isinstance(value, tuple) else (value, value) for value in (inner, outer))
    turns = [arc[0] + (arc[1] - arc[0]) * i / sides for i in range(sides + 1)]

    def quad(a: float, b: float, r_in: float, r_out: float, along: float) -> list[Point]:
        corners = [(r_in, a), (r_out, a), (r_out, b), (r_in, b)]
        return [_place(axis, centre, r * math.cos(t), r * math.sin(t) * stretch, along) for r, t in corners]

    return [loft(quad(a, b, i0, o0, 0.0), quad(a, b, i1, o1, length)) for a, b in itertools.pairwise(turns)]


def tube(path: Sequence[Point], normal: Point, radius: float, sides: int = 6) -> list[Mesh]:
    """A round bar along a planar ``path``, one mitred piece a stretch; ``normal`` is the plane's, unit length."""
    points, out = np.array(path, dtype=float), np.array(normal, dtype=float)
    steps = np.diff(points, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    sections = []
    for i, point in enumerate(points):
        before, after = steps[max(i - 1, 0)], steps[min(i, len(steps) - 1)]
        tangent = (before + after) / np.linalg.norm(before + after)
        side = np.cross(out, tangent) / float(tangent @ before)
        turns = [2.0 * math.pi * (k + 0.5) / sides for k in range(sides)]
        sections.append([point + radius * (math.cos(t) * side + math.sin(t) * out) for t in turns])
    return [loft(a, b) for a, b in itertools.pairwise(sections)]


def textured(mesh: Mesh) -> Mesh:
    """The same mesh with texture coordinates: a picture over the mesh's box, projected along each face's main axis."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    unit = (mesh.vertices - low) / np.where(high > low, high - low, 1.0)
    uv = np.zeros((len(mesh.faces), 3, 2))
    for row, face in enumerate(mesh.faces):
        a, b, c = mesh.vertices[face]
        across = int(np.argmax(np.abs(np.cross(b - a, c - a))))
        first, second = ((2, 1), (0, 2), (0, 1))[across]
        uv[row] = unit[face][:, [first, second]]
    return Mesh(mesh.vertices, mesh.faces, uv)


def _place(axis: str, centre: Point, first: float, second: float, along: float) -> Point:
    x, y, z = centre
    if axis == "x":
        return (x + along, y + first, z + second)
    if axis == "y":
        return (x + first, y + along, z + second)
    return (x + first, y + second, z + along)
