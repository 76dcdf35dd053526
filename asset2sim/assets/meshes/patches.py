"""Convex pieces of any triangle mesh that keep a given hollow empty: faces grouped from the top down, then joined.

The faces are halved along their longest extent until the hull of each group stays out of the hollow, and groups are
joined again, those first whose common hull adds the least volume, as long as that one stays out as well (hierarchical
approximate convex decomposition, Mamou and Ghorbel 2009, does so with faces; here the hollow says what may be filled).
Every face lies in a piece, whatever the mesh's quality; both sides of a wall end in one piece, and a solid is filled
because nothing forbids it. Budgets of groups and pieces bound the work, so the same mesh always gives the same pieces.
"""

import heapq
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from asset2sim.assets.meshes.hollow import ALLOWED_DEPTH, LOOSE_DEPTHS, Hollow
from asset2sim.assets.meshes.hull import spread_directions, used_points
from asset2sim.physics.arrays import Array, cross
from asset2sim.physics.convex_hull import convex_hull

MOST_GROUPS = 192
"""Groups that a shape's faces are halved into at most: joining costs a millisecond for each pair that touches."""
NO_LIMIT = 1_000_000
"""Number of pieces that stands for no limit."""
ENOUGH = 12
"""Pieces of one shell above which they may stand a little deeper in the hollow: contacts get slower with each."""
MOST_CORNERS = 80
"""Corners of a piece that was cut or joined: 80 directions lie 23° apart, and what they miss of a curve is 2 % of its
radius; hulls and contacts cost in proportion."""
DIRECTIONS = spread_directions(MOST_CORNERS)
CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
"""Directions in which a piece's outermost corners are looked for."""
SHARES = np.array([0.25, 0.5, 0.75])
"""Where along a line between two pieces the hollow is looked at, for a tenth of what making their hull costs."""
AT_ONCE = 64
"""Hulls that are looked up in the hollow together: some 10 MB of samples."""
ROUNDING = 1e-6
"""Share of a hull's volume by which Qhull's may be less for rounding, far more than it is."""
ADDS_MUCH, LAST = 3, 4
"""Ranks of joins that stay out of the hollow and add more than is allowed, as of wires side by side; and of others."""
PARTNERS = 8
"""Partners tried for each piece: the joins that add least are among those whose boxes grow least."""


@dataclass(frozen=True)
class PatchPiece:
    """A convex piece: its (k, 3) corners, its (m, 3, 3) faces and its volume (m³)."""

    points: Array
    triangles: Array
    volume: float

    @cached_property
    def low(self) -> Array:
        """(3,) lowest corner of its box."""
        return np.asarray(self.points.min(axis=0))

    @cached_property
    def extremes(self) -> Array:
        """(n, 3) its outermost corners, at most eight."""
        return np.asarray(self.points[furthest_points(self.points, CORNERS)])

    @cached_property
    def high(self) -> Array:
        """(3,) highest corner of its box."""
        return np.asarray(self.points.max(axis=0))

    @cached_property
    def wedges(self) -> tuple[Array, Array]:
        """(3, m) and (m,): with p @ the first + the second, the volumes between each face and a point p, m³, above 0
        where the point sees the face from outside."""
        first = self.triangles[:, 0]
        normals = cross(self.triangles[:, 1] - first, self.triangles[:, 2] - first) / 6.0
        inward = np.einsum("ij,ij->i", normals, self.points.mean(axis=0) - first) > 0.0
        normals[inward] *= -1.0
        return normals.T, -np.einsum("ij,ij->i", normals, first)

    def beyond(self, points: Array) -> float:
        """The most volume that any of (n, 3) points adds to its hull, m³."""
        normals, offsets = self.wedges
        return float(np.maximum(points @ normals + offsets, 0.0).sum(axis=1).max())


def piece_of(points: Array, thickness: float) -> PatchPiece:
    """The hull of (n, 3) points; where it is flatter than ``thickness`` (m), it is made as thick about its middle."""
    hull = convex_hull(points)
    # A plate's volume is half its area times its thickness.
    if hull is not None and 2.0 * hull.volume >= thickness * hull.area:
        return PatchPiece(used_points(points, hull.simplices), points[hull.simplices], float(hull.volume))
    centre = points.mean(axis=0)
    normal = np.linalg.svd(points - centre, full_matrices=len(points) < 3)[2][-1]
    height = (points - centre) @ normal
    if float(np.ptp(height)) < thickness:
        level = points - np.outer(height - (height.max() + height.min()) / 2.0, normal)
        points = np.vstack([level + normal * thickness / 2.0, level - normal * thickness / 2.0])
    hull = convex_hull(points)
    if hull is None:  # a needle: thick enough along every axis
        steps = np.vstack([np.eye(3), -np.eye(3)]) * thickness / 2.0
        points = (points[:, None] + steps[None]).reshape(-1, 3)
        hull = ConvexHull(points)
    return PatchPiece(used_points(points, hull.simplices), points[hull.simplices], float(hull.volume))


def piece_of_few_corners(points: Array, thickness: float) -> PatchPiece:
    """``piece_of`` with at most ``MOST_CORNERS`` corners, those furthest along evenly spread directions."""
    piece = piece_of(points, thickness)
    if len(piece.points) <= MOST_CORNERS:
        return piece
    return piece_of(piece.points[furthest_points(piece.points, DIRECTIONS)], thickness)


def furthest_points(points: Array, directions: Array) -> list[int]:
    """Indices of the (n, 3) points that lie furthest along any of (k, 3) directions, in rising order."""
    return sorted(set(np.argmax(points @ directions.T, axis=0).tolist()))


def pieces_around_hollow(
    vertices: Array, faces: NDArray[np.int64], hollow: Hollow, thickness: float
) -> list[PatchPiece]:
    """Convex pieces of (n, 3) vertices and (m, 3) faces that stay out of the hollow, as few as joining gives. Pieces
    thinner than ``thickness`` (m) are made as thick. Where ``MOST_GROUPS`` do not suffice the largest groups are halved
    first, and the other groups may fill the hollow."""
    return join_pieces(hulls_of_groups(vertices, faces, hollow, thickness), hollow, thickness, enough=ENOUGH)


def hulls_of_groups(vertices: Array, faces: NDArray[np.int64], hollow: Hollow, thickness: float) -> list[PatchPiece]:
    """The hulls of groups of faces, halved until each stays out of the hollow."""
    centres = vertices[faces].mean(axis=1)
    done: list[PatchPiece] = []
    waiting: list[tuple[float, int, PatchPiece, NDArray[np.int64]]] = []
    number = 0

    def place(index: NDArray[np.int64]) -> None:
        nonlocal number
        piece = piece_of_few_corners(vertices[np.unique(faces[index])], thickness)
        if len(index) == 1 or hollow.deepest(piece.points, piece.triangles) <= ALLOWED_DEPTH:
            done.append(piece)
        else:
            number += 1
            heapq.heappush(waiting, (-float(np.ptp(piece.points, axis=0).max()), number, piece, index))

    place(np.arange(len(faces)))
    while waiting and len(done) + len(waiting) < MOST_GROUPS:
        _, _, _, index = heapq.heappop(waiting)
        spread = np.ptp(centres[index], axis=0)
        axis = int(spread.argmax())
        middle = centres[index, axis].min() + spread[axis] / 2.0
        first = centres[index, axis] <= middle
        if first.all():  # all centres in one place
            first = np.arange(len(index)) < len(index) // 2
        place(index[first])
        place(index[~first])
    return done + [piece for _, _, piece, _ in waiting]


@dataclass(frozen=True)
class _Rule:
    """Limits of joining: ``limits`` is, for each rank of a join, the number of pieces above which it is made."""

    hollow: Hollow | None
    thickness: float
    limits: tuple[int, int, int, int, int]
    added_share: float

    @property
    def any_join(self) -> bool:
        """Whether joins that add much, or fill the hollow, may be made, so that they must be computed."""
        return self.limits[ADDS_MUCH] < NO_LIMIT


_JoinCandidate = tuple[int, float, int, int, PatchPiece | None]
"""A join: its rank, the volume it adds, the two pieces' indices, and their common hull; the least rank, the least
volume and None until that hull is made: nine in ten are not joined, and many lose a piece before their turn."""


def join_pieces(
    pieces: Sequence[PatchPiece],
    hollow: Hollow | None,
    thickness: float,
    *,
    enough: int = NO_LIMIT,
    most: int = NO_LIMIT,
    added_share: float = np.inf,
) -> list[PatchPiece]:
    """Fewer pieces: those are joined whose common hull stays out of the hollow and adds at most ``added_share`` of the
    smaller one's volume. Where more than ``enough`` are left the join goes on with hulls that stand a little in the
    hollow, and where more than ``most`` are, with any that stay out of it, as wires become a wall, and with all others
    last; always first with what adds least."""
    rule = _Rule(hollow, thickness, (1, min(enough, most), min(enough, most), most, most), added_share)
    slack = 0.0 if hollow is None else hollow.cell_m
    known = list(pieces)
    alive = list(range(len(known)))
    tried = {pair for index in alive for pair in _partners(known, index, alive, slack)}
    waiting = _unmade_joins(known, tried, rule)
    while len(alive) > 1:
        if not waiting and len(alive) > most:  # none that touch are left
            far = {pair for index in alive for pair in _partners(known, index, alive, np.inf, tried)}
            tried |= far
            waiting = _unmade_joins(known, far, rule)
        if not waiting:
            break
        rank, _, a, b, both = heapq.heappop(waiting)
        if a not in alive or b not in alive:
            continue
        if len(alive) <= rule.limits[rank]:
            break
        if both is None:
            due = [(a, b)]
            while waiting and waiting[0][0] == rank and waiting[0][4] is None and len(due) < AT_ONCE:
                _, _, a, b, _ = heapq.heappop(waiting)
                due += [(a, b)] if a in alive and b in alive else []
            joined = [(*pair, hull) for pair in due if (hull := _joined(known, pair, rule)) is not None]
            for offer in _ranked(known, joined, rule):
                heapq.heappush(waiting, offer)
            continue
        alive = [index for index in alive if index not in (a, b)] + [len(known)]
        known.append(both)
        near = _partners(known, alive[-1], alive, slack)
        tried.update(near)
        for offer in _unmade_joins(known, near, rule):
            heapq.heappush(waiting, offer)
    return [known[index] for index in alive]


def _unmade_joins(known: Sequence[PatchPiece], pairs: Collection[tuple[int, int]], rule: _Rule) -> list[_JoinCandidate]:
    """The joins of these pairs that a rule might make, each with the least volume that it adds, as a heap."""
    offers: list[_JoinCandidate] = []
    for a, b in pairs:
        least = least_added(known[a], known[b], rule.thickness)
        little = least <= rule.added_share * min(known[a].volume, known[b].volume)
        if little or rule.any_join:
            offers.append((0 if little else ADDS_MUCH, least, a, b, None))
    return sorted(offers)


def least_added(a: PatchPiece, b: PatchPiece, thickness: float) -> float:
    """A lower bound on what the common hull of two pieces (``piece_of_few_corners``) has over both volumes, m³: the
    hull of one with the furthest corner of the other. Minus infinity where their hull may lose corners."""
    corners = len(a.points) + len(b.points)
    if corners > MOST_CORNERS:
        return -np.inf
    whole = max(a.volume + a.beyond(b.points), b.volume + b.beyond(a.points)) * (1.0 - ROUNDING)
    if 2 * corners > MOST_CORNERS:
        # Made thicker, it has twice the corners; it is thick enough where it is so in the box about both.
        x, y, z = np.maximum(a.high, b.high) - np.minimum(a.low, b.low)
        if 2.0 * whole < thickness * 2.0 * (x * y + y * z + z * x):
            return -np.inf
    return whole - a.volume - b.volume


def _joined(known: Sequence[PatchPiece], pair: tuple[int, int], rule: _Rule) -> PatchPiece | None:
    """The common hull of two pieces, or None where the hollow between them already forbids it."""
    a, b = known[pair[0]], known[pair[1]]
    if not rule.any_join and rule.hollow is not None and rule.hollow.at(points_between(a, b)) > LOOSE_DEPTHS[-1]:
        return None
    return piece_of_few_corners(np.vstack([a.points, b.points]), rule.thickness)


def _ranked(
    known: Sequence[PatchPiece], joined: Sequence[tuple[int, int, PatchPiece]], rule: _Rule
) -> list[_JoinCandidate]:
    """The joins with their ranks, without those that no rule would ever make. Rank 0 stays out of the hollow and adds
    little, and 1 and 2 stand a little in it."""
    added = [both.volume - known[a].volume - known[b].volume for a, b, both in joined]
    smaller = [min(known[a].volume, known[b].volume) for a, b, _ in joined]
    little = [more <= rule.added_share * least for more, least in zip(added, smaller, strict=True)]
    looked = [small or rule.any_join for small in little]
    hulls = [(both.points, both.triangles) for (_, _, both), look in zip(joined, looked, strict=True) if look]
    depths = iter([0.0] * len(hulls) if rule.hollow is None else rule.hollow.deepest_each(hulls))
    offers: list[_JoinCandidate] = []
    for (a, b, both), more, small, look in zip(joined, added, little, looked, strict=True):
        depth = next(depths) if look else np.inf
        rank = sum(depth > bound for bound in (ALLOWED_DEPTH, *LOOSE_DEPTHS)) if small else LAST
        if rank == LAST and depth <= ALLOWED_DEPTH:
            rank = ADDS_MUCH
        if rule.limits[rank] < NO_LIMIT:
            offers.append((rank, more, a, b, both))
    return offers


def points_between(a: PatchPiece, b: PatchPiece) -> Array:
    """(n, 3) points on lines from one piece's outermost corners to the other's, all within their common hull."""
    first, second = a.extremes, b.extremes
    ends = first[:, None, None] + SHARES[:, None] * (second[None, :, None] - first[:, None, None])
    return np.asarray(ends.reshape(-1, 3))


def _partners(
    known: Sequence[PatchPiece], index: int, alive: Sequence[int], slack: float, tried: Collection[tuple[int, int]] = ()
) -> list[tuple[int, int]]:
    """Up to ``PARTNERS`` untried pairs with boxes at most ``slack`` apart, those whose common box adds least."""
    own = known[index]
    others = [other for other in alive if other != index and (min(index, other), max(index, other)) not in tried]
    if not others:
        return []
    lows, highs = np.array([known[other].low for other in others]), np.array([known[other].high for other in others])
    added = (np.maximum(highs, own.high) - np.minimum(lows, own.low)).prod(axis=1) - (highs - lows).prod(axis=1)
    meet = np.all(lows - slack <= own.high, axis=1) & np.all(highs + slack >= own.low, axis=1)
    order = np.argsort(np.where(meet, added, np.inf), kind="stable")[: min(PARTNERS, int(meet.sum()))]
    return [(min(index, others[i]), max(index, others[i])) for i in order]
