"""A few poses that span what an object can do, at which its inertia is looked at."""

import math
from collections.abc import Mapping
from itertools import product

from asset2sim.validation.limits import Range
from asset2sim.validation.positions import Start

SHARES = (0.0, 0.5, 1.0)
"""Shares of each joint's range."""
MOST_COMBINED = 3
"""Joints up to which every combination of shares is taken; 27 poses."""


def spanning_poses(starts: Mapping[str, Start]) -> list[dict[str, float]]:
    """Joint positions (rad or m): where all start, then every combination of ends and middles; for many joints, all
    together and every other one."""
    names = list(starts)
    ranges = [starts[name].range for name in names]
    if len(names) <= MOST_COMBINED:
        combinations = list(product(SHARES, repeat=len(names)))
    else:
        even = [index % 2 == 0 for index in range(len(names))]
        combinations = [tuple(share for _ in names) for share in SHARES]
        combinations += [tuple(float(flag is first) for flag in even) for first in (True, False)]
    poses = [{name: start.position for name, start in starts.items()}]
    for shares in combinations:
        poses.append({n: at_share(span, share) for n, span, share in zip(names, ranges, shares, strict=True)})
    return poses


def at_share(span: Range, share: float) -> float:
    """The position at a share of a range; of a whole turn for continuous joints."""
    if span.lower is None or span.upper is None:
        return 2.0 * math.pi * share * (2.0 / 3.0)  # both ends of a whole turn are the same place
    return span.lower + share * (span.upper - span.lower)
