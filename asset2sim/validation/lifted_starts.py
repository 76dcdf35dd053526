"""Parts that open with a part they lie on: a toilet's lid with its seat."""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import link_to_root, tree_of
from asset2sim.validation.positions import Start
from schemas.features import Features, JointFeatures
from schemas.finding import Notes

AT_END = 0.1
"""Share of its range within which a part is drawn closed."""
ONE_WAY = 0.95
"""Cosine of the angle between two hinges' axes from which their parts open the same way."""
LIES_ON = 0.1
"""Most gap between a part and one that lies on it, as a share of its longest edge; half of the smaller lies on it."""


def lifted_starts(features: Features, starts: Mapping[str, Start], notes: Notes) -> dict[str, Start]:
    """The starts with what lies on a part that is asked to be open, and opens the same way, opened as far: a toilet's
    lid goes up with its seat."""
    hinges = [joint for joint in features.joints if joint.name in starts and opens_as_drawn(features, starts, joint)]
    found = dict(starts)
    if len(hinges) < 2 or all(start.asked is None for start in starts.values()):
        return found
    poses = link_to_root(tree_of(features.joints), features.root, {})
    for below, above in product(hinges, hinges):
        start, other = starts[below.name], starts[above.name]
        if start.asked is None or other.asked is not None or below.parent != above.parent:
            continue
        sign, ways = (math.copysign(1.0, item.range.open - item.range.closed) for item in (start, other))
        axis, along = sign * np.array(below.axis_in_root), ways * np.array(above.axis_in_root)
        turned = abs(start.position - start.range.closed)
        if axis @ along < ONE_WAY or turned <= abs(other.position - other.range.closed):
            continue
        rise = np.cross(axis, np.array(features.link_centers[below.child]) - poses[below.child][:3, 3])
        if lies_on(features, above.child, below.child, rise):
            at = other.range.clamp(other.range.closed + ways * turned)
            message = f"joint '{above.name}' starts at {at:.4g}: '{above.child}' lies on '{below.child}', which is open"
            notes.info("opened_along", message, joint=above.name, value=at)
            found[above.name] = replace(other, position=at)
    return found


def opens_as_drawn(features: Features, starts: Mapping[str, Start], joint: JointFeatures) -> bool:
    """Whether a joint is a hinge of a part with a shape, which is drawn closed."""
    span = starts[joint.name].range
    drawn_closed = abs(span.closed) <= AT_END * abs(span.open - span.closed)
    return joint.type == "revolute" and joint.mimic is None and drawn_closed and joint.child in features.link_boxes


def lies_on(features: Features, upper: str, lower: str, rise: Array) -> bool:
    """Whether one link, as drawn, is before another on the way that it goes when it opens, and touches it there."""
    one, other = np.array(features.link_centers[upper]), np.array(features.link_centers[lower])
    edges, others = np.array(features.link_boxes[upper]), np.array(features.link_boxes[lower])
    ahead = int(np.argmax(np.abs(rise)))
    gaps = np.abs(one - other) - (edges + others) / 2.0
    if (one - other)[ahead] * rise[ahead] <= 0.0 or gaps[ahead] > LIES_ON * others.max():
        return False
    return all(gaps[i] <= -0.5 * min(edges[i], others[i]) for i in range(3) if i != ahead)
