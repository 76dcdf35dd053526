"""Clear overlaps by cutting collision hulls where they reach into each other.

A hull fills what its mesh leaves open, and parts that touch or share a hinge overlap as authored. Where that stops a
joint, or no state near the requested one avoids it, the overlapping caps of both hulls are cut off, up to a share of
their extent. Visual meshes are not changed.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asset2sim.assets.hulls import Hulls
from asset2sim.assets.meshes.cylinder import shortened
from asset2sim.assets.meshes.hull import hull_of
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply
from schemas.features import JointFeatures
from schemas.recipe import CutHull

LARGEST_SHARE = 0.5
"""Largest share of its extent along the cut that a hull may lose in total: more would be a different shape."""
LARGEST_EXACT_SHARE = 0.1
"""The same where the hull equals the mesh: more would hide that the authored parts overlap."""
ROUNDS = 12
"""Passes over all pairs: cutting one pair can only shrink hulls, so few are ever needed."""
CLEARANCE_M = 2e-4
"""Gap left between two hulls beyond the engine's margins, m: a door may swing slightly towards its neighbour."""

Key = tuple[str, int]
"""One hull: its link, and its index among the link's hulls."""


@dataclass(frozen=True)
class Overlap:
    """Overlap of two hulls, links at (4, 4) poses: unit (3,) normal from B to A in their frame, and depth (m)."""

    a: Key
    b: Key
    pose_a: Array
    pose_b: Array
    normal: Array
    depth: float


@dataclass(frozen=True)
class TrimBound:
    """Largest total loss of a hull: share of its extent along the cut, and depth (m)."""

    share: float = LARGEST_SHARE
    depth_m: float = float("inf")


@dataclass(frozen=True)
class Cut:
    """Loss of one link to clear it of ``other``: depth of the deepest cut (m), and its share of the hull's extent."""

    link: str
    other: str
    depth_m: float
    share: float


@dataclass(frozen=True, eq=False)
class PlaneCut:
    """One hull cut to the half-space normal · x ≥ offset (m) of its link's frame: the (k, 3) points ``of`` which it was
    made, and the points that it ``left``."""

    of: Array
    left: Array
    normal: Array
    offset: float


def contact_pairs(
    joints: Sequence[JointFeatures], links: Sequence[str], passing: Iterable[tuple[str, str]] = ()
) -> Iterator[tuple[str, str]]:
    """Link pairs that engines let collide: all but a link and its parent, and those that are ``passing``."""
    apart = {frozenset(pair) for pair in passing} | {frozenset((joint.child, joint.parent)) for joint in joints}
    for index, first in enumerate(links):
        yield from ((first, second) for second in links[index + 1 :] if frozenset((first, second)) not in apart)


def trim(points: Array, normal: Array, offset: float) -> Array | None:
    """Hull points of the part with normal · x ≥ offset, of a wheel cut at its end a shorter wheel's; None if no volume
    is left.

    The clipped hull is spanned by the kept points and the crossings of kept-to-removed segments with the plane.
    """
    height = points @ normal - offset
    kept, removed = points[height >= 0.0], points[height < 0.0]
    if not len(removed):
        return points
    if not len(kept):
        return None
    wheel = shortened(points, normal, offset)
    if wheel is not None:
        return wheel
    above, below = height[height >= 0.0][:, None, None], -height[height < 0.0][None, :, None]
    crossing = (kept[:, None] * below + removed[None] * above) / (above + below)
    hull = hull_of(np.vstack([kept, crossing.reshape(-1, 3)]))
    return None if hull is None else hull.points


def cuts_of(whole: Hulls, final: Hulls, planes: Sequence[PlaneCut]) -> dict[str, tuple[CutHull, ...]]:
    """Link whose hulls differ from the whole ones → how each is cut out of one, as ``planes`` record it."""
    made = {id(step.left): step for step in planes}
    number = {(link, id(points)): index for link, pieces in whole.items() for index, points in enumerate(pieces)}

    def way(link: str, points: Array) -> CutHull:
        back: list[tuple[float, float, float, float]] = []
        while (link, id(points)) not in number:
            step = made[id(points)]
            a, b, c = (float(value) for value in step.normal)
            back.append((a, b, c, float(step.offset)))
            points = step.of
        return CutHull(hull=number[link, id(points)], planes=tuple(reversed(back)))

    def same(link: str) -> bool:
        pairs = zip(whole[link], final[link], strict=True)
        return len(whole[link]) == len(final[link]) and all(one is other for one, other in pairs)

    return {link: tuple(way(link, points) for points in pieces) for link, pieces in final.items() if not same(link)}


def cut_again(whole: Hulls, cuts: Mapping[str, Sequence[CutHull]]) -> Hulls:
    """The hulls with these links' cut as recorded. Raises ValueError where one is not there, or nothing is left."""
    made = dict(whole)
    for link, ways in cuts.items():
        pieces = []
        for way in ways:
            points: Array | None = whole[link][way.hull] if way.hull < len(whole.get(link, ())) else None
            for *normal, offset in way.planes:
                points = None if points is None else trim(points, np.array(normal), offset)
            if points is None:
                raise ValueError(f"link '{link}': its hull {way.hull} is not there, or nothing of it is left when cut")
            pieces.append(points)
        made[link] = tuple(pieces)
    return made


class Trimmer:
    """Hulls being cut, with each one's loss of extent; hulls of ``exact`` links equal their meshes and lose less.
    ``planes`` gets every cut that is tried."""

    def __init__(self, hulls: Hulls, exact: frozenset[str] = frozenset(), planes: list[PlaneCut] | None = None) -> None:
        self.exact = exact
        self.planes = [] if planes is None else planes
        self.hulls = {link: list(pieces) for link, pieces in hulls.items()}
        self.original = {(link, i): piece for link, pieces in hulls.items() for i, piece in enumerate(pieces)}
        self.cuts: dict[tuple[str, str], Cut] = {}

    def hull(self, key: Key) -> Array:
        """Current points of one hull, in its link's frame."""
        return self.hulls[key[0]][key[1]]

    def clear(
        self, overlap: Overlap, margin: float, part_a: float | None = None, bound: TrimBound | None = None
    ) -> bool:
        """Cut the hulls of an overlap until the engine's margins separate them; False where the bound is exceeded.

        A takes the share ``part_a`` (0 to 1) of the cut and B the rest; by default in proportion to their extents.
        """
        bound = bound or TrimBound()
        first, second = apply(overlap.pose_a, self.hull(overlap.a)), apply(overlap.pose_b, self.hull(overlap.b))
        low, high = float((first @ overlap.normal).min()), float((second @ overlap.normal).max())
        need = high - low + 2.0 * margin + CLEARANCE_M
        if need <= 0.0:
            return True
        if part_a is None:
            extent_a, extent_b = float(np.ptp(first @ overlap.normal)), float(np.ptp(second @ overlap.normal))
            part_a = extent_a / max(extent_a + extent_b, 1e-12)
        cuts = (
            self._cut(overlap.a, overlap.pose_a, overlap.normal, low + part_a * need, bound),
            self._cut(overlap.b, overlap.pose_b, -overlap.normal, -(high - (1.0 - part_a) * need), bound),
        )
        if cuts[0] is None or cuts[1] is None:
            return False
        for (key, other), (kept, depth, lost) in zip(
            ((overlap.a, overlap.b[0]), (overlap.b, overlap.a[0])), (cuts[0], cuts[1]), strict=True
        ):
            self.hulls[key[0]][key[1]] = kept
            known = self.cuts.get((key[0], other))
            if depth > 0.0 and (known is None or depth > known.depth_m):
                self.cuts[(key[0], other)] = Cut(key[0], other, depth, lost)
        return True

    def _cut(
        self, key: Key, pose: Array, normal: Array, offset: float, bound: TrimBound
    ) -> tuple[Array, float, float] | None:
        """The hull where normal · x ≥ offset (the pose's frame), with the depth (m) and share of its extent lost.

        None where the bound is exceeded or no volume is left.
        """
        rotation, translation = pose[:3, :3], pose[:3, 3]
        local, local_offset = rotation.T @ normal, offset - float(translation @ normal)
        hull = self.hull(key)
        if float((hull @ local).min()) >= local_offset:
            return hull, 0.0, 0.0
        heights = self.original[key] @ local
        depth = local_offset - float(heights.min())
        lost = depth / max(float(np.ptp(heights)), 1e-12)
        if lost > (LARGEST_EXACT_SHARE if key[0] in self.exact else bound.share) or depth > bound.depth_m:
            return None
        kept = trim(hull, local, local_offset)
        if kept is None:
            return None
        self.planes.append(PlaneCut(hull, kept, local, local_offset))
        return kept, depth, lost

    def state(self, *keys: Key) -> tuple[tuple[Array, ...], dict[tuple[str, str], Cut]]:
        """These hulls and all cuts as they are, for ``restore``."""
        return tuple(self.hull(key) for key in keys), dict(self.cuts)

    def restore(self, state: tuple[tuple[Array, ...], dict[tuple[str, str], Cut]], *keys: Key) -> None:
        """Put these hulls and all cuts back as ``state`` had them."""
        for key, points in zip(keys, state[0], strict=True):
            self.hulls[key[0]][key[1]] = points
        self.cuts = dict(state[1])

    def result(self) -> Hulls:
        """Current hulls of all links."""
        return {link: tuple(pieces) for link, pieces in self.hulls.items()}
