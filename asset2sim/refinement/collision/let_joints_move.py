"""Let joints move: cut hulls over every joint's range and where they stop a finger, and narrow limits where authored
meshes stop a joint; pairs that meet as drawn in every state stay."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product

import numpy as np

from asset2sim.assets.authored_overlap import AuthoredShapes, authored_depth, authored_shapes, intersect
from asset2sim.assets.hulls import Hulls, exact_links
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, apply, link_to_root, tree_of, written_joints
from asset2sim.physics.mass_matrix import bodies_of
from asset2sim.physics.on_floor import StandingParts
from asset2sim.refinement.collision.clear_ranges import Cleared, clear_ranges
from asset2sim.refinement.collision.jams import LARGEST_AUTHORED_M
from asset2sim.refinement.collision.press_room import room_for_presses
from asset2sim.refinement.collision.travel import Limits, clamped, joints_to_root, range_of
from asset2sim.refinement.collision.trim import Cut, PlaneCut, contact_pairs, trim
from asset2sim.refinement.context import RefinementContext, info, trace_step, warning
from asset2sim.refinement.notes import note_cuts
from schemas.finding import Finding
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.support import SupportKind
from schemas.vocabulary import OverlapCause, Source

MOST_JOINTS, SAMPLES = 2, 7
"""Most joints between two links on one pin, and positions of each, ends and middle among them, that must overlap."""
AT_END, ROUGHLY = 1e-3, 0.1
"""Shares of a joint's range: asked so near to an end a part is to be at that end, and by so much datasets' limits are
off."""

ROUNDING_M = 1e-6
"""Distance, m, within which parts that are drawn face on face touch, as a knob turns on its stand."""
SIDES = np.vstack([np.eye(3), -np.eye(3)])


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


def sleeved_pairs(
    tree: Sequence[TreeJoint], root: str, pairs: Iterable[tuple[str, str]], authored: AuthoredShapes, least_m: float
) -> list[tuple[str, str]]:
    """Of the ``pairs`` of links that engines let collide those that turn about and slide along one axis, and are drawn
    deeper than ``least_m`` in each other: the spindle of a stool's seat in its column, a cap on its neck."""
    poses, found = link_to_root(tree, root, {}), list[tuple[str, str]]()
    for a, b in pairs:
        between = set(joints_to_root(tree, a)) ^ set(joints_to_root(tree, b))
        moving = [joint for joint in tree if joint.name in between]
        axes = np.array([poses[joint.child][:3, :3] @ joint.axis for joint in moving]).reshape(-1, 3)
        types = {joint.type for joint in moving}
        if "prismatic" not in types or types.isdisjoint(TURNING) or np.abs(axes @ axes[0]).min() < 1.0 - 1e-4:
            continue
        if authored_depth(authored, a, b, np.linalg.inv(poses[b]) @ poses[a]) > least_m:
            found.append((a, b))
    return found


def links_meet(
    tree: Sequence[TreeJoint], root: str, positions: Mapping[str, float], a: str, b: str, authored: AuthoredShapes
) -> bool:
    """Whether two links meet as drawn with joints at these positions, be it that rounding parts them."""
    poses = link_to_root(tree, root, positions)
    place = np.linalg.inv(poses[b]) @ poses[a]
    return intersect(authored, a, b, place) or any(intersect(authored, a, b, place, ROUNDING_M * way) for way in SIDES)


ONE_LINE = 0.02
"""Distance between two joints' axes, as a share of the shorter part's reach from them, up to which they are one."""
TURNING = ("revolute", "continuous")


def stacked_pairs(
    tree: Sequence[TreeJoint], poses: Mapping[str, Array], pairs: Iterable[tuple[str, str]], points: Mapping[str, Array]
) -> list[tuple[str, str]]:
    """Of the ``pairs`` of links that engines let collide those that turn about one line, one drawn before the other:
    the hands of a clock, which never meet, though as collision shapes they are too thick to pass. ``points`` are the
    (n, 3) corners of each link in its frame, as drawn."""
    turning = {joint.child: joint for joint in tree if joint.type in TURNING}
    found = []
    for a, b in pairs:
        one, other = turning.get(a), turning.get(b)
        if one is None or other is None or one.parent != other.parent or not (len(points[a]) and len(points[b])):
            continue
        axis, away = poses[a][:3, :3] @ one.axis, poses[b][:3, 3] - poses[a][:3, 3]
        along = abs(float(axis @ poses[b][:3, :3] @ other.axis)) > 1.0 - 1e-4
        reach = min(float(np.ptp(points[link], axis=0).max()) for link in (a, b))
        if not along or np.linalg.norm(away - axis * (axis @ away)) > ONE_LINE * reach:
            continue
        first, second = (apply(poses[link], points[link]) @ axis for link in (a, b))
        if first.max() <= second.min() or second.max() <= first.min():
            found.append((a, b))
    return found


FLOOR_GAP_M = 4e-3
"""Gap left between the floor and a part that slides over it, m: doors and drawers of furniture clear theirs by 3 to
5 mm, and what is within 3 mm of it counts as standing (``STANDING_M``)."""


def let_joints_move(loop: RefinementContext, overlay: PhysicsOverlay, hulls: Hulls) -> tuple[PhysicsOverlay, Hulls]:
    """Overlay with narrowed limits, and hulls cut so that joints can move; each change is a finding."""
    features = loop.extraction.features
    joints = written_joints(features, overlay)
    tree, shapes = tree_of(joints, overlay.scale), authored_shapes(loop.extraction, overlay.scale)
    limits = {j.name: (j.lower, j.upper) for j in overlay.joints if j.lower is not None and j.upper is not None}
    links, start = [link.name for link in features.links], overlay.initial_positions
    pairs = list(contact_pairs(joints, links, loop.passing))
    pinned = pinned_pairs(tree, features.root, limits, start, pairs, shapes, hulls)
    note_pinned(pinned, loop.log.findings)
    drawn = {link: geometry.points * overlay.scale for link, geometry in loop.extraction.geometry.items()}
    stacked = stacked_pairs(tree, link_to_root(tree, features.root, start), pairs, drawn)
    note_stacked(stacked, loop.log.findings)
    overlay = overlay.model_copy(update={"passing": (*overlay.passing, *pinned, *stacked)})
    pairs = [pair for pair in pairs if pair not in (*pinned, *stacked)]
    exact, planes = exact_links(loop.extraction), loop.log.planes
    cleared = clear_ranges(hulls, tree, features.root, limits, start, pairs, shapes, exact, planes)
    off_floor, lifted = take_off_floor(loop, overlay, cleared.hulls)
    note_cuts(lifted, "where it would drag over", "as the object stands", loop.log)
    pressed = with_limits(overlay, cleared.limits).joints
    off_floor, roomy = room_for_presses(off_floor, pressed, tree, features.root, shapes, planes)
    note_cuts(roomy, "where it would stop a finger on", "and nothing is drawn there", loop.log)
    if not cleared.cuts and not cleared.limits and not cleared.jams:
        return overlay, off_floor if lifted or roomy else hulls
    why = (
        f"{len(cleared.cuts)} links cut and {len(cleared.limits)} limits drawn in so that joints can move; "
        f"{len(cleared.jams)} jams left"
    )
    loop.log.step(trace_step("range", 0.0, 0.0, bool(cleared.cuts or cleared.limits), why))
    note_cuts(cleared.cuts, "where it overlaps", "over the range of a joint", loop.log)
    note_limits(overlay, cleared, loop.log.findings)
    note_jams(cleared, loop.log.findings)
    return with_limits(overlay, cleared.limits), off_floor


def take_off_floor(loop: RefinementContext, overlay: PhysicsOverlay, hulls: Hulls) -> tuple[Hulls, list[Cut]]:
    """Hulls cut where a part drags over the floor on which the object can stand without it, and the cuts: what a hand
    opens hangs clear of the floor, though it is drawn down to it."""
    if overlay.support.kind is not SupportKind.FREESTANDING:
        return hulls, []
    tree = tree_of(written_joints(loop.extraction.features, overlay), overlay.scale)
    root, start = loop.extraction.features.root, overlay.initial_positions
    bodies = bodies_of(overlay)
    clouds = {link: geometry.points * overlay.scale for link, geometry in loop.extraction.geometry.items()}
    clouds |= {link: np.vstack(pieces) for link, pieces in hulls.items() if pieces}
    standing = StandingParts(tree, root, bodies, clouds, start)
    ranges = {j.name: (j.lower, j.upper) for j in overlay.joints if j.lower is not None and j.upper is not None}
    parts, floor = standing.dragging(ranges)
    poses, lifted, cuts = link_to_root(tree, root, start), dict(hulls), []
    for link in dict.fromkeys(link for links in parts.values() for link in links if hulls.get(link)):
        up, height = poses[link][2, :3], floor + FLOOR_GAP_M - poses[link][2, 3]
        low = [height - float((points @ up).min()) for points in hulls[link]]
        kept = [
            points if depth <= 0.0 else trim(points, up, height) for points, depth in zip(hulls[link], low, strict=True)
        ]
        cut = (item for item in zip(hulls[link], kept, strict=True) if item[1] is not None and item[1] is not item[0])
        loop.log.planes.extend(PlaneCut(whole, points, up, height) for whole, points in cut if points is not None)
        if max(low) > 0.0 and any(points is not None for points in kept):
            deepest = int(np.argmax(low))
            cuts.append(Cut(link, "floor", low[deepest], low[deepest] / float(np.ptp(hulls[link][deepest] @ up))))
            lifted[link] = tuple(points for points in kept if points is not None)
    return lifted, cuts


def with_limits(overlay: PhysicsOverlay, limits: Mapping[str, tuple[float, float]]) -> PhysicsOverlay:
    """The overlay with these joint limits."""

    def change(joint: JointPhysics) -> dict[str, object]:
        name, (lower, upper) = joint.name, limits[joint.name]
        ends = {"closed": clamped(limits, name, joint.closed), "open": clamped(limits, name, joint.open)}
        asked, way = joint.asked_position, abs(joint.open - joint.closed)
        if asked is not None and min(abs(asked - joint.closed), abs(asked - joint.open)) <= AT_END * way:
            nearer = clamped(limits, name, asked)
            ends |= {"asked_position": nearer} if abs(nearer - asked) <= ROUGHLY * way else {}
        return {"lower": lower, "upper": upper, "limits_source": Source.SEARCH, **ends}

    joints = (joint.model_copy(update=change(joint)) if joint.name in limits else joint for joint in overlay.joints)
    return overlay.model_copy(update={"joints": tuple(joints)})


def note_limits(overlay: PhysicsOverlay, cleared: Cleared, findings: list[Finding]) -> None:
    """A finding for every narrowed limit, with the links that stop the joint there."""
    for joint in overlay.joints:
        if joint.name not in cleared.limits:
            continue
        lower, upper = cleared.limits[joint.name]
        stop = cleared.stops.get(joint.name)
        met = "" if stop is None else f": there '{stop.link_a}' meets '{stop.link_b}' as authored"
        whole = (joint.upper or 0.0) - (joint.lower or 0.0)
        drawn = f"limits {joint.lower:.4g} … {joint.upper:.4g} drawn in to {lower:.4g} … {upper:.4g}{met}"
        text, name = f"joint '{joint.name}': {drawn}", joint.name
        findings.append(warning(code="limits_drawn_in", message=text, joint=name, value=upper - lower, limit=whole))


def note_pinned(pinned: Sequence[tuple[str, str]], findings: list[Finding]) -> None:
    """A finding for every pair of links that meets in all states."""
    for a, b in pinned:
        text = f"'{a}' and '{b}' meet as drawn wherever the joints between them are: they pass through each other, "
        findings.append(warning(code="links_pass", message=f"{text}as a link and its parent do", link=a))


def note_stacked(stacked: Sequence[tuple[str, str]], findings: list[Finding]) -> None:
    """A finding for every pair of links that turn about one line, one before the other."""
    for a, b in stacked:
        text = f"'{a}' and '{b}' turn about one line, one before the other: they pass through each other"
        findings.append(info(code="links_stacked", message=text, link=a))


def note_jams(cleared: Cleared, findings: list[Finding]) -> None:
    """A finding for every jam that is left."""
    for jam in cleared.jams:
        where = "at rest" if jam.joint is None else f"where joint '{jam.joint}' is at {jam.position:.3g}"
        why = "their meshes do" if jam.cause is OverlapCause.AUTHORED else "their hulls do"
        text = (
            f"'{jam.link_a}' and '{jam.link_b}' overlap by {1e3 * jam.depth_m:.3g} mm {where}, and cutting shapes "
            f"would take too much ({why})"
        )
        findings.append(warning(code="jam_left", message=text, joint=jam.joint, value=jam.depth_m))
