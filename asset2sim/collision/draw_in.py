"""Limits drawn in to where authored geometry stops a joint."""

from collections.abc import Mapping, Sequence

import numpy as np

from asset2sim.collision.jams import JAM_M, Causes, Hit, Jam, Mechanism, pair_hits, worst_jams
from asset2sim.engines.pybullet_overlaps import HullWorld

LEAST_RANGE = 0.5
"""Share of a joint's range that must be left for its limits to be drawn in."""
BISECTIONS = 8
"""Halvings of the step between two sampled positions when a limit is drawn in: a step of 4 % becomes 0.02 %."""


def draw_in(
    world: HullWorld,
    machine: Mechanism,
    hits: Sequence[Hit],
    causes: Causes,
    limits: dict[str, tuple[float, float]],
    stops: dict[str, Jam],
) -> None:
    """Draw ``limits`` in to leave out hits near an end of a joint's range, and note the worst jam of each in ``stops``.

    A joint keeps zero, its initial position, and at least ``LEAST_RANGE`` of its range, or it is left as it is.
    """
    hits = [hit for hit in hits if hit.freed_by is None and hit.joint in machine.limits]
    for name in dict.fromkeys(hit.joint for hit in hits if hit.joint is not None):
        own = [hit for hit in hits if hit.joint == name]
        whole = machine.limits[name]
        lower, upper = limits.get(name, whole)
        low, high = min(machine.kept(name)), max(machine.kept(name))
        below = [hit for hit in own if lower <= hit.position < low]
        above = [hit for hit in own if high < hit.position <= upper]
        if any(low <= hit.position <= high for hit in own) or not (below or above):
            continue
        lower = edge(world, machine, below, max(hit.position for hit in below), low) if below else lower
        upper = edge(world, machine, above, min(hit.position for hit in above), high) if above else upper
        if upper - lower >= LEAST_RANGE * (whole[1] - whole[0]):
            limits[name] = (lower, upper)
            stops.setdefault(name, worst_jams(own, causes)[0])


def edge(world: HullWorld, machine: Mechanism, hits: Sequence[Hit], blocked: float, kept: float) -> float:
    """The position furthest towards ``blocked`` where none of these hits' links jam, from the sample before it on."""
    paths = {hit.links: hit.travel for hit in hits if hit.travel is not None}
    positions = next(iter(paths.values())).positions
    free = float(positions[positions < blocked].max() if kept < blocked else positions[positions > blocked].min())
    for _ in range(BISECTIONS):
        middle = (free + blocked) / 2.0
        jammed = any(
            next(pair_hits(world, path.at(np.array([middle]), machine.tree), *links, JAM_M), None) is not None
            for links, path in paths.items()
        )
        blocked, free = (middle, free) if jammed else (blocked, middle)
    return free


def inside(limits: Mapping[str, tuple[float, float]], hit: Hit) -> bool:
    """Whether a hit is within the limits proposed for its joint, if any are."""
    lower, upper = limits.get(hit.joint or "", (hit.position, hit.position))
    return lower <= hit.position <= upper
