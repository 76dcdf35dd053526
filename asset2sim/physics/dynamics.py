"""Damping, friction and stiffness of one joint, from what it moves and how it should feel, bounded by the time step.

Absolute numbers mean nothing across objects: 0.15 N·m·s/rad stops a door and blows up a key (design.md). So terms are
derived from the inertia that moves and from times and distances, and whatever a model states in absolute terms is
bounded by them.
"""

import math

from asset2sim.physics.felt import FeltSpring, felt_spring
from asset2sim.physics.paper_ranges import paper_terms
from asset2sim.physics.terms import JointLoad, JointTerms, Term, UnmetWish
from asset2sim.physics.timing import (
    RETURN_CRITICAL,
    Brake,
    closing_brake,
    gliding_brake,
    largest_damping,
    relaxed_position,
    timed_return,
)
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import DynamicsRule, Source

WEAKEST_HZ = 0.01
"""Frequency below which a proposed spring is ignored, Hz: it would take half a minute to return its part."""
RETURN_MARGIN = 1.1
"""Preload over gravity's pull of a part whose return is timed: with more, a light part returns at any stiffness."""
UnmetWishes = tuple[UnmetWish, ...]
HOLDS_REASON = "it must stay where it is placed"
"""Why a part that must hold neither falls shut nor springs back."""
CLOSE_ENOUGH = 0.25
"""Share by which a time or distance may miss what was asked before that is reported."""


def joint_terms(
    proposal: JointProposal,
    moved: JointLoad,
    *,
    holds: bool,
    source: Source,
    authored_damping: float | None,
    settings: PhysicsSettings,
    kept_spring: bool = False,
) -> JointTerms:
    """Damping, friction and stiffness of one joint, by the rule that the settings name. A spring that is its file's own
    (``kept_spring``) has an armature where its part does not bear it alone."""
    if settings.dynamics is DynamicsRule.PAPER:
        return paper_terms(proposal, prismatic=moved.prismatic, holds=holds, rest=moved.rest, source=source)
    felt = felt_spring(proposal, moved, source, settings)
    stiffness, heavy = borne_spring(felt, proposal, moved, source, settings, kept_spring)
    damping = damper(proposal, moved, stiffness.value, source, authored_damping, settings, heavy)
    friction = dry_friction(proposal, moved, holds, stiffness.value, source, settings)
    if felt is not None:
        if felt.friction > friction.value and proposal.friction is None:
            friction = Term(felt.friction, Source.RULE)
        return JointTerms(damping, friction, stiffness, felt.reference, armature=felt.armature)
    margin, brake = settings.preload_margin, None
    unmet: UnmetWishes = ()
    # Damping that is stated outright counts before any wish.
    if stiffness.value > 0.0 and proposal.returns_s is not None and proposal.damping is None:
        margin = RETURN_MARGIN
        stiffness, brake, unmet = timed_spring(proposal, moved, holds, stiffness, margin, settings)
    elif stiffness.value == 0.0 and proposal.damping is None:
        brake, unmet = timed_brake(proposal, moved, holds, settings)
    if brake is not None:
        where = Source.RULE if unmet else source
        damping = Term(brake.damping, where)
        if proposal.friction is None:
            friction = Term(brake.friction, where)
        elif brake.friction != proposal.friction:
            friction = Term(brake.friction, Source.RULE, proposal.friction)
    reference = moved.rest
    if stiffness.value > 0.0:
        # Real springs are preloaded against their stop: without it a key sags by g / ω² under its own weight. Where
        # nothing stops the part, the spring carries just its weight at rest.
        reference = float(relaxed_position(moved, stiffness.value, margin if moved.stopped else 1.0))
    return JointTerms(damping, friction, stiffness, reference, unmet, heavy)


def borne_spring(
    felt: FeltSpring | None,
    proposal: JointProposal,
    moved: JointLoad,
    source: Source,
    settings: PhysicsSettings,
    kept: bool,
) -> tuple[Term, float]:
    """The spring of a joint, and the armature (kg·m² or kg) with which the time step bears one that is ``felt``, or
    ``kept`` as its file has it: softer where that would exceed ``max_armature_ratio``."""
    if felt is not None:
        return felt.stiffness, felt.armature
    bounded = spring(proposal, moved, source, settings)
    if not kept or bounded.replaced is None or bounded.value == 0.0:
        return bounded, 0.0
    needed = bounded.replaced * settings.coarse_timestep_s**2 / settings.max_stiffness_step
    share = min(1.0, (1.0 + settings.max_armature_ratio) * moved.least / needed)
    term = Term(share * bounded.replaced, Source.RULE, bounded.replaced)
    return Term(bounded.replaced, source) if share == 1.0 else term, max(0.0, share * needed - moved.least)


def timed_spring(
    proposal: JointProposal, moved: JointLoad, holds: bool, stiffness: Term, margin: float, settings: PhysicsSettings
) -> tuple[Term, Brake | None, UnmetWishes]:
    """Stiffness, damping and friction of a part that returns in ``returns_s``, and the wish where it cannot be met."""
    asked = proposal.returns_s or 0.0
    if holds:
        return stiffness, None, (UnmetWish("returns_s", asked, None, HOLDS_REASON),)
    found, brake = timed_return(proposal, moved, stiffness.value, margin if moved.stopped else 1.0, settings)
    if found != stiffness.value:
        stiffness = Term(found, stiffness.source, stiffness.replaced)
    why = "its weight, its spring and the time step give that"
    return stiffness, brake, unmet_wish(brake, "returns_s", asked, why)


def timed_brake(
    proposal: JointProposal, moved: JointLoad, holds: bool, settings: PhysicsSettings
) -> tuple[Brake | None, UnmetWishes]:
    """Damping and friction of a part without a spring, from ``closes_s`` or ``stops_within``, and unmet wishes.
    ``closes_s`` counts where gravity may shut the part, else ``stops_within``; None where neither applies."""
    missed: UnmetWishes = ()
    if proposal.closes_s is not None:
        fall = None if holds else closing_brake(proposal, moved, settings)
        if fall is not None:
            why = "its weight, and the damping that the time step bears, give that"
            return fall, unmet_wish(fall, "closes_s", proposal.closes_s, why)
        why = HOLDS_REASON if holds else "gravity does not shut it"
        missed = (UnmetWish("closes_s", proposal.closes_s, None, why),)
    if proposal.stops_within is not None:
        found = gliding_brake(proposal, moved, holds, settings)
        return found, missed + unmet_wish(found, "stops_within", proposal.stops_within, "its friction gives that")
    return None, missed


def unmet_wish(found: Brake, wish: str, asked: float, why: str) -> tuple[UnmetWish, ...]:
    """The wish if the motion misses it by more than ``CLOSE_ENOUGH``; a shorter stop meets ``stops_within``."""
    long, short = found.achieved > (1.0 + CLOSE_ENOUGH) * asked, found.achieved < (1.0 - CLOSE_ENOUGH) * asked
    if long or (short and wish != "stops_within"):
        return (UnmetWish(wish, asked, found.achieved if math.isfinite(found.achieved) else None, why),)
    return ()


def spring(proposal: JointProposal, moved: JointLoad, source: Source, settings: PhysicsSettings) -> Term:
    """Stiffness k = (2π f)² I, at most ``max_stiffness_step`` I / Δt²; 0 for a passive joint. A time to return gives
    that of a critically damped spring, ω = 3.89 / t."""
    largest = settings.max_stiffness_step * moved.least / settings.coarse_timestep_s**2
    if proposal.stiffness is not None and proposal.stiffness > 0.0:
        wanted = proposal.stiffness
        if wanted <= (2.0 * math.pi * WEAKEST_HZ) ** 2 * moved.inertia:
            return Term(0.0, Source.RULE, wanted)
    elif proposal.returns_s is not None and proposal.stiffness is None:
        fastest = 2.0 * math.pi * settings.max_spring_hz
        wanted = min(RETURN_CRITICAL / proposal.returns_s, fastest) ** 2 * moved.held
        if wanted <= (2.0 * math.pi * WEAKEST_HZ) ** 2 * moved.held:
            return Term(0.0, Source.RULE, wanted)
    elif proposal.spring_hz is not None:
        wanted = (2.0 * math.pi * min(proposal.spring_hz, settings.max_spring_hz)) ** 2 * moved.inertia
    else:
        return Term(0.0, source if proposal.stiffness is not None else Source.RULE)
    return Term(wanted, source) if wanted <= largest else Term(largest, Source.RULE, wanted)


def damper(
    proposal: JointProposal,
    moved: JointLoad,
    stiffness: float,
    source: Source,
    authored: float | None,
    settings: PhysicsSettings,
    armature: float = 0.0,
) -> Term:
    """Damping c = I / τ, at least what keeps a spring from ringing, at most ``max_damping_step`` I / Δt.

    The bound is from the part's own inertia even where it has an armature: URDF has no field for an armature, and
    engines that read it apply the damping without one. A part with an armature rests on a stop, which takes its speed.
    """
    largest = largest_damping(moved, settings)
    if proposal.damping is not None:
        wanted, where = proposal.damping, source
    elif proposal.coast_s is not None:
        wanted, where = moved.inertia / proposal.coast_s, source
    elif authored:
        wanted, where = authored, Source.AUTHORED
    else:
        wanted, where = moved.inertia / settings.default_coast_s, Source.RULE
    least = 2.0 * settings.spring_damping_ratio * math.sqrt(stiffness * (moved.inertia + armature))
    bounded = min(max(wanted, least), largest)
    if armature > 0.0 and proposal.damping is None:
        return Term(bounded, Source.RULE)
    return Term(wanted, where) if bounded == wanted else Term(bounded, Source.RULE, wanted)


def dry_friction(
    proposal: JointProposal, moved: JointLoad, holds: bool, stiffness: float, source: Source, settings: PhysicsSettings
) -> Term:
    """Coulomb friction: as proposed, or what stops a slow motion; for a joint that holds, more than gravity's pull."""
    if proposal.friction is not None:
        wanted, where = proposal.friction, source
    elif stiffness > 0.0:
        wanted, where = 0.0, Source.RULE
    else:
        slow = settings.default_friction_m_s2 if moved.prismatic else settings.default_friction_rad_s2
        share = settings.free_friction_share if proposal.holds is False else 1.0
        wanted, where = share * slow * moved.inertia, Source.RULE
    needed = moved.hold_friction
    return Term(wanted, where) if wanted >= needed else Term(needed, Source.RULE, wanted)
