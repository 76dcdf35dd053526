"""Joint physics at the initial pose: effective inertia, gravity load, and the triplet derived from them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from asset2sim.physics.dynamics import joint_terms
from asset2sim.physics.kinematics import TreeJoint, mimics_of, moved_links
from asset2sim.physics.mass_matrix import Body, JointSpace, Pull, joint_space
from asset2sim.physics.terms import JointLoad, JointTerms, Term
from asset2sim.validation.handling import (
    LOW_LEVELS,
    Handling,
    as_asked,
    as_light_as_stated,
    bounded_press,
    felt_press,
    is_sprung,
    standing_part,
)
from asset2sim.validation.holding import (
    NO_BALANCE,
    Balance,
    Holding,
    counterbalance,
    felt_friction,
    friction_armature,
    holding,
    must_hold,
)
from asset2sim.validation.joint_coupling import bound_together
from asset2sim.validation.joint_reports import report_changes, report_effort, report_holding, report_plain_spring
from asset2sim.validation.masses import check_mass_matrices
from asset2sim.validation.mechanisms import (
    PRESSED_RUB,
    SNAP_FRICTION,
    bias_armature,
    caught_where_it_drops,
    is_bistable,
    mechanism_bias,
    pressed_shut,
    strut,
)
from asset2sim.validation.positions import Start, spanning_poses, without_whole_turns
from schemas.features import Features
from schemas.finding import Notes
from schemas.overlay import JointPhysics, JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import DynamicsRule, Source

UPRIGHT = 0.05
"""Share of gravity's largest pull below which a hinge counts as upright: within 3 degrees."""


@dataclass(frozen=True)
class JointInputs:
    """Inputs of joint physics, at the final scale: the kinematic ``tree`` and its ``bodies``, where joints
    start, what is proposed for them, how people handle their parts, the paths that the user states (``asked``), and who
    proposes the rest (``source``). On a base that is held joints move what they move on it, which also bounds damping
    and stiffness: whoever frees it drops the object. ``sprung`` joints have their file's own springs."""

    features: Features
    tree: Sequence[TreeJoint]
    bodies: Mapping[str, Body]
    starts: Mapping[str, Start]
    proposals: Mapping[str, JointProposal]
    handled: Mapping[str, Handling]
    asked: frozenset[str]
    scale: float
    source: Source
    base_held: bool = False
    sprung: frozenset[str] = frozenset()


@dataclass(frozen=True)
class JointMechanics:
    """Inertia that one joint moves (kg·m² or kg) at the start: ``inertia`` as it accelerates, ``held`` with all else
    still, and ``least`` over all poses; gravity's ``pull`` there, and the largest in any direction. ``bears_most``: it
    carries more than half of the object."""

    inertia: float
    held: float
    least: float
    pull: Pull
    largest_gravity: float
    bears_most: bool


def joint_physics(inputs: JointInputs, settings: PhysicsSettings, notes: Notes) -> tuple[JointPhysics, ...]:
    """Complete physics of every movable joint."""
    poses = spanning_poses(inputs.starts)
    root, held = inputs.features.root, inputs.base_held
    spaces = [joint_space(inputs.tree, root, inputs.bodies, pose, held) for pose in poses]
    check_mass_matrices(inputs.features, spaces)
    mechanics = joint_mechanics(inputs, spaces)
    made = [one_joint(inputs, name, mechanics[name], settings, notes) for name in inputs.starts]
    joints = [joint for joint, _ in made]
    if settings.dynamics is DynamicsRule.PAPER:
        return tuple(joints)
    return bound_together(joints, {joint.name: rest for joint, rest in made}, spaces, settings, notes)


def joint_mechanics(inputs: JointInputs, spaces: Sequence[JointSpace]) -> dict[str, JointMechanics]:
    """Joint → its mechanics, of the joint spaces of sample poses, the first of which is the start."""
    space, bodies = spaces[0], inputs.bodies
    everywhere = [item.effective_inertia() for item in spaces]
    inertias, held = everywhere[0], space.held_inertia()
    total = sum(body.mass for body in bodies.values())
    return {
        name: JointMechanics(
            inertia=inertias[name],
            held=held[name],
            least=min(found[name] for found in everywhere),
            pull=pull,
            largest_gravity=largest,
            bears_most=not inputs.base_held
            and sum(bodies[link].mass for link in moved_links(inputs.tree, name)) > total / 2.0,
        )
        for name, pull, largest in zip(space.names, space.pulls, space.largest_gravity, strict=True)
    }


def one_joint(
    inputs: JointInputs, name: str, mechanics: JointMechanics, settings: PhysicsSettings, notes: Notes
) -> tuple[JointPhysics, float]:
    """One joint's physics, and where a spring brings it (rad or m)."""
    start, handled = inputs.starts[name], inputs.handled[name]
    proposal = inputs.proposals.get(name) or omitted_joint(name, notes)
    holds = not start.hangs and must_hold(proposal, start, mechanics.pull, mechanics.largest_gravity, notes)
    by_user, own = f"{name}.dynamics" in inputs.asked, name in inputs.sprung
    stated = by_user or own
    handled = (
        as_light_as_stated(handled) if stated else caught_where_it_drops(handled, start.range, mechanics.pull, settings)
    )
    handled = as_asked(name, handled, mechanics.pull.force, notes)
    kind = standing_part(handled) if mechanics.bears_most else handled
    held_by = held_where_left(proposal, start, mechanics, kind, holds, settings)
    rest = spring_rest(proposal, start, inputs.scale)
    moved = joint_load(start, mechanics, rest, held_by.friction, handled.lever)
    by = Source.USER if by_user else inputs.source
    terms = felt_terms(proposal, moved, start, handled, holds, by, settings, notes, own)
    stiffness, reference = terms.stiffness, terms.spring_reference
    shuts = float(held_by.balance.at(start.range.closed))
    bias = held_by.balance.strut or mechanism_bias(start, handled, held_by.friction, settings, shuts)
    pressed = None if bias is not None or stated else pressed_shut(start, handled, rest, stiffness.value, settings)
    bias, friction = bias or pressed, terms.friction
    if pressed is not None:
        friction = Term(max(friction.value, PRESSED_RUB * max(pressed.most, -pressed.least)), Source.RULE)
    if held_by.balance.stiffness > 0.0:
        stiffness, reference = Term(held_by.balance.stiffness, Source.RULE), held_by.balance.reference
        rest = reference
    report_changes(name, moved, terms, holds, notes)
    report_holding(name, held_by, handled, moved.prismatic, notes)
    joint, span = start.range.joint, start.range
    made = JointPhysics(
        name=name,
        type=joint.type,
        label=inputs.features.link(joint.child).label,
        damping=terms.damping.value,
        damping_source=terms.damping.source,
        friction=friction.value,
        friction_source=friction.source,
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
        gravity_load=moved.pull.force,
        holds=holds,
        least_inertia=moved.least,
        asked_position=start.asked,
        effort_range=handled.judged or handled.range,
        armature=max(
            terms.armature,
            friction_armature(friction.value, mechanics.least, span.span, settings),
            bias_armature(bias, mechanics.least, span.span, settings),
        ),
        mimic=mimics_of(inputs.tree).get(name),
        exact=f"initial_joint_positions.{name}" in inputs.asked,
        mechanism=handled.mechanism if bias is None else bias.kind,
        bias=bias,
    )
    report_plain_spring(made, settings, notes)
    report_effort(made, joint.effort, settings, notes)
    return made, rest


def omitted_joint(name: str, notes: Notes) -> JointProposal:
    """The proposal for a joint that the overlay leaves out."""
    notes.info("joint_completed", f"joint '{name}': the overlay omits it; dynamics from time constants", joint=name)
    return JointProposal(name=name)


def spring_rest(proposal: JointProposal, start: Start, scale: float) -> float:
    """Where a spring brings a joint, within its limits: as proposed, else where it starts; rad or m."""
    wanted = start.position
    if proposal.spring_rest is not None:
        wanted = without_whole_turns(
            start.range, proposal.spring_rest * (scale if start.range.joint.prismatic else 1.0)
        )
    return start.range.clamp(wanted)


def joint_load(start: Start, mechanics: JointMechanics, rest: float, hold_friction: float, lever: float) -> JointLoad:
    """Load of a joint within its range, for the terms that are derived from it."""
    span = start.range
    return JointLoad(
        prismatic=span.joint.prismatic,
        inertia=mechanics.inertia,
        least=mechanics.least,
        held=mechanics.held,
        pull=mechanics.pull,
        lower=span.lower,
        upper=span.upper,
        closed=span.closed,
        open=span.open,
        rest=rest,
        hold_friction=hold_friction,
        reach=lever,
    )


def felt_terms(
    proposal: JointProposal,
    moved: JointLoad,
    start: Start,
    kind: Handling,
    holds: bool,
    source: Source,
    settings: PhysicsSettings,
    notes: Notes,
    kept_spring: bool = False,
) -> JointTerms:
    """Damping, friction and stiffness, with a press that a hand feels where the proposal's spring has none."""
    stated = start.range.joint.damping
    terms_of = partial(
        joint_terms, moved=moved, holds=holds, authored_damping=stated, settings=settings, kept_spring=kept_spring
    )
    proposal = bounded_press(proposal, kind, moved.far, settings, notes)
    terms = terms_of(proposal, source=source)
    if source is Source.USER or kept_spring or settings.dynamics is DynamicsRule.PAPER:
        return terms
    felt = felt_press(proposal, kind, terms, moved, notes)
    if felt is None:
        return terms
    return terms_of(bounded_press(felt, kind, moved.far, settings, notes), source=Source.RULE)


def held_where_left(
    proposal: JointProposal,
    start: Start,
    mechanics: JointMechanics,
    kind: Handling,
    holds: bool,
    settings: PhysicsSettings,
) -> Holding:
    """Holding of a joint that must stay where it is placed, or that is asked to stand near its balance though it moves
    freely: there the friction that this takes is small."""
    sprung = is_sprung(proposal)
    pull, largest = mechanics.pull, mechanics.largest_gravity
    stays = holds or (start.asked is not None and abs(pull.force) <= settings.free_hold_share * largest)
    if settings.dynamics is DynamicsRule.PAPER or (sprung and not holds):
        return Holding()
    if start.hangs:
        bump = settings.free_bump_share * largest
        return Holding(bump, bump)
    if is_bistable(start.range, kind):
        return Holding(SNAP_FRICTION * kind.least_effort, SNAP_FRICTION * kind.least_effort)
    lifted = None if sprung else strut(start, pull, kind, holds or stays, settings)
    if not (holds or stays):
        felt = felt_friction(kind, pull.force)
        return Holding(felt, felt, NO_BALANCE if lifted is None else Balance(strut=lifted))
    balance = NO_BALANCE if sprung else counterbalance(start, pull, kind, mechanics.least, settings)
    balance = balance if lifted is None else Balance(strut=lifted)
    # Springs leave a door's weight to a light friction: a bump of a quarter of it is not the hinges' to bear.
    bump = settings.bump_share if holds and balance.stiffness == 0.0 else settings.free_bump_share
    low = proposal.damping_level in LOW_LEVELS
    if start.range.joint.prismatic and abs(pull.force) <= UPRIGHT * largest:
        bump = min(bump, settings.free_bump_share if low else settings.level_bump_share)
    elif not kind.anywhere and math.hypot(pull.force, pull.slope) <= UPRIGHT * largest:
        swings = settings.default_friction_rad_s2 * mechanics.held / largest if largest > 0.0 else 0.0
        bump = min(bump, settings.upright_bump_share, swings)
    margin = settings.anywhere_hold_margin if kind.anywhere else settings.hold_margin
    margin = settings.least_hold_margin if low else margin
    return holding(start, pull, largest, kind, balance, bump_share=bump, margin=margin, settings=settings)
