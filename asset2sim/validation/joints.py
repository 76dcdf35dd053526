"""Joint physics at the initial pose: effective inertia, gravity load, and the triplet derived from them."""

from collections.abc import Mapping, Sequence

import numpy as np

from asset2sim.kinematics import TreeJoint
from asset2sim.physics.dynamics import JointTerms, Term, joint_terms
from asset2sim.physics.mass_matrix import Body, JointSpace, joint_space
from asset2sim.validation.limits import Range
from asset2sim.validation.notes import Notes
from asset2sim.validation.positions import Start, turned
from schemas.features import Features
from schemas.overlay import JointPhysics, JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source

RANGE_SAMPLES = 5
"""Positions at which the gravity load of a joint that must hold anywhere is sampled; the load is a sine of the
angle."""
STOP_SHARE = 1e-3
"""Share of its range from a limit within which a joint is at its stop."""
HELD_STATE = 0.05
"""Share of its range beyond the closed end from which a requested state counts as open, and so must be held."""


def joint_physics(
    features: Features,
    tree: Sequence[TreeJoint],
    bodies: Mapping[str, Body],
    starts: Mapping[str, Start],
    proposals: Mapping[str, JointProposal],
    asked: frozenset[str],
    scale: float,
    source: Source,
    settings: PhysicsSettings,
    notes: Notes,
) -> tuple[JointPhysics, ...]:
    """Every movable joint, complete; ``tree`` and ``bodies`` are at the final scale."""
    at_start = {name: start.position for name, start in starts.items()}
    space = joint_space(tree, features.root, bodies, at_start)
    inertias, loads = space.effective_inertia(), dict(zip(space.names, space.gravity, strict=True))
    joints: list[JointPhysics] = []
    for name, start in starts.items():
        joint = start.range.joint
        proposal = proposals.get(name, JointProposal(name=name))
        if name not in proposals:
            notes.info(
                "joint_completed", f"joint '{name}': the overlay omits it; dynamics from time constants", joint=name
            )
        load = float(loads[name])
        anywhere = proposal.holds is True
        holds = anywhere or (proposal.holds is None and start.requested and is_open(start))
        hold_load = 0.0
        if holds:
            hold_load = worst_load(features, tree, bodies, at_start, start) if anywhere else abs(load)
        factor = scale if joint.prismatic else 1.0
        wanted = start.position if proposal.spring_rest is None else turned(start.range, proposal.spring_rest * factor)
        rest = start.range.clamp(wanted)
        where = Source.USER if f"{name}.dynamics" in asked else source
        terms = joint_terms(
            proposal,
            prismatic=joint.prismatic,
            inertia=inertias[name],
            load=load,
            hold_load=hold_load,
            holds=holds,
            rest=rest,
            stopped=stopped_at(start.range, rest, load),
            source=where,
            authored_damping=joint.damping,
            settings=settings,
        )
        report(name, joint.prismatic, inertias[name], terms, holds, notes)
        joints.append(
            JointPhysics(
                name=name,
                type=joint.type,
                label=features.link(joint.child).label,
                damping=terms.damping.value,
                damping_source=terms.damping.source,
                friction=terms.friction.value,
                friction_source=terms.friction.source,
                stiffness=terms.stiffness.value,
                stiffness_source=terms.stiffness.source,
                spring_reference=terms.spring_reference,
                lower=start.range.lower,
                upper=start.range.upper,
                limits_source=start.range.source,
                closed=start.range.closed,
                open=start.range.open,
                initial_position=start.position,
                position_source=start.source,
                effective_inertia=inertias[name],
                gravity_load=load,
                holds=holds,
            )
        )
    return bound_together(joints, space, settings, notes)


def stopped_at(span: Range, position: float, load: float) -> bool:
    """Whether the joint is at the limit towards which a spring against ``load`` (N·m or N) pushes it."""
    stop = span.upper if load < 0.0 else span.lower
    return stop is not None and abs(position - stop) <= STOP_SHARE * span.span


def is_open(start: Start) -> bool:
    """Whether a start lies away from the closed end, so that leaving it alone would be seen as motion."""
    return abs(start.position - start.range.closed) > HELD_STATE * start.range.span


def worst_load(
    features: Features,
    tree: Sequence[TreeJoint],
    bodies: Mapping[str, Body],
    positions: Mapping[str, float],
    start: Start,
) -> float:
    """The largest magnitude of gravity's pull on one joint over its range, the others where they start, N·m or N."""
    lower, upper = start.range.lower, start.range.upper
    if lower is None or upper is None:
        lower, upper = start.position - np.pi, start.position + np.pi
    name, largest = start.range.joint.name, 0.0
    for position in np.linspace(lower, upper, RANGE_SAMPLES):
        space = joint_space(tree, features.root, bodies, {**positions, name: float(position)})
        largest = max(largest, abs(float(space.gravity[space.names.index(name)])))
    return largest


def report(name: str, prismatic: bool, inertia: float, terms: JointTerms, holds: bool, notes: Notes) -> None:
    """A finding for every term that a bound changed."""
    units = ("N·s/m", "N", "N/m") if prismatic else ("N·m·s/rad", "N·m", "N·m/rad")
    why = {
        "damping": f"what its {inertia:.3g} {'kg' if prismatic else 'kg·m²'} bear at the time step, and a spring needs",
        "friction": "what holds it where it is placed" if holds else "its bound",
        "stiffness": f"what its {inertia:.3g} {'kg' if prismatic else 'kg·m²'} bear at the time step",
    }
    for kind, term, unit in zip(why, (terms.damping, terms.friction, terms.stiffness), units, strict=True):
        if changed(term):
            notes.info(
                f"{kind}_bounded",
                f"joint '{name}': {kind} {term.replaced:.3g} {unit} set to {term.value:.3g}: {why[kind]}",
                joint=name,
                value=term.replaced,
                limit=term.value,
            )


def changed(term: Term) -> bool:
    """Whether a bound replaced the term by something visibly different."""
    return term.replaced is not None and abs(term.replaced - term.value) > 1e-3 * max(abs(term.value), 1e-12)


def bound_together(
    joints: list[JointPhysics], space: JointSpace, settings: PhysicsSettings, notes: Notes
) -> tuple[JointPhysics, ...]:
    """Scale all damping down where the coupled joints decay faster together than each does alone.

    Explicit damping is stable while Δt times the largest eigenvalue of M⁻¹D is below 2; each joint was bounded by
    itself.
    """
    fastest = space.fastest_decay({joint.name: joint.damping for joint in joints})
    largest = 2.0 * settings.max_damping_step / settings.coarse_timestep_s
    if fastest <= largest:
        return tuple(joints)
    factor = largest / fastest
    notes.info(
        "damping_coupled",
        f"all joint damping scaled by {factor:.3g}: together the joints decay at {fastest:.3g} 1/s, more than the "
        "time step bears",
        value=fastest,
        limit=largest,
    )
    return tuple(
        joint.model_copy(update={"damping": joint.damping * factor, "damping_source": Source.RULE}) for joint in joints
    )
