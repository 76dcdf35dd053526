"""What is told about an object: one mapping from its features, for the prompts, the prior and the checks."""

from collections.abc import Mapping
from itertools import product

import numpy as np

from asset2sim.models.language.object_info import ObjectInfo
from asset2sim.physics.arrays import Array, vector
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from schemas.base import Vector3
from schemas.features import Features, JointFeatures, LinkFeatures

SIGNIFICANT_DIGITS = 5
"""Digits kept of every number in a prompt: beyond what a model can use, and a third of the tokens of a double."""


def object_facts(features: Features, closed_size: Vector3, link_centers: Mapping[str, Vector3]) -> dict[str, object]:
    """The object as JSON values, at the authored scale: lengths in m, positions in rad or m.

    ``closed_size`` is the object's box with every joint closed, m. ``link_centers`` maps link names to the centre of
    the link's shape in the root link's frame at rest, m; a link that it lacks is stated without a centre.
    """
    return {
        "asset_id": features.asset_id,
        "category": features.category,
        "size_m": features.rest_size,
        "size_closed_m": closed_size,
        "links": [_link(link, link_centers.get(link.name)) for link in features.links],
        "joints": [_joint(joint) for joint in features.joints],
    }


def told_object(features: Features, closed_size: Vector3, link_centers: Mapping[str, Vector3]) -> ObjectInfo:
    """The object as a prompt tells it, with rounded numbers; parameters as for ``object_facts``."""
    facts = object_facts(features, closed_size, link_centers)
    return ObjectInfo.from_json({key: rounded(value) for key, value in facts.items()})


def object_info(features: Features) -> ObjectInfo:
    """The object with exact numbers, its closed size and its links' centres from the boxes of the links."""
    return ObjectInfo.from_json(object_facts(features, closed_size(features), link_centers(features)))


def rounded(value: object, digits: int = SIGNIFICANT_DIGITS) -> object:
    """The value with every float in it rounded to this many significant digits."""
    if isinstance(value, float):
        return float(f"{value:.{digits}g}") + 0.0  # and no negative zero
    if isinstance(value, Mapping):
        return {key: rounded(item, digits) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(item, digits) for item in value]
    return value


def _link(link: LinkFeatures, center: Vector3 | None) -> dict[str, object]:
    return {
        "name": link.name,
        "label": link.label,
        "joint_kind": link.joint_kind,
        "box_m": link.box_size,
        "center_m": center,
        "volume_m3": link.volume_m3,
        "hull_volume_m3": link.hull_volume_m3,
        "volume_source": link.volume_source.value,
        "area_m2": link.area_m2,
        "materials": link.materials,
        "mass_kg": None if link.inertial is None else link.inertial.mass_kg,
    }


def _joint(joint: JointFeatures) -> dict[str, object]:
    limits = [limit for limit in (joint.lower, joint.upper) if limit is not None]
    return {
        "name": joint.name,
        "type": joint.type,
        "parent": joint.parent,
        "child": joint.child,
        "axis": joint.axis_in_root,
        # Validation swaps inverted limits; a model is told the range that it will have.
        "lower": min(limits, default=None),
        "upper": max(limits, default=None),
        "closed": joint.closed,
        "open": joint.open,
        "open_confidence": joint.openness_confidence,
    }


def closed_size(features: Features) -> Vector3:
    """(3,) edges of the object's box with every joint closed, m; from the links' boxes, so at least the true one.

    Where the closed state is the authored one, it is the exact box of the rest pose.
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
