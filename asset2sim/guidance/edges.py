"""The kind of its category that an object is likeliest by its three edges, and the scale at which it is."""

import math
from dataclasses import dataclass

from asset2sim.guidance import tables
from asset2sim.guidance.object_info import ObjectInfo, Vector
from asset2sim.guidance.parts import depth_width_height, parts_of, shown_front

SIDEWAYS = 6.0
"""−2 ln of the share of objects whose front is not where it is taken to be, towards x where no part shows it (so in
ROS and in PartNet-Mobility): one in 20."""
LEVEL = 0.2
"""|a · b| of unit axes up to which they are about square; a hinge and z are so of lids and of doors that drop."""
ON_WALL = ("wall", "hangs")
"""How kinds are placed that are sought among what hangs on a wall; only of those that hang do their edges say so."""
WIDEST_LEAF_M = 0.8
"""Widest door on upright hinges of furniture and appliances, m: of cupboards 0.2 to 0.6, refrigerators up to 0.76."""
WIDE_LEAVES = ("Door", "Window")
"""Categories whose leaves may be wider."""
MOST_MISFIT = 16.0
"""Squared σ by which three edges may miss the usual ones for an object to be of that kind: four σ in one of them."""


@dataclass(frozen=True)
class Fit:
    """The ``scale`` at which an object is likeliest of its ``kind``, the scale's relative ``sigma``, how that kind is
    ``placed`` where that is not as its category is, and the ``category`` that it is of its own, "" for none."""

    scale: float
    sigma: float
    kind: str
    placed: str = ""
    category: str = ""


def fitted_kind(info: ObjectInfo, category: str, *, hangs: bool = False) -> Fit | None:
    """The kind of its category that an object is likeliest by its edges and the parts that it has."""
    parts = parts_of(info, category)
    hinges = [part.joint for part in parts if part.joint.motion == "hinge"]
    names = {part.name for part in parts}
    if sum(part.name == "door" for part in parts) > 1:
        names.add("doors")
    if any(abs(joint.axis[2]) < LEVEL for joint in hinges):
        names.add("level hinge")
    if hangs:
        names.add("hangs")
    upright = (p.link for p in parts if p.name == "door" and p.joint.motion == "hinge" and p.joint.axis[2] ** 2 > 0.5)
    leaf_m = 0.0 if category in WIDE_LEAVES else max((max(link.box_m[:2]) for link in upright if link), default=0.0)
    shown = shown_front(info, parts) is not None
    return fitted_edges(depth_width_height(info), category, frozenset(names), hangs=hangs, shown=shown, leaf_m=leaf_m)


def fitted_edges(
    size_m: Vector,
    category: str,
    parts: frozenset[str] = frozenset(),
    *,
    hangs: bool = False,
    shown: bool = False,
    leaf_m: float = 0.0,
) -> Fit | None:
    """The scale at which depth, width and height, m, are likeliest together, of the likeliest kind of their category,
    of those that hang on a wall where it ``hangs`` and the table has some, and whose part is or is not among its
    ``parts``; None where that has no proportions that would be like it.
    No kind of which a door as wide as ``leaf_m`` at the authored scale would be wider than doors of furniture are.
    Unless its front is ``shown``, what is taken for its depth may be its width where that fits far better.

    The maximum of a normal likelihood of the edges' logarithms: their mean, each weighed by 1 / σ². Its σ grows with
    how far the edges disagree.
    """
    if min(size_m) <= 0.0:
        return None
    fits = []
    kinds = [
        kind
        for kind in tables.proportions().get(category, ())
        if not kind.has or (kind.has in parts) or (kind.has[0] == "-" and kind.has[1:] not in parts)
    ]
    for known in [kind for kind in kinds if hangs and kind.placed in ON_WALL] or kinds:
        weights = [spread**-2 for spread in known.spread]
        seen = ((size_m[0], size_m[1], 0.0), (size_m[1], size_m[0], SIDEWAYS))
        for depth, width, rare in seen[:1] if shown else seen:
            edges = zip(known.usual_m, (depth, width, size_m[2]), strict=True)
            wanted = [math.log(usual / edge) for usual, edge in edges]
            mean = sum(w * x for w, x in zip(weights, wanted, strict=True)) / sum(weights)
            misfit = sum(w * (x - mean) ** 2 for w, x in zip(weights, wanted, strict=True))
            if misfit > MOST_MISFIT or math.exp(mean) * leaf_m > WIDEST_LEAF_M:
                continue
            # Three edges determine one scale: two are left to tell how well they agree.
            sigma = math.sqrt(max(misfit / 2.0, 1.0) / sum(weights))
            # Less likely is what fits worse, and what is so broad that it fits anything.
            unlikely = misfit + 2.0 * sum(map(math.log, known.spread)) + math.log(sum(weights)) + rare
            fits.append((unlikely, Fit(math.exp(mean), sigma, known.kind, known.placed, known.category)))
    return min(fits, key=lambda item: item[0])[1] if fits else None
