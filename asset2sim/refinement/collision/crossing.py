"""Flaps of one carton that cross where both are closed, so that as drawn none but one pair could be."""

from itertools import combinations

import numpy as np

from asset2sim.assets.hulls import Hulls
from asset2sim.engines.static_object import MARGIN_M
from asset2sim.physics.kinematics import link_to_root, tree_of, written_joints
from asset2sim.refinement.collision.hull_world import candidates, clear_pose
from asset2sim.refinement.collision.part_links import hull_world
from asset2sim.refinement.collision.trim import Trimmer
from schemas.features import Features
from schemas.overlay import PhysicsOverlay

CROSSING = 0.5
"""Cosine of the angle between two hinges' axes below which their parts cross rather than lie one upon the other."""


def crossing_flaps(
    features: Features, overlay: PhysicsOverlay, hulls: Hulls, exact: frozenset[str]
) -> tuple[tuple[str, str], ...]:
    """Pairs of links that hang from one link by hinges across each other, are of one kind, and overlap where both are
    closed by more than cutting parts: real flaps are thin and bend, and lie one upon another in any order. ``exact``
    are the links whose hulls are their meshes."""
    hinges = {joint.name: joint for joint in overlay.joints if joint.type == "revolute" and joint.lower is not None}
    parts = [joint for joint in features.movable_joints if joint.name in hinges and hulls.get(joint.child)]
    pairs = [
        (a.child, b.child)
        for a, b in combinations(parts, 2)
        if a.parent == b.parent
        and hinges[a.name].label == hinges[b.name].label
        and abs(float(np.dot(a.axis_in_root, b.axis_in_root))) < CROSSING
    ]
    if not pairs:
        return ()
    closed = {name: joint.closed for name, joint in hinges.items()}
    tree = tree_of(written_joints(features, overlay), overlay.scale)
    poses = link_to_root(tree, features.root, {**overlay.initial_positions, **closed})
    trimmer = Trimmer(hulls, exact, None)
    with hull_world(trimmer) as world:
        clear_pose(world, poses, pairs)
        return tuple(
            pair
            for pair in pairs
            if any(
                world.overlap(a, b, poses[a[0]], poses[b[0]], 2.0 * MARGIN_M) is not None
                for a, b in candidates(trimmer, poses, [pair])
            )
        )
