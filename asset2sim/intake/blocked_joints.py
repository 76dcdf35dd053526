"""Find inverted joint axes, misplaced hinges and missing limits by overlaps of a joint's child with its parent.

Engines filter contacts between a link and its parent, so a door may swing into its cabinet. Here the authored triangles
are intersected at positions over the joint's range. Parts that touch or share a hinge overlap slightly everywhere: an
overlap counts only if no small shift ends it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from asset2sim.assets.authored_overlap import DIRECTIONS, AuthoredShapes, authored_shapes, intersect, primitives
from asset2sim.assets.extract import Extraction, drawn_tree
from asset2sim.assets.joints import with_ends
from asset2sim.assets.meshes.hull import boxes_meet
from asset2sim.guidance.parts import PRESSED, part_name
from asset2sim.intake.authored_numbers import read_stated_joints
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, apply, joint_motion, link_to_root, tree_of
from schemas.features import Features, JointFeatures
from schemas.finding import Finding, Notes

DEEP_SHARE = 0.03
"""Shift that must not end an overlap for it to count, as a share of the diagonal of the moving link."""
SAMPLES = 9
"""Positions over a joint's range."""
BLOCKED_SHARE = 0.25
"""Share of its range from which a joint that starts free counts as blocked."""
WRONG_SHARE, RIGHT_SHARE = 0.5, 0.15
"""An axis is inverted if at least the first share of its range is blocked, and flipped at most the second."""
LARGE_SHARE = 0.25
"""Diagonal of the moving link over that of the still one from which it is a door, lid or drawer, not a button."""
LEAST_TRAVEL = 0.3
"""Least travel of a slider over its extent along its axis: drawers come out half-way and more, buttons a little."""
STAYS_IN, FAR_OUT = 0.15, 1.5
"""Share of its depth in its case by which a drawer that would fall out is still in it when it is open; and its travel
over that depth from which it would: slides that extend wholly bring a drawer out of its case."""
TURN_SAMPLES = 72
"""Positions over a turn at which the missing limits of a hinge are searched: every five degrees."""


@dataclass(frozen=True)
class MovingPair:
    """One joint's ``moving`` link and the ``still`` link it may run into, with the (4, 4) transform to the parent.

    ``shift`` must not end an overlap for it to count, ``along`` is the moving link's extent along the axis; both m at
    the authored scale. ``large``: no button, knob or latch, which may sink into their parent.
    """

    joint: TreeJoint
    moving: str
    still: str
    still_to_parent: Array
    shift: float
    along: float
    large: bool


@dataclass(frozen=True)
class LinkShapes:
    """The convex pieces and primitives of links, and their triangles, read only where those meet. ``pieces``
    maps link → (n, 3) points of all pieces, and the index at which each begins."""

    extraction: Extraction
    pieces: dict[str, tuple[Array, np.ndarray] | None] = field(default_factory=dict)

    @cached_property
    def triangles(self) -> AuthoredShapes:
        """The authored triangles of the links."""
        return authored_shapes(self.extraction, 1.0)

    @cached_property
    def primitives(self) -> dict[str, list[Array]]:
        """Link → (n, 3) points of each of its boxes, cylinders and spheres."""
        return {name: [points for points, _ in primitives(link)] for name, link in self.extraction.links.items()}

    def points(self, link: str) -> tuple[Array, np.ndarray] | None:
        """A link's pieces in its frame, m at the authored scale; None where it has no shape."""
        if link not in self.pieces:
            parts = self.extraction.geometry[link].parts
            clouds = [cloud for part in parts for cloud in part.pieces]
            clouds += self.primitives[link]
            clouds = clouds or [part.sheet for part in parts if part.sheet is not None]
            starts = np.cumsum([0, *(len(cloud) for cloud in clouds[:-1])])
            self.pieces[link] = (np.vstack(clouds), starts) if clouds else None
        return self.pieces[link]

    def boxes(self, link: str, pose: Array) -> tuple[Array, Array]:
        """(k, 3) minimum and maximum of each piece of a link at a (4, 4) pose."""
        found = self.points(link)
        assert found is not None, "only links with shapes are looked at"
        placed = apply(pose, found[0])
        return np.minimum.reduceat(placed, found[1]), np.maximum.reduceat(placed, found[1])

    def may_meet(self, a: str, b: str, a_to_b: Array, shifts: Array) -> bool:
        """Whether for each of the (k, 3) shifts of A some piece of it could meet one of B: their boxes overlap."""
        (low, high), still = self.boxes(a, a_to_b), self.boxes(b, np.eye(4))
        return all(bool(boxes_meet((low + shift, high + shift), still).any()) for shift in shifts)


def find_blocked_joints(extraction: Extraction) -> tuple[Extraction, tuple[Finding, ...]]:
    """The extraction with inverted axes flipped and missing limits added where geometry is unambiguous, and findings.

    An axis is flipped where the link passes through its parent over most of its range, and hardly at all the other way.
    A revolute joint without limits gets those at which it meets its parent, if any, and so does a door's hinge where
    the format has no word for turning without end. Joints that start in an overlap are left alone: they show nothing.
    """
    notes, features = Notes(), extraction.features
    shapes, tree, raw = LinkShapes(extraction), tree_of(features.joints), read_stated_joints(extraction)
    changed: dict[str, JointFeatures] = {}
    coupled = {name for joint in features.joints if joint.mimic is not None for name in (joint.name, joint.mimic.joint)}
    unsaid = extraction.opened is not None and bool(extraction.opened.metric_format)
    for joint in features.movable_joints:
        if joint.name in coupled:
            continue  # its range is bound to another's
        way = moving_pair(joint.name, features, tree, shapes)
        if way is None or not way.large:
            continue
        part = part_name(features.link(joint.child).label, joint.child, joint.name)
        if part == "drawer" and joint.prismatic and (stays := kept_in(way, joint, shapes, notes)) is not None:
            changed[joint.name] = joint = stays
        if links_overlap(way, start_of(joint), shapes):
            continue
        if joint.prismatic and part in PRESSED:
            continue  # it sinks into what it is mounted on, however large
        if joint.lower is None or joint.upper is None:
            if raw[joint.name].type == "revolute" or (unsaid and not joint.prismatic and part == "door"):
                found = found_limits(way, joint, shapes, notes)
                changed |= {joint.name: found} if found is not None else {}
        else:
            turned = flipped_if_inverted(way, joint, shapes, notes)
            changed |= {joint.name: turned} if turned is not None else {}
    return (with_joints(extraction, changed) if changed else extraction), tuple(notes.findings)


def start_of(joint: JointFeatures) -> float:
    """Zero, or the limit nearest to it."""
    if joint.lower is None or joint.upper is None:
        return 0.0
    low, high = sorted((joint.lower, joint.upper))
    return min(max(0.0, low), high)


def moving_pair(name: str, features: Features, tree: Sequence[TreeJoint], shapes: LinkShapes) -> MovingPair | None:
    """The joint's child, and the parent or the nearest link with shapes fixed to it; None where either has none."""
    joint = next(item for item in tree if item.name == name)
    before = {item.child: item for item in tree}
    still, still_to_parent = joint.parent, np.eye(4)
    while shapes.points(still) is None and still in before and before[still].type == "fixed":
        still_to_parent = still_to_parent @ np.linalg.inv(before[still].child_to_parent)
        still = before[still].parent
    if shapes.points(still) is None or shapes.points(joint.child) is None:
        return None
    diagonal = float(np.linalg.norm(features.link(joint.child).box_size))
    large = diagonal >= LARGE_SHARE * float(np.linalg.norm(features.link(still).box_size))
    along = float(np.abs(joint.axis) @ np.asarray(features.link(joint.child).box_size))
    return MovingPair(joint, joint.child, still, still_to_parent, DEEP_SHARE * diagonal, along, large)


def links_touch(way: MovingPair, position: float, shapes: LinkShapes) -> bool:
    """Whether the moving link touches the still one at this position (rad or m)."""
    return links_overlap(replace(way, shift=0.0), position, shapes)


def links_overlap(way: MovingPair, position: float, shapes: LinkShapes) -> bool:
    """Whether the moving link overlaps the still one at this position (rad or m) and no small shift ends it."""
    to_parent = way.joint.child_to_parent @ joint_motion(way.joint, position)
    to_still = np.linalg.inv(way.still_to_parent) @ to_parent
    shifts = way.shift * np.vstack([np.zeros(3), DIRECTIONS]) if way.shift > 0.0 else np.zeros((1, 3))
    if not shapes.may_meet(way.moving, way.still, to_still, shifts):
        return False
    return all(intersect(shapes.triangles, way.moving, way.still, to_still, shift) for shift in shifts)


def blocked_share(way: MovingPair, lower: float, upper: float, shapes: LinkShapes) -> float:
    """Share of the positions between two limits (rad or m) at which the joint is blocked."""
    return float(np.mean([links_overlap(way, float(at), shapes) for at in np.linspace(lower, upper, SAMPLES)]))


def flipped_if_inverted(
    way: MovingPair, joint: JointFeatures, shapes: LinkShapes, notes: Notes
) -> JointFeatures | None:
    """The joint with its axis flipped where geometry shows it inverted, else None; a finding where it is blocked."""
    low, high = sorted((joint.lower or 0.0, joint.upper or 0.0))
    if joint.prismatic and high - low < LEAST_TRAVEL * way.along:
        return None
    share = blocked_share(way, low, high, shapes)
    if share < BLOCKED_SHARE:
        return None
    other = blocked_share(way, -high, -low, shapes) if share >= WRONG_SHARE else share
    through = f"joint '{joint.name}': '{way.moving}' passes through '{way.still}' over {share:.0%} of its range"
    if other > RIGHT_SHARE:
        message = f"{through}: is its axis, its place or its range right?"
        notes.warn("range_blocked", message, joint=joint.name, value=share, limit=BLOCKED_SHARE)
        return None
    message = f"{through}, and over {other:.0%} the other way: its axis is the wrong way round, and refinement turns it"
    notes.warn("axis_inverted", message, joint=joint.name, value=share, limit=WRONG_SHARE)
    flip = {"axis": tuple(-value for value in joint.axis), "axis_in_root": tuple(-v for v in joint.axis_in_root)}
    return joint.model_copy(update=flip)


def kept_in(way: MovingPair, joint: JointFeatures, shapes: LinkShapes, notes: Notes) -> JointFeatures | None:
    """The joint of a drawer with the limit at which it is still in its case, in place of one at which it has left it
    far behind; None where it has not, or is drawn outside."""
    still, moving = shapes.points(way.still), shapes.points(way.moving)
    assert still is not None and moving is not None, "a moving pair has shapes"
    to_still = np.linalg.inv(way.still_to_parent) @ way.joint.child_to_parent
    along = to_still[:3, :3] @ np.asarray(joint.axis)
    case, drawer = still[0] @ along, apply(to_still, moving[0]) @ along
    out, back = float(case.max() - drawer.min()), float(case.min() - drawer.max())
    low, high = sorted((joint.lower or 0.0, joint.upper or 0.0))
    if not back < 0.0 < out or not (high > FAR_OUT * out or low < FAR_OUT * back):
        return None
    ends = {"upper": min(high, (1.0 - STAYS_IN) * out), "lower": max(low, (1.0 - STAYS_IN) * back)}
    message = (
        f"joint '{joint.name}': '{way.moving}' leaves '{way.still}' far behind between {low:.4g} and {high:.4g} m; it "
        f"is let go from {ends['lower']:.4g} to {ends['upper']:.4g} m: state limits at which it stays in"
    )
    notes.warn("travel_shortened", message, joint=joint.name, value=high - low, limit=ends["upper"] - ends["lower"])
    return joint.model_copy(update=ends)


def found_limits(way: MovingPair, joint: JointFeatures, shapes: LinkShapes, notes: Notes) -> JointFeatures | None:
    """The joint with the limits between which its link is free; None where it turns all the way round."""
    step = 2.0 * math.pi / TURN_SAMPLES
    # A link that starts clear is stopped by the first touch, one that overlaps at its hinge by the first deep overlap.
    meets = links_overlap if links_touch(way, 0.0, shapes) else links_touch
    ends = []
    for sign in (-1.0, 1.0):
        met = (k for k in range(1, TURN_SAMPLES) if meets(way, sign * k * step, shapes))
        first = next(met, None)
        if first is None:
            return None
        ends.append(sign * (first - 1) * step)
    lower, upper = ends
    if upper - lower < step:
        return None
    message = (
        f"joint '{joint.name}' states no limits: between {lower:.3g} and {upper:.3g} rad "
        f"'{way.moving}' does not pass through '{way.still}'; state them"
    )
    notes.warn("limits_found", message, joint=joint.name, value=upper - lower)
    return joint.model_copy(update={"type": "revolute", "lower": lower, "upper": upper})


def with_joints(extraction: Extraction, changed: dict[str, JointFeatures]) -> Extraction:
    """The extraction with these joints, their closed and open ends found anew."""
    features = extraction.features
    joints = [changed.get(joint.name, joint) for joint in features.joints]
    drawn = drawn_tree(extraction, joints)
    rest = link_to_root(drawn.tree, features.root, {})
    diagonal = float(np.linalg.norm(features.rest_size))
    found = [with_ends(joint, drawn, rest, diagonal) if joint.name in changed else joint for joint in joints]
    return replace(extraction, features=features.model_copy(update={"joints": tuple(found)}))
