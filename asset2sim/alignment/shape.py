"""Sizes and places that a record's features imply: boxes carried by the joints, at the authored scale."""

from itertools import product

import numpy as np

from asset2sim.physics.arrays import Array, vector
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from schemas.base import Vector3
from schemas.features import Features, LinkFeatures


def closed_size(features: Features) -> Vector3:
    """(3,) edges of the object's box with every joint closed, m; from the links' boxes, so at least the true one.

    Where the closed state is the authored one, the exact box of the rest pose stands.
    """
    closed = {joint.name: joint.closed for joint in features.joints if joint.closed}
    if not closed:
        return features.rest_size
    poses = link_to_root(tree_of(features.joints), features.root, closed)
    corners = [apply(poses[link.name], _corners(link)) for link in features.links if link.has_geometry]
    return vector(np.ptp(np.vstack(corners), axis=0)) if corners else features.rest_size


def link_centers(features: Features) -> dict[str, Vector3]:
    """Link name → the centre of its box at rest in the root link's frame, m; links without geometry are left out."""
    poses = link_to_root(tree_of(features.joints), features.root, {})
    return {
        link.name: vector(apply(poses[link.name], _corners(link)).mean(axis=0))
        for link in features.links
        if link.has_geometry
    }


def _corners(link: LinkFeatures) -> Array:
    """(8, 3) corners of a link's box in its own frame, m."""
    return np.array(list(product(*zip(link.box_min, link.box_max, strict=True))), dtype=float)
