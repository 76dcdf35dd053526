"""The whole of validation: scale, masses, limits, positions, joint dynamics, in that order."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from asset2sim.assets.authored_overlap import authored_shapes
from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.read import read_dynamics
from asset2sim.guidance.amounts import LARGEST_M as LARGEST_M
from asset2sim.guidance.amounts import SMALLEST_M as SMALLEST_M
from asset2sim.guidance.category import row_of
from asset2sim.guidance.sizing import REAL_SLACK
from asset2sim.guidance.tables import UNKNOWN, materials
from asset2sim.physics.arrays import floats_of, inertia_terms
from asset2sim.physics.kinematics import locked_joint, tree_of
from asset2sim.physics.mass_matrix import Body, PosedObject, Pull, joint_space
from asset2sim.validation.build import as_thick_as_their_kind
from asset2sim.validation.disputes import Disputes
from asset2sim.validation.handling import Handling, handlings, is_pressed
from asset2sim.validation.joints import JointInputs, joint_physics
from asset2sim.validation.lifted_starts import lifted_starts
from asset2sim.validation.limits import joint_range
from asset2sim.validation.mass_bounds import bound_inertia_by_extent, with_armature, with_plungers
from asset2sim.validation.masses import LinkMass, link_masses
from asset2sim.validation.mechanisms import at_their_ends
from asset2sim.validation.opened_stand import note_tips_when_open
from asset2sim.validation.positions import (
    hanging_starts,
    initial_positions,
    leaders_positions,
    note_guessed_ends,
    starts_of_followers,
)
from asset2sim.validation.pressed import Drawn, pressed_ranges
from asset2sim.validation.support import closed_polygon, held_by_file, support_of, wall_evidence
from asset2sim.validation.suspension import lifted_by_machines, with_suspensions
from asset2sim.validation.trust import (
    Opinion,
    carried_where_they_start,
    judge_joints,
    with_authored_sources,
    with_kept_terms,
    with_limits,
    without_bounds_of,
)
from asset2sim.validation.trust_links import judge_links
from asset2sim.validation.trust_surroundings import judge_contact, judge_shapes, judge_starts
from schemas.authored import KEPT_AS_ASKED
from schemas.features import LinkFeatures
from schemas.finding import Finding, Notes
from schemas.guidance import NOTHING_ASKED, Guidance
from schemas.overlay import LinkPhysics, Overlay, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.support import Support, SupportKind
from schemas.thresholds import Thresholds
from schemas.vocabulary import DynamicsRule, Quantity, Source

ROOM_OF_METRES = 20.0
"""Factor by which an object whose file is in metres may be larger or smaller than household objects: halls, worlds."""
SAME_SCALE = 1e-3
"""How far a scale may be from 1 for the authored masses to be those of the object."""
WEIGHED_SHARE = 0.05
"""How far an object's mass may be from the one that its user's words state without a finding."""
DEFAULT_LIMITS = Thresholds()


def validate(
    extraction: Extraction,
    overlay: Overlay,
    source: Source,
    contact_friction: float,
    settings: PhysicsSettings,
    support: Support | None = None,
    *,
    guidance: Guidance = NOTHING_ASKED,
    placed: Mapping[str, float] = MappingProxyType({}),
    keep_terms: bool = True,
    contact_source: Source | None = None,
    limits: Thresholds = DEFAULT_LIMITS,
) -> tuple[PhysicsOverlay, tuple[Finding, ...]]:
    """A complete overlay and what was changed to complete it. ``source`` says who proposed (``model`` or ``prior``);
    what ``overlay.asked`` names counts as the user's. ``support`` says what carries the object; None: it is found, from
    the user's ``guidance`` first. Joints that the search has ``placed`` (rad or m) start there, whatever is asked. Not
    to ``keep_terms`` supplies the damping, friction and springs that a file in metres states, too. With a
    ``contact_source`` the coefficient of contacts is final. ``limits`` say by what margin an object stands."""
    notes, features = Notes(), extraction.features
    if features.metric == KEPT_AS_ASKED and "scale" not in overlay.asked:
        overlay = overlay.model_copy(update={"scale": 1.0})
    in_metres = bool(features.metric) and abs(overlay.scale - 1.0) <= SAME_SCALE
    scale, scale_source = bounded_scale(overlay, max(features.rest_size), source, notes, in_metres=in_metres)
    in_metres = in_metres and scale == overlay.scale
    if features.metric and not in_metres:
        far = "scale" not in overlay.asked and not 1.0 / REAL_SLACK <= scale <= REAL_SLACK
        message = f"{features.metric}, and its size is changed by a scale of {scale:.4g}{', unasked' * far}"
        notes.info("rescaled_unasked" if far else "rescaled", message, value=scale, limit=1.0)
    note_mass_change(overlay, notes)
    opinion = Opinion(features.keep, in_metres, Disputes.of(overlay, settings))
    opinion.disputes.refuse_size(features.metric)
    proposals = {item.name: item for item in overlay.links}
    # What a model proposes may be far off, and it may dispute masses itself.
    known = settings.least_unknown_share if guidance.category == UNKNOWN else settings.least_known_share
    judge_links(opinion, features, proposals, settings, known if source is Source.PRIOR else 0.0)
    judge_shapes(opinion, features.links)
    coefficient = judge_contact(opinion, features, settings)
    proposed = {item.name for item in overlay.joints if item.spring_rest is not None}
    sprung = proposed | {joint.name for joint in features.joints if joint.stiffness}
    starts = judge_starts(opinion, features.movable_joints, sprung)
    contact = contact_friction, contact_source or (source if overlay.contact_friction is None else Source.USER)
    overlay = opinion.disputes.applied(overlay)
    disputed = opinion.disputes.of_contact
    if contact_source is None and contact[1] is not Source.USER:
        contact = (disputed, source) if disputed else coefficient or contact
    unmoved = Completion(
        extraction, scale, scale_source, source, contact, settings, guidance, placed, opinion, starts, limits
    )
    told = Notes()
    completed = complete(unmoved, overlay, support, told)
    done, handled = completed.physics, completed.handled
    if opinion.on_joints and keep_terms and settings.dynamics is not DynamicsRule.PAPER:
        stated = read_dynamics(extraction.urdf)
        pulls = completed.pulls() if any(own.stiffness for own in stated.values()) else {}
        judge_joints(opinion, done.all_joints, stated, handled, pulls, settings)
        overlay = opinion.disputes.applied(overlay)
        carried = carried_where_they_start(opinion, features, stated, pulls)
        # Of its springs the file's are no more that are not believed: what they would bring elsewhere stays.
        loose = {name for name in sprung - proposed if Quantity.SPRINGS not in opinion.kept(name)}
        held = [joint for joint in features.movable_joints if joint.name in carried | loose]
        unmoved = replace(unmoved, starts=starts | judge_starts(opinion, held, sprung - carried - loose))
        kept = with_kept_terms(overlay, opinion, stated, done.all_joints, handled, carried)
        if kept != overlay or unmoved.starts != starts:
            told = Notes()
            completed = complete(unmoved, kept, support, told)
            done, handled = completed.physics, completed.handled
            done = with_authored_sources(done, opinion, stated, handled, pulls, settings)
            told.findings = without_bounds_of(done, told.findings)
    if opinion.found or features.metric:
        done = done.model_copy(update={"authored": with_limits(opinion, done, features.metric).grouped()})
    notes.findings.extend((*opinion.disputes.notes.findings, *told.findings))
    note_unmet_mass(overlay, guidance, done.mass_kg, notes)
    return done, tuple(notes.findings)


@dataclass(frozen=True)
class Completion:
    """All that completes a proposal, beside it: the asset, its final scale and the coefficient of its contacts and
    whose these are, who proposes, what of the file is believed, and where joints start by it (authored scale)."""

    extraction: Extraction
    scale: float
    scale_source: Source
    source: Source
    contact: tuple[float, Source]
    settings: PhysicsSettings
    guidance: Guidance
    placed: Mapping[str, float]
    opinion: Opinion
    starts: Mapping[str, float]
    limits: Thresholds


@dataclass(frozen=True)
class Completed:
    """A complete overlay, how people handle each part, and the object at its start of which it was made."""

    physics: PhysicsOverlay
    handled: Mapping[str, Handling]
    item: PosedObject

    def pulls(self) -> dict[str, Pull]:
        """Joint → gravity's pull on it, the others where they start."""
        space = joint_space(self.item.tree, self.item.root, self.item.bodies, self.item.positions)
        return dict(zip(space.names, space.pulls, strict=True))


def complete(given: Completion, overlay: Overlay, support: Support | None, notes: Notes) -> Completed:
    """A proposal completed: masses, limits, positions, support, joint dynamics."""
    extraction, scale, source, settings = given.extraction, given.scale, given.source, given.settings
    features, asked = extraction.features, frozenset(overlay.asked)
    links = {proposal.name: proposal for proposal in overlay.links}
    known = features.model_copy(update={"category": row_of(features.category, given.guidance.category)})
    weighed = {link.name for link in features.links if f"links.{link.name}.mass_kg" in asked}
    if source is Source.MODEL:
        links = as_thick_as_their_kind(known, links, scale, weighed, notes)
    believed = {link.name: given.opinion.kept(link.name) for link in features.links}
    masses = link_masses(features, links, scale, source, settings, notes, weighed, believed)
    proposals = {proposal.name: proposal for proposal in overlay.joints}
    pressed = [name for name, item in proposals.items() if is_pressed(item)]
    masses = with_armature(with_plungers(masses, features, pressed, settings, notes), features, settings, notes)
    points = {name: geometry.points * scale for name, geometry in extraction.geometry.items()}
    masses = bound_inertia_by_extent(masses, features.links, points, settings, notes)
    spans = {joint.name: joint_range(joint, scale, notes) for joint in features.joints}
    ranges = {name: span for name, span in spans.items() if span is not None}
    rests = {name: item.spring_rest for name, item in proposals.items() if item.spring_rest is not None}
    wanted, theirs = leaders_positions(features, overlay.initial_joint_positions, asked, notes)
    asked_for = {name: position for name, position in wanted.items() if name in theirs}
    limits_kept = given.opinion.keeps(Quantity.LIMITS)
    drawn = Drawn(features, authored_shapes(extraction, 1.0), extraction.presses)
    ranges = pressed_ranges(drawn, ranges, proposals, asked_for, scale, kept=limits_kept, notes=notes)
    starts = initial_positions(ranges, wanted, rests, theirs, scale, source, settings, notes, given.starts, known)
    starts = {name: replace(start, position=given.placed.get(name, start.position)) for name, start in starts.items()}
    starts = starts_of_followers(features, lifted_starts(features, starts, notes), scale, notes)
    note_guessed_ends(known, starts, asked, settings.sure_of_closed, notes)
    movable = [joint if joint.name in ranges or not joint.movable else locked_joint(joint) for joint in features.joints]
    tree, bodies = tree_of(movable, scale), {n: Body(m.mass, m.com, m.inertia) for n, m in masses.items()}
    item = PosedObject(tree, features.root, bodies, points, {name: start.position for name, start in starts.items()})
    if support is None:
        standing = closed_polygon(features, item, scale)
        hangs, below = wall_evidence(features, points, scale, given.guidance.category)
        held, said = held_by_file(extraction, standing[0]), given.guidance
        support = support_of(features, overlay, source, said, *standing, held=held, hangs=hangs, below=below)
    if support.fixed:
        starts = hanging_starts(starts, tree, features.root, bodies)
        item = item.at({name: start.position for name, start in starts.items()})
    handled = handlings(known, item, proposals, given.contact[0], settings, carried=support.kind)
    if support.kind is SupportKind.FREESTANDING:
        springs = [joint.name for joint in features.joints if joint.stiffness]
        handled = with_suspensions(handled, springs, item)
        note_tips_when_open(item, starts, handled, given.limits, notes)
    exact = {name for name in starts if f"initial_joint_positions.{name}" in asked}
    starts = at_their_ends(starts, handled, exact | given.placed.keys())
    sprung = frozenset(name for name in starts if Quantity.SPRINGS in given.opinion.kept(name))
    inputs = JointInputs(
        features, tree, bodies, starts, proposals, handled, asked, scale, source, base_held=support.fixed, sprung=sprung
    )
    joints = joint_physics(inputs, settings, notes)
    levers = {name: item.lever for name, item in handled.items()}
    joints = lifted_by_machines(joints, item, levers, bool(known.category))
    done = PhysicsOverlay(
        asset_id=features.asset_id,
        scale=scale,
        scale_source=given.scale_source,
        scale_sigma=overlay.uncertainty.get("scale"),
        contact_friction=given.contact[0],
        contact_source=given.contact[1],
        front=features.front,
        support=support,
        links=tuple(link_physics(masses[link.name], link, believed[link.name]) for link in features.links),
        joints=tuple(joint for joint in joints if joint.mimic is None),
        followers=tuple(joint for joint in joints if joint.mimic is not None),
        notes=overlay.notes,
    )
    return Completed(done, handled, item)


def bounded_scale(
    overlay: Overlay, longest_m: float, source: Source, notes: Notes, *, in_metres: bool = False
) -> tuple[float, Source]:
    """The proposed scale, clamped so that the longest edge is within ``SMALLEST_M`` and ``LARGEST_M``, times
    ``ROOM_OF_METRES`` either way where it leaves a file that is ``in_metres`` as it is, and its source."""
    wanted, room = overlay.scale * longest_m, ROOM_OF_METRES if in_metres else 1.0
    if SMALLEST_M / room <= wanted <= LARGEST_M * room:
        return overlay.scale, Source.USER if "scale" in overlay.asked else Source.AUTHORED if in_metres else source
    bounded = float(np.clip(wanted, SMALLEST_M, LARGEST_M)) / longest_m
    message = f"scale {overlay.scale:.4g} would make the longest edge {wanted:.4g} m; set to {bounded:.4g}"
    notes.warn("scale_bounded", message, value=wanted, limit=bounded * longest_m)
    return bounded, Source.RULE


def note_mass_change(overlay: Overlay, notes: Notes) -> None:
    """A finding where the proposal's masses were scaled together: a warning unless the user stated the mass."""
    change = overlay.mass_change
    if change is None:
        return
    message = f"the parts weigh {change.from_kg:.3g} kg by construction; brought to {change.to_kg:.3g} kg: {change.why}"
    note = notes.info if change.asked else notes.warn
    note("mass_fitted", message, value=change.from_kg, limit=change.to_kg)


def note_unmet_mass(overlay: Overlay, guidance: Guidance, mass_kg: float, notes: Notes) -> None:
    """A warning where the object does not weigh what its user's words state, though the proposal was to."""
    if guidance.mass is None or overlay.mass_change is None or not overlay.mass_change.asked:
        return
    wanted = guidance.mass.mass_kg
    if abs(mass_kg / wanted - 1.0) > WEIGHED_SHARE:
        message = f"the user's words ask for {wanted:.4g} kg; of its size and materials it weighs {mass_kg:.4g} kg"
        notes.warn("mass_unmet", message, value=wanted, limit=mass_kg)


def link_physics(item: LinkMass, link: LinkFeatures, kept: Collection[Quantity]) -> LinkPhysics:
    """The ``LinkPhysics`` record of one link, of which these quantities are ``kept``."""
    return LinkPhysics(
        name=item.name,
        label=link.label,
        material=item.made.material,
        density_kg_m3=item.made.density,
        hollow_factor=item.made.hollow,
        volume_m3=item.made.volume,
        volume_source=item.made.volume_source,
        outer_m2=item.made.outer,
        wall_m=item.made.wall,
        contents=item.made.contents,
        mass_rule=item.rule,
        mass_kg=item.mass,
        mass_source=item.mass_source,
        com=floats_of(item.com),
        com_source=item.com_source,
        inertia=inertia_terms(item.inertia),
        inertia_source=item.inertia_source,
        shapes_source=shapes_source(link, kept),
    )


def shapes_source(link: LinkFeatures, kept: Collection[Quantity]) -> Source | None:
    """Where a link's collision shapes come from: its file, where they may stay, or our rules; None without geometry."""
    if not link.has_geometry:
        return None
    stay = Quantity.SHAPES in kept or not link.shapes_doubt
    return Source.AUTHORED if link.has_shapes and stay else Source.RULE


def contact_friction(material: str | None, settings: PhysicsSettings) -> float:
    """Coulomb coefficient of a contact material on a table top; the settings' default for none and for unknown ones."""
    known = materials().get((material or "").strip().lower())
    return settings.contact_friction if known is None else known.friction
