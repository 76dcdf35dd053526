"""Where links overlap at a pose, in words, and which joints part them: from contact places, normals and kinematics."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asset2sim.engines.contacts import LocatedContact, by_pair
from asset2sim.engines.static_object import static_object
from asset2sim.models.prompts import OverlapPlace
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, link_to_root, rigid_links, tree_of, written_joints
from asset2sim.refinement.position_bands import Pose
from schemas.features import Features
from schemas.interaction import ContactPair
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import EngineSettings

ASIDE = 0.5
"""Share of a part's half extent from which a place counts as at that side."""
ALONG = 0.5
"""Least component of a unit direction that is named."""
LEAST_GAIN = 0.05
"""Least cosine between the contact normal and a part's motion from which the motion parts rather than slides."""


@dataclass(frozen=True)
class LocatedOverlaps:
    """The overlapping pairs at a pose, worst first, where each overlaps, and Φ (m)."""

    pairs: tuple[ContactPair, ...]
    places: Mapping[tuple[str, str], OverlapPlace]
    phi_m: float


def locate_overlaps(
    features: Features, overlay: PhysicsOverlay, urdf: Path, pose: Pose, settings: EngineSettings
) -> LocatedOverlaps:
    """The overlaps of a written URDF at a pose, in a fresh world. Raises AssetError where PyBullet refuses it."""
    with static_object(urdf, settings) as item:
        item.place(pose)
        contacts, boxes = item.located_contacts(), item.boxes()
    tree = tree_of(written_joints(features, overlay), overlay.scale)
    poses = link_to_root(tree, features.root, pose)
    sides = side_rows(np.asarray(features.front))
    spans = {joint.name: span_of(joint) for joint in overlay.joints}
    pairs, places = by_pair(contacts), {}
    for pair in pairs:
        own = [
            contact_in_order(point, pair)
            for point in contacts
            if {point.link_a, point.link_b} == {pair.link_a, pair.link_b}
        ]
        deep = [point for point in own if point.separation_m < 0.0]
        middle, normal = mean_contact(deep)
        places[pair.link_a, pair.link_b] = OverlapPlace(
            at_a=side_of(middle, boxes[pair.link_a], sides),
            at_b=side_of(middle, boxes[pair.link_b], sides),
            a_leaves=direction_words(normal, sides),
            parted_by=parting_changes(pair, deep, tree, poses, spans),
        )
    return LocatedOverlaps(pairs, places, sum(pair.penetration_m for pair in pairs))


def span_of(joint: JointPhysics) -> float:
    """A joint's whole range, rad or m; a turn without limits."""
    return 2.0 * math.pi if joint.lower is None or joint.upper is None else joint.upper - joint.lower


def contact_in_order(point: LocatedContact, pair: ContactPair) -> LocatedContact:
    """The contact with its links in the pair's order."""
    if point.link_a == pair.link_a:
        return point
    x, y, z = point.normal
    return LocatedContact(point.link_b, point.link_a, point.separation_m, point.place, (-x, -y, -z))


def mean_contact(points: Sequence[LocatedContact]) -> tuple[Array, Array]:
    """(3,) mean place, m, and (3,) mean normal of contacts, by their depths."""
    depths = np.array([-point.separation_m for point in points])
    share = depths / depths.sum()
    return share @ np.array([point.place for point in points]), share @ np.array([point.normal for point in points])


def parting_changes(
    pair: ContactPair,
    points: Sequence[LocatedContact],
    tree: Sequence[TreeJoint],
    poses: Mapping[str, Array],
    spans: Mapping[str, float],
) -> dict[str, float]:
    """Joint → change of position (rad or m) at which the pair's links would about cease to overlap, by how fast each
    joint moves them apart along the contact normals; the least share of its range (``spans``) first. Joints that move
    both links alike, or past each other, are left out, and so are those that would need more than their range."""
    depths = np.array([-point.separation_m for point in points])
    places, normals = np.array([p.place for p in points]), np.array([p.normal for p in points])
    found: dict[str, float] = {}
    for joint in tree:
        moved = rigid_links(tree, joint.name)
        moves_a, moves_b = pair.link_a in moved, pair.link_b in moved
        if joint.name not in spans or moves_a == moves_b:
            continue
        frame = poses[joint.parent] @ joint.child_to_parent
        axis = frame[:3, :3] @ joint.axis
        speeds = np.broadcast_to(axis, places.shape)
        if joint.type != "prismatic":
            speeds = np.cross(axis, places - frame[:3, 3])
        rates = np.einsum("ij,ij->i", speeds, normals) * (1.0 if moves_a else -1.0)
        rate = float(depths @ rates / depths.sum())
        if abs(rate) < LEAST_GAIN * float(depths @ np.linalg.norm(speeds, axis=1) / depths.sum()) or rate == 0.0:
            continue
        change = pair.depth_m / rate
        if abs(change) <= spans[joint.name]:
            found[joint.name] = change
    return dict(sorted(found.items(), key=lambda item: abs(item[1]) / spans[item[0]]))


def side_rows(front: Array) -> dict[str, Array]:
    """Side → (3,) unit direction in the root frame, of an object that faces ``front``, z up."""
    up = np.array([0.0, 0.0, 1.0])
    left = np.cross(front, up)
    return {"front": front, "back": -front, "left": left, "right": -left, "top": up, "bottom": -up}


def side_of(place: Array, box: tuple[Array, Array], sides: Mapping[str, Array]) -> str:
    """On which sides of a box (lowest and highest corner, m) a place lies, furthest out first; "middle" for none."""
    low, high = box
    offset = (place - 0.5 * (low + high)) / np.maximum(0.5 * (high - low), 1e-9)
    return _named({name: float(offset @ side) for name, side in sides.items()}, ASIDE) or "middle"


def direction_words(direction: Array, sides: Mapping[str, Array]) -> str:
    """A direction as the sides to which it points, the strongest first; "unclear" where contacts oppose each other."""
    length = float(np.linalg.norm(direction))
    if length < ALONG:
        return "unclear"
    return _named({name: float(direction @ side) / length for name, side in sides.items()}, ALONG)


def _named(shares: Mapping[str, float], least: float) -> str:
    named = [name for name, share in shares.items() if share > least]
    return " ".join(sorted(named, key=lambda name: -round(shares[name], 3)))
