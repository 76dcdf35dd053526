"""Joint physics at the initial pose: effective inertia, gravity load, and the triplet derived from them."""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product

from asset2sim.physics.dynamics import joint_terms
from asset2sim.physics.kinematics import TreeJoint, mimics_of, subtree
from asset2sim.physics.mass_matrix import Body, JointSpace, Pull, joint_space
from asset2sim.physics.terms import JointLoad, JointTerms, Term
from asset2sim.validation.handling import Handling, bounded_press, felt_press, standing_part
from asset2sim.validation.holding import NO_BALANCE, Holding, counterbalance, holding, leaves
from asset2sim.validation.limits import Range
from asset2sim.validation.masses import check_mass_matrices
from asset2sim.validation.notes import Notes
from asset2sim.validation.positions import Start, turned
from schemas.features import Features
from schemas.overlay import JointPhysics, JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import DynamicsRule, Source

SHARES = (0.0, 0.5, 1.0)
"""Shares of each joint's range."""
MOST_COMBINED = 3
"""Joints up to which every combination of shares is taken; 27 poses."""


def spanning_poses(starts: Mapping[str, Start]) -> list[dict[str, float]]:
    """Sample poses (joint → rad or m): the start, then every combination of ends and middles; with more joints than
    ``MOST_COMBINED``, all joints together and every other one."""
    names = list(starts)
    ranges = [starts[name].range for name in names]
    if len(names) <= MOST_COMBINED:
        combinations = list(product(SHARES, repeat=len(names)))
    else:
        even = [index % 2 == 0 for index in range(len(names))]
        combinations = [tuple(share for _ in names) for share in SHARES]
        combinations += [tuple(float(flag is first) for flag in even) for first in (True, False)]
    poses = [{name: start.position for name, start in starts.items()}]
    for shares in combinations:
        poses.append({n: at_share(span, share) for n, span, share in zip(names, ranges, shares, strict=True)})
    return poses


def at_share(span: Range, share: float) -> float:
    """The position at a share of a range; of a whole turn for continuous joints."""
    if span.lower is None or span.upper is None:
        return 2.0 * math.pi * share * (2.0 / 3.0)  # both ends of a whole turn are the same place
    return span.lower + share * (span.upper - span.lower)


HELD_STATE = 0.05
"""Share of its range beyond the closed end from which a requested state counts as open, and so must be held."""


def joint_physics(
    features: Features,
    tree: Sequence[TreeJoint],
    bodies: Mapping[str, Body],
    starts: Mapping[str, Start],
    proposals: Mapping[str, JointProposal],
    handled: Mapping[str, Handling],
    asked: frozenset[str],
    scale: float,
    source: Source,
    settings: PhysicsSettings,
    notes: Notes,
    *,
    base_held: bool = False,
) -> tuple[JointPhysics, ...]:
    """Complete physics of every movable joint; ``tree`` and ``bodies`` are at the final scale. ``handled`` says how
    people handle each joint's part. Where the base is held, joints move what they move on it; what bounds damping and
    stiffness stays that of a free base, which is less: somebody may free it."""
    spaces = [joint_space(tree, features.root, bodies, pose) for pose in spanning_poses(starts)]
    space = spaces[0]
    check_mass_matrices(features, spaces)
    inertias = space.inertia_on_held_base() if base_held else space.effective_inertia()
    held = space.held_inertia()
    pulls = dict(zip(space.names, space.pulls, strict=True))
    largest_gravity = dict(zip(space.names, space.largest_gravity, strict=True))
    everywhere = [item.effective_inertia() for item in spaces]
    total = sum(body.mass for body in bodies.values())
    mimics = mimics_of(tree)
    joints: list[JointPhysics] = []
    rests: dict[str, float] = {}
    for name, start in starts.items():
        joint, span, pull = start.range.joint, start.range, pulls[name]
        proposal = proposals.get(name, JointProposal(name=name))
        if name not in proposals:
            notes.info(
                "joint_completed", f"joint '{name}': the overlay omits it; dynamics from time constants", joint=name
            )
        holds = proposal.holds is True or (proposal.holds is None and start.requested and is_open(start))
        if holds and proposal.holds is None and leaves(start, pull, largest_gravity[name]):
            message = (
                f"joint '{name}': asked to stand at {start.position:.4g}, where its weight would move it: it holds"
            )
            notes.info("holds_implied", message, joint=name, value=start.position)
        least = min(found[name] for found in everywhere)
        heavier = sum(bodies[link].mass for link in subtree(tree, name)) > total / 2.0 and not base_held
        kind = standing_part(handled[name]) if heavier else handled[name]
        held_by = held_where_left(proposal, start, pull, largest_gravity[name], kind, holds, least, settings)
        factor = scale if joint.prismatic else 1.0
        wanted = start.position if proposal.spring_rest is None else turned(span, proposal.spring_rest * factor)
        rests[name] = span.clamp(wanted)
        moved = JointLoad(
            prismatic=joint.prismatic,
            inertia=inertias[name],
            least=least,
            held=held[name],
            pull=pull,
            lower=span.lower,
            upper=span.upper,
            closed=span.closed,
            open=span.open,
            rest=rests[name],
            hold_friction=held_by.friction,
            reach=handled[name].lever,
        )
        proposal = bounded_press(proposal, handled[name], moved.far, settings, notes)
        by, authored = Source.USER if f"{name}.dynamics" in asked else source, joint.damping
        terms_of = partial(joint_terms, moved=moved, holds=holds, authored_damping=authored, settings=settings)
        terms = terms_of(proposal, source=by)
        if by is not Source.USER and settings.dynamics is not DynamicsRule.PAPER:
            felt = felt_press(proposal, handled[name], terms, moved, notes)
            if felt is not None:
                terms = terms_of(bounded_press(felt, handled[name], moved.far, settings, notes), source=Source.RULE)
        stiffness, reference = terms.stiffness, terms.spring_reference
        if held_by.balance.stiffness > 0.0:
            stiffness, reference = Term(held_by.balance.stiffness, Source.RULE), held_by.balance.reference
            rests[name] = reference
        report(name, moved, terms, holds, notes)
        report_holding(name, held_by, handled[name], notes)
        joints.append(
            JointPhysics(
                name=name,
                type=joint.type,
                label=features.link(joint.child).label,
                damping=terms.damping.value,
                damping_source=terms.damping.source,
                friction=terms.friction.value,
                friction_source=terms.friction.source,
                stiffness=stiffness.value,
                stiffness_source=stiffness.source,
                spring_reference=reference,
                lower=span.lower,
                upper=span.upper,
                limits_source=span.source,
                closed=span.closed,
                open=span.open,
                initial_position=start.position,
                position_source=start.source,
                effective_inertia=moved.inertia,
                gravity_load=pull.force,
                holds=holds,
                least_inertia=moved.least,
                asked_position=start.asked,
                effort_range=handled[name].range,
                armature=terms.armature,
                mimic=mimics.get(name),
                exact=f"initial_joint_positions.{name}" in asked,
            )
        )
    if settings.dynamics is DynamicsRule.PAPER:
        return tuple(joints)
    return bound_together(joints, rests, spaces, settings, notes)


def held_where_left(
    proposal: JointProposal,
    start: Start,
    pull: Pull,
    largest_gravity: float,
    kind: Handling,
    holds: bool,
    least_inertia: float,
    settings: PhysicsSettings,
) -> Holding:
    """What holds a joint that must stay where it is placed, or that is asked to stand near its balance though it moves
    freely: there the friction that this takes is small."""
    springs = (proposal.stiffness, proposal.spring_hz, proposal.returns_s, proposal.press_start, proposal.press_end)
    sprung = any(value is not None for value in springs)
    balanced = abs(pull.force) <= settings.free_hold_share * largest_gravity
    stays = holds or (start.asked is not None and balanced)
    if settings.dynamics is DynamicsRule.PAPER or not (holds or (stays and not sprung)):
        return Holding()
    balance = NO_BALANCE if sprung else counterbalance(start, pull, kind, least_inertia, settings)
    bump = settings.bump_share if holds else settings.free_bump_share
    return holding(start, pull, largest_gravity, kind, balance, bump_share=bump, settings=settings)


def report_holding(name: str, held_by: Holding, kind: Handling, notes: Notes) -> None:
    """Add a finding where a spring carries a part's weight, and where a hand allows less friction than a bump needs."""
    if held_by.balance.stiffness > 0.0:
        stiffness = held_by.balance.stiffness
        message = f"joint '{name}': springs of {stiffness:.3g} N·m/rad carry its part, as of a {kind.range.kind}"
        notes.info("counterbalanced", message, joint=name, value=stiffness)
    if held_by.cut:
        message = (
            f"joint '{name}': friction that holds it, {held_by.wanted:.3g}, set to {held_by.friction:.3g}: with more a "
            "hand could not move it, or it would tip or slide; where contacts are stiffer than friction it may creep"
        )
        notes.info("friction_handled", message, joint=name, value=held_by.wanted, limit=held_by.friction)


def is_open(start: Start) -> bool:
    """Whether the joint starts open: away from its closed end by more than ``HELD_STATE`` of its range."""
    return abs(start.position - start.range.closed) > HELD_STATE * start.range.span


def report(name: str, moved: JointLoad, terms: JointTerms, holds: bool, notes: Notes) -> None:
    """Add a finding for every term that a bound changed and for every wish that is not met."""
    units = ("N·s/m", "N", "N/m") if moved.prismatic else ("N·m·s/rad", "N·m", "N·m/rad")
    bears = f"what its {moved.least:.3g} {'kg' if moved.prismatic else 'kg·m²'} bear at the time step"
    why = {
        "damping": f"{bears}, and a spring needs",
        "friction": "what holds it where it is placed" if holds else "its bound",
        "stiffness": bears,
    }
    for kind, term, unit in zip(why, (terms.damping, terms.friction, terms.stiffness), units, strict=True):
        if changed(term):
            message = f"joint '{name}': {kind} {term.replaced:.3g} {unit} set to {term.value:.3g}: {why[kind]}"
            notes.info(f"{kind}_bounded", message, joint=name, value=term.replaced, limit=term.value)
    for miss in terms.unmet:
        unit = "s" if miss.wish != "stops_within" else "m" if moved.prismatic else "rad"
        instead = "" if miss.achieved is None else f" is {miss.achieved:.3g} {unit}"
        message = f"joint '{name}': {miss.wish} of {miss.asked:.3g} {unit}{instead or ' does not apply'}: {miss.why}"
        notes.info(f"{miss.wish}_unmet", message, joint=name, value=miss.asked, limit=miss.achieved)


def changed(term: Term) -> bool:
    """Whether a bound replaced the term by something visibly different."""
    return term.replaced is not None and abs(term.replaced - term.value) > 1e-3 * max(abs(term.value), 1e-12)


def bound_together(
    joints: list[JointPhysics],
    rests: Mapping[str, float],
    spaces: Sequence[JointSpace],
    settings: PhysicsSettings,
    notes: Notes,
) -> tuple[JointPhysics, ...]:
    """Scale down all damping, or all stiffness, where the coupled joints would be unstable at the time step.

    Explicit damping is stable while Δt times the largest eigenvalue of M⁻¹D is below 2, a spring while Δt² times that
    of M⁻¹K is below 4; before, each joint was bounded alone. A spring keeps the force with which it presses at rest.
    Springs with an armature keep their stiffness: the armature grows instead, until it bears the spring alone. It does
    not count for damping, since a URDF's reader knows the damping and not the armature.
    """
    step = settings.coarse_timestep_s
    damping = {joint.name: joint.damping for joint in joints}
    fastest = max(space.fastest_decay(damping) for space in spaces)
    largest = 2.0 * settings.max_damping_step / step
    if fastest > largest:
        factor = largest / fastest
        message = (
            f"all joint damping scaled by {factor:.3g}: together the joints decay at {fastest:.3g} 1/s, more than the "
            "time step bears"
        )
        notes.info("damping_coupled", message, value=fastest, limit=largest)
        joints = [
            joint.model_copy(update={"damping": joint.damping * factor, "damping_source": Source.RULE})
            for joint in joints
        ]
    largest = 2.0 * settings.max_stiffness_step / step**2
    fastest = fastest_spring(joints, spaces)
    if fastest > largest:
        joints = [
            joint.model_copy(update={"armature": max(joint.armature, joint.stiffness / largest)})
            if joint.armature > 0.0
            else joint
            for joint in joints
        ]
        fastest = fastest_spring(joints, spaces)
    if fastest > largest:
        factor = largest / fastest
        message = (
            f"all joint stiffness scaled by {factor:.3g}: together the springs drive the joints at {fastest:.3g} 1/s², "
            "more than the time step bears"
        )
        notes.info("stiffness_coupled", message, value=fastest, limit=largest)
        joints = [softened(joint, factor, rests[joint.name]) for joint in joints]
    return tuple(joints)


def fastest_spring(joints: Sequence[JointPhysics], spaces: Sequence[JointSpace]) -> float:
    """The largest eigenvalue of M⁻¹ K over these poses, the joints' armature in M, 1/s²."""
    stiffness = {joint.name: joint.stiffness for joint in joints}
    armature = {joint.name: joint.armature for joint in joints}
    return max(space.geared(armature).fastest_decay(stiffness) for space in spaces)


def softened(joint: JointPhysics, factor: float, rest: float) -> JointPhysics:
    """The joint with its spring's stiffness multiplied, and the same force at ``rest`` (rad or m)."""
    if joint.stiffness == 0.0:
        return joint
    reference = rest + (joint.spring_reference - rest) / factor
    changes = {"stiffness": joint.stiffness * factor, "stiffness_source": Source.RULE, "spring_reference": reference}
    return joint.model_copy(update=changes)
