"""The stretch of its range in which a joint moves freely, and what it runs into at either end."""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from asset2sim.checks.mechanism import Mechanism, span_of
from asset2sim.engines.contacts import by_pair
from asset2sim.engines.world import World
from schemas.overlay import JointPhysics

BISECTIONS = 4
"""Halvings of the step that ends in an overlap: the end of the free stretch is known to 0.3 % of the range."""
MOST_CLEARED = 6
"""Other joints that are moved out of the way of one, at most."""
MOST_TOGETHER = 3
"""Those of them that are moved away together, at most, where none alone gives way: a flap under two others."""
GAIN = 0.01
"""Share of the range by which moving another joint away must lengthen the free stretch to be worth stating."""

Depths = dict[tuple[str, str], float]


@dataclass(frozen=True)
class Stretch:
    """The free stretch of one joint, rad or m, and what ends it: (position, pairs with their depths) on either side."""

    low: float
    high: float
    ends: tuple[tuple[float, Depths], ...] = ()


@dataclass
class RangeSearch:
    """The state of one joint's search in one direction: where it is free for sure and where it first is not."""

    joint: JointPhysics
    ways: list[float]
    free: float
    blocked: tuple[float, Depths] | None = None
    next: int = 0


def overlap_depths(world: World) -> Depths:
    """Link pair → overlap depth of its shapes at the world's present pose, m, less the engine's skin."""
    found = {(pair.link_a, pair.link_b): pair.depth_m - world.skin_m for pair in by_pair(world.contacts())}
    return {pair: depth for pair, depth in found.items() if depth > 0.0}


@dataclass(frozen=True)
class Sweeper:
    """An object whose joints are moved in a world, each to ``samples`` positions of its range. A stretch ends where two
    links overlap by more than is ``allowed`` of them, m, or ``most_m`` of others."""

    world: World
    item: Mechanism
    samples: int
    most_m: float
    allowed: Depths

    def stretches(self, joints: tuple[JointPhysics, ...], positions: Mapping[str, float]) -> dict[str, Stretch]:
        """Joint → its free stretch, of joints whose parts cannot meet (``apart_groups``), moved together. Each goes
        from its initial position outwards, one sample at a time, and stops at the first overlap."""
        found: dict[str, list[RangeSearch]] = {joint.name: [] for joint in joints}
        for direction in (1.0, -1.0):
            probes = [range_search(joint, direction, self.samples) for joint in joints]
            for probe in probes:
                found[probe.joint.name].append(probe)
            while live := [probe for probe in probes if probe.blocked is None and probe.next < len(probe.ways)]:
                ahead = {probe.joint.name: probe.ways[probe.next] for probe in live}
                seen = self.overlaps_beyond(positions, ahead)
                for probe in live:
                    overlaps = seen[probe.joint.name]
                    if overlaps:
                        probe.blocked = probe.ways[probe.next], overlaps
                    else:
                        probe.free = probe.ways[probe.next]
                    probe.next += 1
            self.bisect_steps(positions, [probe for probe in probes if probe.blocked])
        return {
            name: Stretch(
                min(p.free for p in both), max(p.free for p in both), tuple(p.blocked for p in both if p.blocked)
            )
            for name, both in found.items()
        }

    def bisect_steps(self, positions: Mapping[str, float], probes: list[RangeSearch]) -> None:
        """Bisect the steps in which joints ran into an overlap."""
        for _ in range(BISECTIONS if probes else 0):
            middles = {
                probe.joint.name: (probe.free + probe.blocked[0]) / 2.0 for probe in probes if probe.blocked is not None
            }
            seen = self.overlaps_beyond(positions, middles)
            for probe in probes:
                middle, overlaps = middles[probe.joint.name], seen[probe.joint.name]
                if overlaps:
                    probe.blocked = middle, overlaps
                else:
                    probe.free = middle

    def overlaps_beyond(self, positions: Mapping[str, float], moved: Mapping[str, float]) -> dict[str, Depths]:
        """Joint → the overlaps of its links beyond what is allowed, with these joints moved and the others as they
        are."""
        self.world.place({**positions, **moved})
        found: dict[str, Depths] = {name: {} for name in moved}
        for pair, depth in overlap_depths(self.world).items():
            if depth <= self.allowed.get(pair, self.most_m):
                continue
            for name in moved:
                # Two links that the joint moves together are no obstacle to it.
                if self.item.moves_apart(name, *pair):
                    found[name][pair] = depth
        return found

    def cleared_stretch(
        self, joint: JointPhysics, stretch: Stretch, free: Mapping[str, tuple[float, float]]
    ) -> tuple[Stretch, dict[str, float]]:
        """The free stretch with the joints that carry its obstacles moved away, and the positions of those joints. Each
        such joint in turn is tried at either end of its own free stretch, where neither helps in its middle (an arm
        that folds back past upright), at last those that are left together; what lengthens the stretch most is
        kept."""
        item, (lower, upper) = self.item, span_of(joint)
        best, others, tried, met = stretch, dict[str, float](), set[str](), in_the_way(item, joint.name, stretch)

        def attempt(around: dict[str, float]) -> None:
            nonlocal best, others
            longer = self.stretches((joint,), item.start | around)[joint.name]
            met.extend(in_the_way(item, joint.name, longer))
            if longer.high - longer.low > best.high - best.low + GAIN * (upper - lower):
                best, others = longer, around

        while best.ends and len(tried) < MOST_CLEARED:
            candidate = next((n for n in in_the_way(item, joint.name, best) if n in free and n not in tried), None)
            if candidate is None:
                break
            tried.add(candidate)
            for position in free[candidate]:
                attempt({**others, candidate: position})
            if candidate not in others:
                attempt({**others, candidate: sum(free[candidate]) / 2.0})
        # What stops it just behind the first is met only once that is away, though it gains next to nothing.
        left = [name for name in dict.fromkeys(met) if name in free and name not in others][:MOST_TOGETHER]
        for ends in itertools.product(*(free[name] for name in left)) if best.ends and len(left) > 1 else ():
            attempt({**others, **dict(zip(left, ends, strict=True))})
        return best, others


def range_search(joint: JointPhysics, direction: float, samples: int) -> RangeSearch:
    """The samples of one joint's range beyond its initial position in one direction, nearest first."""
    lower, upper = span_of(joint)
    if upper <= lower:
        return RangeSearch(joint, [], joint.initial_position)
    start = min(max(joint.initial_position, lower), upper)
    all_ways = np.linspace(lower, upper, samples)
    step = 1e-3 * (upper - lower)
    ways = sorted((float(way) for way in all_ways if (way - start) * direction > step), reverse=direction < 0.0)
    return RangeSearch(joint, ways, start)


def in_the_way(item: Mechanism, joint: str, stretch: Stretch) -> list[str]:
    """The other joints that move one of two overlapping links and not the other, each once, in the order met."""
    names: dict[str, None] = {}
    for _, overlaps in stretch.ends:
        for a, b in overlaps:
            for name in (*item.chain[a], *item.chain[b]):
                if name != joint and (name in item.chain[a]) != (name in item.chain[b]):
                    names[name] = None
    return list(names)
