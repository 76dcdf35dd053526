"""Wheels that collide as the cylinders that they are drawn for: over the corners of facets a cart would not roll."""

from collections.abc import Mapping
from functools import partial

import numpy as np

from asset2sim.assets.hulls import Hulls
from asset2sim.assets.links import LinkGeometry
from asset2sim.assets.meshes.cylinder import beside, tread
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from schemas.features import Features
from schemas.finding import Finding
from schemas.vocabulary import Severity, Stage

ROUNDED = "wheel_rounded"
"""Code of the finding for a wheel that collides as a cylinder."""
LEVEL = 0.2
"""Largest slope of an axle (its upward share): what turns about a steeper one is a turntable or a swivel."""
TOUCHING = 0.02
"""Height over the object's lowest point, as a share of its height, within which a wheel stands on the ground."""

info = partial(Finding, stage=Stage.APPLY, severity=Severity.INFO)


def axles(features: Features, geometry: Mapping[str, LinkGeometry]) -> dict[str, Array]:
    """Link → the (3,) unit axis through its origin about which it turns without end, level, on the ground as drawn."""
    poses = link_to_root(tree_of(features.joints), features.root, {})
    lowest = {name: apply(poses[name], item.points)[:, 2] for name, item in geometry.items() if len(item.points)}
    floor = min((float(heights.min()) for heights in lowest.values()), default=0.0)
    top = max((float(heights.max()) for heights in lowest.values()), default=0.0)
    return {
        joint.child: np.asarray(joint.axis) / np.linalg.norm(joint.axis)
        for joint in features.movable_joints
        if joint.type == "continuous"
        and joint.child in lowest
        and abs(joint.axis_in_root[2]) <= LEVEL
        and lowest[joint.child].min() <= floor + TOUCHING * (top - floor)
    }


def with_round_wheels(
    hulls: Hulls, features: Features, geometry: Mapping[str, LinkGeometry]
) -> tuple[Hulls, tuple[Finding, ...]]:
    """The hulls in which what rolls on the ground has a cylinder in place of its tread; a finding for each."""
    found, notes = dict(hulls), list[Finding]()
    for link, axis in axles(features, geometry).items():
        pieces = hulls.get(link, ())
        wheel = tread(np.vstack(pieces), axis) if pieces else None
        if wheel is not None:
            hubs = (beside(wheel, points) for points in pieces)
            found[link] = (wheel.corners, *(points for points in hubs if points is not None))
            text = f"link '{link}' rolls on a cylinder of {1e3 * wheel.radius:.3g} mm, not on the corners of its facets"
            notes.append(info(code=ROUNDED, link=link, message=text, value=wheel.radius))
    return found, tuple(notes)
