"""The kind of its category that an object is likeliest by its three edges, and the scale at which it is."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from statistics import NormalDist

from asset2sim.guidance import tables
from asset2sim.guidance.object_info import ObjectInfo, Vector
from asset2sim.guidance.parts import MovablePart, depth_width_height, parts_of, shown_front
from asset2sim.guidance.tables import Proportions

SIDEWAYS = 6.0
"""−2 ln of the share of objects whose front is not where it is taken to be, towards x where no part shows it (so in
ROS and in PartNet-Mobility): one in 20."""
LEVEL = 0.2
"""|a · b| of unit axes up to which they are about square; a hinge and z are so of lids and of doors that drop."""
ON_WALL = ("wall", "hangs")
"""How kinds are placed that are sought among what hangs on a wall; only of those that hang do their edges say so."""
PLINTH_SHARE = 0.04
"""Height of a plinth over an object's, at least: those of base units are 0.10 to 0.15 m of 0.87 m."""
MOST_MISFIT = 16.0
"""Squared σ by which three edges may miss the usual ones for an object to be of that kind: four σ in one of them."""
LEAST_SHARE = 0.05
"""Likelihood over that of the likeliest kind, from which a kind counts."""
HALVINGS, REACH = 40, 3.0
"""Steps in which a share of a mixture is sought, and how many σ around the means."""
NORMAL = NormalDist()
SURE_SHARE = 0.8
"""Share of the likelihood of all kinds from which an object is of the category of its likeliest."""


@dataclass(frozen=True)
class Fit:
    """The ``scale`` at which an object is likeliest of its ``kind``, the scale's relative ``sigma``, how that kind is
    ``placed`` where that is not as its category is, and the ``category`` that it is of its own, "" for none."""

    scale: float
    sigma: float
    kind: str
    placed: str = ""
    category: str = ""


def fitted_kind(info: ObjectInfo, category: str, named: Sequence[str] = (), *, hangs: bool = False) -> Fit | None:
    """The kind of its category that an object is likeliest by its edges and the parts that it has, of those that hang
    on a wall where it ``hangs`` and the table has some; else none whose edges do not show that it does. Of those that
    are ``named``, where its edges may be of one."""
    parts = parts_of(info, category)
    hinges = [part.joint for part in parts if part.joint.motion == "hinge"]
    names = {part.name for part in parts}
    if sum(part.name == "door" for part in parts) > 1:
        names.add("doors")
    if any(abs(joint.axis[2]) < LEVEL for joint in hinges):
        names.add("level hinge")
    if hangs:
        names.add("hangs")
    if stands_off(info, parts):
        names.add("plinth")
    return fitted_edges(
        depth_width_height(info),
        category,
        frozenset(names),
        placed=ON_WALL if hangs else ("", "stands", "hangs"),
        shown=shown_front(info, parts) is not None,
        known=part_scales(parts, category),
        named=named,
    )


def stands_off(info: ObjectInfo, parts: Sequence[MovablePart]) -> bool:
    """Whether an object's fronts end well over its bottom, as over legs and a plinth."""
    fronts = {part.link.name for part in parts if part.name in ("door", "drawer") and part.link is not None}
    bottoms = [(link.center_m[2] - link.box_m[2] / 2.0, link.name) for link in info.links if link.has_geometry]
    front = min((bottom for bottom, name in bottoms if name in fronts), default=-math.inf)
    return front - min(bottoms, default=(0.0, ""))[0] > PLINTH_SHARE * info.size_m[2]


def part_scales(parts: Sequence[MovablePart], category: str) -> tuple[tuple[float, float], ...]:
    """Logarithm of the scale at which parts of about the same size on all things of a category have it, and its σ:
    doors on upright hinges are as wide, drawers as high."""
    found = []
    for size in tables.part_sizes(category):
        boxes = [
            part.link.box_m
            for part in parts
            if part.name == size.part and part.link is not None and (part.joint.motion != "hinge" or upright(part))
        ]
        edges = [box[2] if size.edge == "height" else max(box[:2]) for box in boxes if min(box) > 0.0]
        if edges:
            found.append((math.log(size.usual_m) - sum(map(math.log, edges)) / len(edges), size.spread))
    return tuple(found)


def upright(part: MovablePart) -> bool:
    """Whether a part turns about an upright axis."""
    return part.joint.axis[2] ** 2 > 0.5


def fitted_edges(
    size_m: Vector,
    category: str,
    parts: frozenset[str] = frozenset(),
    *,
    placed: Collection[str] = ("", "stands", *ON_WALL),
    shown: bool = False,
    known: Sequence[tuple[float, float]] = (),
    named: Sequence[str] = (),
) -> Fit | None:
    """The scale at which depth, width and height, m, are likeliest together, of the kinds of their category that are
    ``placed`` so where the table has some, and whose part is or is not among its ``parts``; None where that has no
    proportions that would be like it. ``known``: logarithms of the scale by parts of known size, each with its σ;
    ``named``: the kinds that count where its edges may be of one.
    Unless its front is ``shown``, what is taken for its depth may be its width where that fits far better.

    Of each kind the maximum of a normal likelihood of these logarithms: their mean, each weighed by 1 / σ². Its σ grows
    with how far they disagree. Of all kinds that stand, or hang, as the likeliest does, the median by their
    likelihoods: between two kinds the size is between theirs, and less sure.
    """
    if min(size_m) <= 0.0:
        return None
    fits = []
    kinds = [kind for kind in tables.proportions().get(category, ()) if kind.may_have(parts)]
    for kind in [kind for kind in kinds if kind.placed in placed] or kinds:
        seen = ((size_m[0], size_m[1], 0.0), (size_m[1], size_m[0], SIDEWAYS))
        for depth, width, rare in seen[:1] if shown else seen:
            compared = zip(kind.usual_m, (depth, width, size_m[2]), kind.spread, strict=True)
            edges = [(math.log(usual / edge), spread) for usual, edge, spread in compared]
            if _agreed(edges)[2] > MOST_MISFIT:
                continue
            mean, weight, misfit = _agreed([*edges, *known])
            # All of them determine one scale: the others are left to tell how well they agree.
            sigma = math.sqrt(max(misfit / (len(edges) + len(known) - 1), 1.0) / weight)
            # Less likely is what fits worse, and what is so broad that it fits anything.
            unlikely = misfit + 2.0 * sum(map(math.log, kind.spread)) + math.log(weight) + rare
            fits.append((kind.odds * math.exp(-unlikely / 2.0), mean, sigma, kind))
    if not fits:
        return None
    fits = [fit for fit in fits if fit[3].kind in named] or fits
    most, *_, best = max(fits, key=lambda fit: fit[0])
    chosen = [
        fit for fit in fits if fit[0] >= LEAST_SHARE * most and (fit[3].placed in ON_WALL) is (best.placed in ON_WALL)
    ]
    low, middle, high = (_quantile(chosen, share) for share in (NORMAL.cdf(-1.0), 0.5, NORMAL.cdf(1.0)))
    sure = sum(fit[0] for fit in chosen if fit[3].category == best.category)
    category = best.category if sure >= SURE_SHARE * sum(fit[0] for fit in chosen) else ""
    return Fit(math.exp(middle), (high - low) / 2.0, best.kind, best.placed, category)


def _agreed(values: Sequence[tuple[float, float]]) -> tuple[float, float, float]:
    """The likeliest mean of values, each with its σ, its weight 1 / σ², and the squared σ by which they miss it."""
    weight = sum(spread**-2 for _, spread in values)
    mean = sum(value / spread**2 for value, spread in values) / weight
    return mean, weight, sum(((value - mean) / spread) ** 2 for value, spread in values)


def _quantile(fits: Sequence[tuple[float, float, float, Proportions]], share: float) -> float:
    """The value below which this share of a mixture of normal distributions lies: of each its weight, mean and σ."""
    low, high = (turn(at + sign * REACH * own for _, at, own, _ in fits) for turn, sign in ((min, -1), (max, 1)))
    whole = sum(fit[0] for fit in fits)
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        below = sum(weight * NormalDist(at, own).cdf(middle) for weight, at, own, _ in fits)
        low, high = (middle, high) if below < share * whole else (low, middle)
    return (low + high) / 2.0
