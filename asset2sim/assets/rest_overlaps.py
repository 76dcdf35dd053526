"""Where links overlap as drawn, every joint at position 0."""

import numpy as np

from asset2sim.assets.authored_overlap import DEPTHS_M, AuthoredShapes, authored_depth
from asset2sim.assets.extract import Extraction
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from schemas.features import RestOverlap

MOST = 12
"""Overlapping pairs that are reported: the deepest."""
MOST_PAIRS = 200
"""Pairs of links that are looked at, those whose boxes share most: a keyboard has thousands."""


def rest_overlaps(extraction: Extraction) -> tuple[RestOverlap, ...]:
    """The overlapping pairs of links, deepest first, exact on their triangles; a part wholly inside another one does
    not count."""
    features = extraction.features
    longest = max(features.closed_size)
    if longest <= 0.0:
        return ()
    poses = link_to_root(tree_of(features.joints), features.root, {})
    clouds = {name: apply(poses[name], item.points) for name, item in extraction.geometry.items() if len(item.points)}
    boxes = {name: (cloud.min(axis=0), cloud.max(axis=0)) for name, cloud in clouds.items()}
    names, near = list(boxes), list[tuple[float, str, str]]()
    for index, first in enumerate(names):
        for second in names[index + 1 :]:
            shared = np.minimum(boxes[first][1], boxes[second][1]) - np.maximum(boxes[first][0], boxes[second][0])
            if (shared > DEPTHS_M[1] * longest).all():
                near.append((float(shared.prod()), first, second))
    # Depths are absolute: at this scale the longest edge is 1 m.
    shapes, found = AuthoredShapes(extraction, 1.0 / longest), list[RestOverlap]()
    for _, first, second in sorted(near, reverse=True)[:MOST_PAIRS]:
        between = np.linalg.inv(poses[second]) @ poses[first]
        between[:3, 3] /= longest
        depth = authored_depth(shapes, first, second, between)
        if depth > DEPTHS_M[1]:
            found.append(RestOverlap(link_a=first, link_b=second, depth_share=depth if depth <= DEPTHS_M[-1] else None))
    return tuple(sorted(found, key=lambda item: -(item.depth_share or 1.0))[:MOST])
