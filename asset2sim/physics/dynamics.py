"""Damping, friction and stiffness of one joint, from what it moves and what a person should feel, bounded by the
time step.

Absolute numbers mean nothing across objects: 0.15 N·m·s/rad stops a door and blows up a key (design.md). So terms are
derived from the effective inertia and time constants, and whatever a model states in absolute terms is bounded by them.
"""

import math
from dataclasses import dataclass

from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source

WEAKEST_HZ = 0.01
"""Frequency below which a proposed spring is none, Hz: it would take half a minute to bring its part back."""


@dataclass(frozen=True)
class Term:
    """One number, where it came from, and the number it replaced if a bound changed it."""

    value: float
    source: Source
    replaced: float | None = None


@dataclass(frozen=True)
class JointTerms:
    """The triplet of one joint, and the position at which its spring is relaxed."""

    damping: Term
    friction: Term
    stiffness: Term
    spring_reference: float


def joint_terms(
    proposal: JointProposal,
    *,
    prismatic: bool,
    inertia: float,
    load: float,
    hold_load: float,
    holds: bool,
    rest: float,
    stopped: bool,
    source: Source,
    authored_damping: float | None,
    settings: PhysicsSettings,
) -> JointTerms:
    """The triplet of one joint.

    ``inertia`` is the effective one (kg·m² or kg), ``load`` gravity's signed pull at the initial position and
    ``hold_load`` its largest magnitude where the joint must hold (N·m or N), ``rest`` where a spring returns to and
    ``stopped`` whether a limit stops it from going further there, against gravity.
    """
    stiffness = spring(proposal, inertia, source, settings)
    damping = damper(proposal, inertia, stiffness.value, source, authored_damping, settings)
    friction = dry_friction(proposal, prismatic, inertia, hold_load, holds, stiffness.value, source, settings)
    reference = rest
    if stiffness.value > 0.0:
        # Real springs are preloaded against their stop: without it a key sags by g / ω² under its own weight. Where
        # nothing stops the part, the spring carries just its weight at rest.
        reference = rest - (settings.hold_margin if stopped else 1.0) * load / stiffness.value
    return JointTerms(damping, friction, stiffness, reference)


def spring(proposal: JointProposal, inertia: float, source: Source, settings: PhysicsSettings) -> Term:
    """Stiffness k = (2π f)² I, at most ``max_stiffness_step`` I / Δt²; 0 for a passive joint."""
    largest = settings.max_stiffness_step * inertia / settings.coarse_timestep_s**2
    if proposal.stiffness is not None and proposal.stiffness > 0.0:
        wanted = proposal.stiffness
        if wanted <= (2.0 * math.pi * WEAKEST_HZ) ** 2 * inertia:
            return Term(0.0, Source.RULE, wanted)
    elif proposal.spring_hz is not None:
        wanted = (2.0 * math.pi * min(proposal.spring_hz, settings.max_spring_hz)) ** 2 * inertia
    else:
        return Term(0.0, source if proposal.stiffness is not None else Source.RULE)
    return Term(wanted, source) if wanted <= largest else Term(largest, Source.RULE, wanted)


def damper(
    proposal: JointProposal,
    inertia: float,
    stiffness: float,
    source: Source,
    authored: float | None,
    settings: PhysicsSettings,
) -> Term:
    """Damping c = I / τ, at least what keeps a spring from ringing, at most ``max_damping_step`` I / Δt."""
    largest = settings.max_damping_step * inertia / settings.coarse_timestep_s
    if proposal.damping is not None:
        wanted, where = proposal.damping, source
    elif proposal.coast_s is not None:
        wanted, where = inertia / proposal.coast_s, source
    elif authored:
        wanted, where = authored, Source.AUTHORED
    else:
        wanted, where = inertia / settings.default_coast_s, Source.RULE
    least = 2.0 * settings.spring_damping_ratio * math.sqrt(stiffness * inertia)
    bounded = min(max(wanted, least), largest)
    return Term(wanted, where) if bounded == wanted else Term(bounded, Source.RULE, wanted)


def dry_friction(
    proposal: JointProposal,
    prismatic: bool,
    inertia: float,
    hold_load: float,
    holds: bool,
    stiffness: float,
    source: Source,
    settings: PhysicsSettings,
) -> Term:
    """Coulomb friction: as proposed, or what stops a slow motion; for a joint that holds, more than gravity's pull."""
    if proposal.friction is not None:
        wanted, where = proposal.friction, source
    elif stiffness > 0.0:
        wanted, where = 0.0, Source.RULE
    else:
        slow = settings.default_friction_m_s2 if prismatic else settings.default_friction_rad_s2
        share = settings.free_friction_share if proposal.holds is False else 1.0
        wanted, where = share * slow * inertia, Source.RULE
    needed = settings.hold_margin * hold_load if holds else 0.0
    return Term(wanted, where) if wanted >= needed else Term(needed, Source.RULE, wanted)
