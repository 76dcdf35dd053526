"""How far keys and buttons go: no deeper than a finger presses them before it meets what is around them."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from asset2sim.assets.authored_overlap import AuthoredShapes
from asset2sim.assets.finger_depth import finger_depth, press_ends
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, apply, link_to_root, rigid_links, tree_of
from asset2sim.validation.handling import is_sprung
from asset2sim.validation.limits import Range
from schemas.features import Features
from schemas.finding import Notes
from schemas.hand_settings import FINGERTIP_M
from schemas.overlay import JointProposal
from schemas.vocabulary import Source

LEAST_PRESS_M = 5e-4
"""Least travel that a key keeps, m: a membrane's under a flush foil, and what a finger's pad gives."""
PROUD_M = 1e-4
"""How far a key stands out when it is pressed all the way, m."""


def pressed_ranges(
    drawn: "Drawn",
    ranges: Mapping[str, Range],
    proposals: Mapping[str, JointProposal],
    wanted: Mapping[str, float],
    scale: float,
    *,
    kept: bool,
    notes: Notes,
) -> dict[str, Range]:
    """The ranges, those of sprung sliders drawn in to what a fingertip presses (``finger_depth``), at least
    ``LEAST_PRESS_M``, and at least to the positions ``wanted`` by the user (authored scale). Where the file's limits
    are ``kept``, the ranges stay. Both are told."""
    found = dict(ranges)
    for name, span in ranges.items():
        ends = rest_and_far(span, proposals.get(name), scale)
        if ends is None or span.joint.mimic is not None:
            continue
        rest, far = ends
        way, sign = abs(far - rest), math.copysign(1.0, far - rest)
        least = max(LEAST_PRESS_M, sign * (wanted[name] * scale - rest) if name in wanted else 0.0)
        if way <= least:
            continue
        depth = depth_of_press(drawn, span, rest / scale, sign, scale, way)
        end = max(depth - PROUD_M, least)
        if depth >= way or end >= way:
            continue
        reason = (
            f"joint '{name}': it goes {1e3 * way:.2g} mm, and a fingertip of {1e3 * FINGERTIP_M:.2g} mm meets what is "
            f"around it after {1e3 * max(depth, 0.0):.2g} mm"
        )
        if kept:
            notes.info("press_deep", f"{reason}; kept as its file has it", joint=name, value=way, limit=depth)
            continue
        notes.info("press_drawn_in", f"{reason}: drawn in to {1e3 * end:.2g} mm", joint=name, value=way, limit=end)
        lower, upper = (span.lower, rest + end) if sign > 0.0 else (rest - end, span.upper)
        short = replace(span, lower=lower, upper=upper, source=Source.RULE)
        found[name] = replace(short, closed=short.clamp(span.closed), open=short.clamp(span.open))
    return found


def rest_and_far(span: Range, proposal: JointProposal | None, scale: float) -> tuple[float, float] | None:
    """Where a sprung slider rests and its further end, m; None for what has no spring, turns or has no limits."""
    if not span.joint.prismatic or span.lower is None or span.upper is None or not is_sprung(proposal):
        return None
    stated = None if proposal is None else proposal.spring_rest
    return press_ends(span.closed if stated is None else stated * scale, span.lower, span.upper)


@dataclass(frozen=True)
class Drawn:
    """An object's triangles as drawn, every joint at zero, at the authored scale in the root's frame; ``known`` is how
    deep fingers press what was looked at."""

    features: Features
    shapes: AuthoredShapes
    known: dict[Any, float]

    @cached_property
    def tree(self) -> tuple[TreeJoint, ...]:
        """The joints."""
        return tree_of(self.features.joints)

    @cached_property
    def poses(self) -> Mapping[str, Array]:
        """Link → its (4, 4) pose."""
        return link_to_root(self.tree, self.features.root, {})

    @cached_property
    def housings(self) -> Mapping[str, Array]:
        """Link → the (n, 3, 3) triangles of it and all that is fixed to it, of those to which a slider is mounted."""
        bodies = {name: [name] for name in self.poses}
        for joint in self.tree:
            if joint.type == "fixed":
                bodies[joint.parent].extend(bodies[joint.child])
                bodies |= dict.fromkeys(bodies[joint.parent], bodies[joint.parent])
        parents = {joint.parent for joint in self.tree if joint.type == "prismatic"}
        return {name: self.triangles(bodies[name]) for name in parents}

    def triangles(self, links: Iterable[str]) -> Array:
        """(n, 3, 3) triangles of these links."""
        read = {link: self.shapes.read(link) for link in links}
        found = [apply(self.poses[link], one[0])[one[1]] for link, one in read.items() if one is not None]
        return np.concatenate([np.zeros((0, 3, 3)), *found])


def depth_of_press(drawn: Drawn, span: Range, rest: float, sign: float, scale: float, way: float) -> float:
    """How deep a fingertip presses a part, which rests at a position at the authored scale, m at the final scale: up to
    ``way``, before it meets what is fixed to the part's parent."""
    known, key = drawn.known, (span.joint, rest, sign, scale)
    if key not in known:
        joint = next(item for item in drawn.tree if item.name == span.joint.name)
        axis = drawn.poses[joint.parent][:3, :3] @ joint.child_to_parent[:3, :3] @ joint.axis
        part = drawn.triangles(rigid_links(drawn.tree, joint.name)) + rest * axis
        around = drawn.housings[joint.parent]
        known[key] = (
            finger_depth(scale * part, scale * around, sign * axis, FINGERTIP_M, way) if len(part) else math.inf
        )
    return known[key]
