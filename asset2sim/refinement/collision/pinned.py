"""Pairs of links that meet as drawn in every state, which neither a state nor a cut can part."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product

import numpy as np

from asset2sim.assets.authored_overlap import AuthoredShapes, authored_depth, intersect
from asset2sim.assets.hulls import Hulls
from asset2sim.physics.kinematics import TreeJoint, link_to_root
from asset2sim.refinement.collision.jams import LARGEST_AUTHORED_M
from asset2sim.refinement.collision.travel import Limits, joints_to_root, range_of

MOST_JOINTS, SAMPLES = 2, 7
"""Most joints between two links that one pin holds, and positions of each, ends and middle among them, in which they
must overlap."""


def pinned_pairs(
    tree: Sequence[TreeJoint],
    root: str,
    limits: Limits,
    start: Mapping[str, float],
    pairs: Iterable[tuple[str, str]],
    authored: AuthoredShapes,
    hulls: Hulls,
) -> list[tuple[str, str]]:
    """Of the ``pairs`` of links that engines let collide those that meet wherever the few joints between them are: a
    pole pinned to a cart within the rail on which that slides, an arm that lies on the base below its turntable. Only
    those that cutting does not part: boxes, balls and cylinders, which have no ``hulls`` and which engines' margins
    press apart where they touch, and what overlaps deeply as drawn. ``start`` is joint → rad or m."""
    poses, found = link_to_root(tree, root, start), list[tuple[str, str]]()
    for a, b in pairs:
        depth = authored_depth(authored, a, b, np.linalg.inv(poses[b]) @ poses[a])
        if depth <= (LARGEST_AUTHORED_M if hulls.get(a) and hulls.get(b) else 0.0):
            continue
        between = set(joints_to_root(tree, a)) ^ set(joints_to_root(tree, b))
        spans = {joint.name: range_of(joint, limits) for joint in tree if joint.name in between}
        known = {name: np.linspace(*span, SAMPLES).tolist() for name, span in spans.items() if span is not None}
        if 0 < len(known) <= MOST_JOINTS and all(
            links_meet(tree, root, {**start, **dict(zip(known, at, strict=True))}, a, b, authored)
            for at in product(*known.values())
        ):
            found.append((a, b))
    return found


def links_meet(
    tree: Sequence[TreeJoint], root: str, positions: Mapping[str, float], a: str, b: str, authored: AuthoredShapes
) -> bool:
    """Whether two links meet as drawn with joints at these positions."""
    poses = link_to_root(tree, root, positions)
    return intersect(authored, a, b, np.linalg.inv(poses[b]) @ poses[a])
