"""Support of an object: forced, else the user's words, the model's answer, what such things are, or the shape."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.base import WORLD
from asset2sim.guidance.supports import HANGS_CONFIDENCE, MADE_SO, STANDS_CONFIDENCE, usual_support
from asset2sim.models.object_facts import object_info
from asset2sim.physics.arrays import Array
from asset2sim.physics.convex_hull import hull_volume
from asset2sim.physics.kinematics import tree_of
from asset2sim.physics.mass_matrix import PosedObject, bodies_of
from asset2sim.physics.support_polygon import SupportPolygon, leaning_on
from asset2sim.validation.hanging import hangs_on_wall, lifts_up, swings_below
from schemas.features import Features
from schemas.finding import Finding
from schemas.guidance import Guidance
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.support import Mount, Support, SupportKind, SupportProposal
from schemas.vocabulary import Severity, Source, Stage

UP = np.array([0.0, 0.0, 1.0])
STANDS_RAD = 0.05
"""Margin to tip over, closed, from which an object can stand by itself, rad: two degrees about two axes, as a start of
the reset check tilts it. A leaf of a door has 1.1, a clock on its rim none."""
FIRM_RAD = 0.2
"""Margin, rad, from which a thing that only its name calls built in is a piece of furniture: a cupboard with doors."""
HAND_M = 0.25
"""Longest edge, m, up to which what cannot stand is taken in a hand and lies when it is put down."""
MARK_SHARE = 0.01
"""Longest edge over the object's up to which a shape marks a place and bears nothing."""
BACK_SHARE = 0.5
"""Share of a side of the object's box that lies in one plane for it to be a back that a wall carries."""
BACK_M = 0.005
"""Distance from that plane within which points lie in it, m: a plate's edge, a felt pad."""
SHAPE_CONFIDENCE = 0.4
"""Confidence in what only the shape says."""


def forced_support(kind: SupportKind | None, extraction: Extraction | None = None) -> Support | None:
    """The record of what the user forces, or of a scene that is not cut: it is fixed; None where nothing is forced."""
    if kind is not None:
        return Support(kind=kind, source=Source.USER, confidence=1.0, reason="forced by the user")
    if extraction is None or extraction.opened is None or not extraction.opened.scene:
        return None
    said = "its file holds several objects in one world"
    return Support(kind=SupportKind.FIXED, source=Source.AUTHORED, confidence=1.0, reason=said)


def with_support(
    overlay: PhysicsOverlay, extraction: Extraction, proposal: Overlay | None, source: Source, guidance: Guidance
) -> PhysicsOverlay:
    """The overlay of a method without our rules, with what carries its object: all methods are tested alike."""
    features, scale = extraction.features, overlay.scale
    bodies = bodies_of(overlay)
    points = {name: geometry.points * scale for name, geometry in extraction.geometry.items()}
    item = PosedObject(tree_of(features.joints, scale), features.root, bodies, points, {})
    standing = closed_polygon(features, item, scale)
    hangs, below = wall_evidence(features, points, scale, guidance.category)
    held = held_by_file(extraction, standing[0])
    support = support_of(features, proposal, source, guidance, *standing, held=held, hangs=hangs, below=below)
    return overlay.model_copy(update={"support": support})


def wall_evidence(features: Features, points: Mapping[str, Array], scale: float, category: str) -> tuple[str, str]:
    """Evidence of its shape, in words, that an object hangs on a wall: it is made so, and a floor would stop it."""
    made_so = hangs_on_wall(features, points, scale, category) or lifts_up(features, points, scale, category)
    return made_so, swings_below(features, points, scale, category)


def held_by_file(extraction: Extraction, polygon: SupportPolygon) -> str:
    """How its file holds the object where it is, in words: by its world, or a URDF by an empty link ``world`` on which
    it does not float, or by the table that it stands on, where by its ``polygon`` alone it would not stand firmly;
    empty where it does not."""
    features, opened = extraction.features, extraction.opened
    if opened is not None and opened.held:
        return opened.held
    if opened is not None and opened.stood and polygon.margin_rad < FIRM_RAD:
        return opened.stood
    floats = any(finding.code == "root_floats" for finding in extraction.findings)
    hung = features.root == WORLD and not features.link(WORLD).has_geometry and not floats
    return "its URDF hangs it from a link 'world'" if hung else ""


def on_a_frame(features: Features) -> bool:
    """Whether the root, with all that is fixed to it, has no shape, or one too small to bear anything, as marks have:
    parts that move hang on a frame."""
    still = {features.root}
    for _ in features.joints:
        still |= {joint.child for joint in features.joints if joint.type == "fixed" and joint.parent in still}
    least = MARK_SHARE * max(features.rest_size)
    return not any(features.link(name).has_geometry and max(features.link(name).box_size) > least for name in still)


def is_lone_part(features: Features) -> bool:
    """Whether the file has one part alone, on a joint of a root without a shape: a door whose oven is not there, of
    which no table knows how it stands."""
    return on_a_frame(features) and len(features.movable_joints) == 1


def closed_polygon(features: Features, item: PosedObject, scale: float) -> tuple[SupportPolygon, Array]:
    """The support polygon with every joint closed, leaning by no more than checks pass where that has it stand on more
    of its feet, and its (n, 3) points there in the root's frame, all at the final scale."""
    ends = {
        joint.name: (joint.closed or 0.0) * (scale if joint.prismatic else 1.0) for joint in features.movable_joints
    }
    closed = item.at(ends)
    return leaning_on(closed.cloud, closed.center, closed.mass, UP), closed.cloud


def support_of(
    features: Features,
    proposal: Overlay | None,
    source: Source,
    guidance: Guidance,
    polygon: SupportPolygon,
    points: Array,
    *,
    held: str = "",
    hangs: str = "",
    below: str = "",
) -> Support:
    """The support of the object, of the first that says so: the guidance, its file (``held``: how, in words), a lone
    part's root unless a model proposes, the proposal (of ``source``), the tables, the shape. What opens ``below`` a
    floor (how, in words), or is made as a wall cupboard (``hangs``: why, in words), hangs on a wall where the proposal
    or the tables only guess that it stands. ``polygon`` and ``points`` are of ``closed_polygon``."""
    # Of the asset's name models are told; rules take no more from it than from the shape.
    usual = usual_support(replace(object_info(features), asset_id=""), guidance.called, guidance.category)
    said = guidance.support
    if said is not None:
        mount = usual.mount if usual is not None and said.mount is None else said.mount
        return support_record(said.model_copy(update={"mount": mount}), Source.USER)
    if held:
        return Support(kind=SupportKind.FIXED, source=Source.AUTHORED, confidence=0.9, reason=held)
    if source is Source.PRIOR and is_lone_part(features):
        return by_shape(polygon, points, frame=True)
    guess = usual if proposal is None or proposal.support is None else proposal.support
    if (below or hangs) and (guess is None or guess.confidence <= STANDS_CONFIDENCE):
        return on_a_wall(below or hangs)
    if proposal is not None and proposal.support is not None:
        return support_record(without_doubtful_support(proposal.support, polygon), source)
    if usual is not None:
        return support_record(without_doubtful_support(usual, polygon), Source.PRIOR)
    return by_shape(polygon, points, frame=on_a_frame(features))


def on_a_wall(why: str) -> Support:
    """The record of a cupboard that its shape shows to hang on a wall."""
    reason = f"{MADE_SO}: {why}"
    kind, mount = SupportKind.FIXED, Mount.WALL
    return Support(kind=kind, mount=mount, source=Source.RULE, confidence=HANGS_CONFIDENCE, reason=reason)


def support_record(said: SupportProposal, source: Source) -> Support:
    """A proposal as the record of what carries the object."""
    mount = said.mount if said.kind is SupportKind.FIXED else None
    return Support(kind=said.kind, mount=mount, source=source, confidence=said.confidence, reason=said.reason)


def without_doubtful_support(said: SupportProposal, polygon: SupportPolygon) -> SupportProposal:
    """The proposal, or freestanding where it is none too sure of something built in that stands as firmly as
    furniture."""
    weak = said.confidence < 0.7 and said.mount is Mount.BUILT_IN
    if not weak or polygon.margin_rad < FIRM_RAD:
        return said
    reason = f"it stands with a margin of {np.degrees(polygon.margin_rad):.0f}°, although {said.reason}"
    return SupportProposal(kind=SupportKind.FREESTANDING, confidence=said.confidence, reason=reason)


def by_shape(polygon: SupportPolygon, points: Array, *, frame: bool = False) -> Support:
    """The support by the shape alone: parts that hang on a ``frame`` are held by it; what stands is freestanding; of
    what does not, small things are held in a hand, and the rest is fixed, to a wall where it has a flat back."""
    if frame:
        why = "all its parts move on a root without a shape, which something must hold"
        return Support(kind=SupportKind.FIXED, source=Source.RULE, confidence=SHAPE_CONFIDENCE, reason=why)
    size = np.ptp(points, axis=0)
    margin = f"closed, it tips over at {np.degrees(polygon.margin_rad):.2g}°"
    if polygon.margin_rad >= STANDS_RAD:
        confidence = min(1.0, SHAPE_CONFIDENCE + polygon.margin_rad)
        return Support(source=Source.RULE, confidence=confidence, reason=f"{margin}: it stands by itself")
    if size.max() <= HAND_M:
        kind, mount, why = SupportKind.HANDHELD, None, "small enough for a hand"
    elif has_flat_back(points):
        kind, mount, why = SupportKind.FIXED, Mount.WALL, "it cannot stand, and has a flat back"
    else:
        kind, mount, why = SupportKind.FIXED, None, "it cannot stand, and is too large for a hand"
    return Support(kind=kind, mount=mount, source=Source.RULE, confidence=SHAPE_CONFIDENCE, reason=f"{margin}: {why}")


def has_flat_back(points: Array) -> bool:
    """Whether one upright side of the box of (n, 3) points lies mostly in one plane."""
    low, high = points.min(axis=0), points.max(axis=0)
    for axis in (0, 1):
        others = [other for other in range(3) if other != axis]
        side = float(np.prod((high - low)[others]))
        for end in (low[axis], high[axis]):
            flat = points[np.abs(points[:, axis] - end) <= BACK_M][:, others]
            if side > 0.0 and hull_volume(flat) >= BACK_SHARE * side:
                return True
    return False


def support_findings(support: Support) -> tuple[Finding, ...]:
    """A finding that says what carries an object that does not stand free; a warning where that is guessed from its
    shape, with how to say it."""
    if support.kind is SupportKind.FREESTANDING:
        return ()
    to = {None: "", Mount.BUILT_IN: ", built in"}.get(support.mount, f" to the {support.mount}")
    guessed = support.source is Source.RULE
    advice = "; say so by --support or the manifest's column 'support' where that is wrong" if guessed else ""
    return (
        Finding(
            stage=Stage.VALIDATE,
            severity=Severity.WARNING if guessed else Severity.INFO,
            code="support_guessed" if guessed else "support",
            message=f"{support.kind}{to} ({support.source}, {support.confidence:.2g} sure): {support.reason}{advice}",
            value=support.confidence,
        ),
    )
