"""How an object stands with a part open that is not asked to be: whether its lid or door pulls it over."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body
from asset2sim.physics.support_polygon import SupportPolygon, leaning_on
from asset2sim.validation.handling import Handling
from asset2sim.validation.positions import Start
from asset2sim.validation.support import placed_cloud
from schemas.features import Features
from schemas.finding import Notes
from schemas.thresholds import Thresholds

SHARES = (0.25, 0.5, 0.75, 1.0)
"""Shares of its way at which a part is looked at."""


def note_tips_when_open(
    features: Features,
    points: Mapping[str, Array],
    tree: Sequence[TreeJoint],
    bodies: Mapping[str, Body],
    starts: Mapping[str, Start],
    handled: Mapping[str, Handling],
    limits: Thresholds,
    notes: Notes,
) -> None:
    """A finding for each door and lid of a free object that stands as asked and tips over, or would by a touch, with
    it open further: ``points`` and ``bodies`` are at the final scale, in their links' frames."""
    up = np.array([0.0, 0.0, 1.0])

    def stands(positions: Mapping[str, float]) -> SupportPolygon:
        cloud, center, mass = placed_cloud(features, points, tree, bodies, positions)
        return leaning_on(cloud, center, mass, up)

    def tips(support: SupportPolygon) -> bool:
        weak = support.margin_rad < limits.stands_margin_rad
        return weak and support.mass * GRAVITY_M_S2 * support.rise < limits.touch_j

    here = {name: start.position for name, start in starts.items()}
    leaves = [name for name in starts if name in handled and handled[name].leaf]
    if not leaves or tips(stands(here)):
        return
    for name in leaves:
        span = starts[name].range
        if span.joint.mimic is not None or span.joint.prismatic:
            continue
        ways = (span.closed + share * (span.open - span.closed) for share in SHARES)
        bad = next((way for way in ways if tips(stands(here | {name: way}))), None)
        if bad is None:
            continue
        open_deg = math.degrees(abs(bad - span.closed))
        message = (
            f"joint '{name}': open by {open_deg:.0f}° its part pulls the object over, which "
            "stands as asked: hold it meanwhile, fix it, or ask for less"
        )
        notes.info("tips_when_open", message, joint=name, value=bad, limit=span.open)
