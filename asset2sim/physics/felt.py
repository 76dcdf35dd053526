"""A spring from the force that a finger, hand or foot feels: where the part starts to move, and at its far end."""

import math
from dataclasses import dataclass

from asset2sim.physics.terms import JointLoad, Term
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source

START_SHARE = 0.7
"""Force at the start over that at the end where only one is stated: coil springs and rubber domes of small controls are
preloaded to about two thirds, and a flat curve is what a key feels like."""
QUICK_S = 0.2
"""Time to return, s, up to which the felt spring itself meets the wish: it brings its part back within 0.1 s."""
LEAST_RISE = 0.1
"""Least rise of the spring's force over its travel, as a share of the force at the start: without one it has no end."""


@dataclass(frozen=True)
class FeltSpring:
    """Stiffness (N·m/rad or N/m), relaxed position (rad or m), and the armature (kg·m² or kg) that the step needs."""

    stiffness: Term
    reference: float
    armature: float


def press_forces(proposal: JointProposal) -> tuple[float, float] | None:
    """Force at the start and at the end, N; None where the proposal states none, or a term that counts before them."""
    slow = proposal.returns_s is not None and proposal.returns_s > QUICK_S
    if proposal.stiffness is not None or slow:
        return None
    start, end = proposal.press_start, proposal.press_end
    if start is None:
        start = START_SHARE * end if end is not None else None
    if start is None:
        return None
    end = start / START_SHARE if end is None else max(end, start)
    return (start, end) if end > 0.0 else None


def felt_spring(
    proposal: JointProposal, moved: JointLoad, source: Source, settings: PhysicsSettings
) -> FeltSpring | None:
    """The spring that a press feels as proposed, gravity's pull on the part counted; None where no force is proposed.

    Stiffness is the rise of the force over the travel, and the preload the force at the start, against the stop behind
    the part. Without a stop there the force starts at zero, and the part's own inertia bounds the stiffness, since
    nothing would keep an armature from swinging.
    """
    forces = press_forces(proposal)
    if forces is None or moved.far == 0.0:
        return None
    start, end = (force * moved.reach for force in forces)
    outward, way, step = math.copysign(1.0, moved.far), abs(moved.far), settings.coarse_timestep_s
    at_rest, at_end = (outward * float(moved.pull.at(position)) for position in (moved.rest, moved.rest + moved.far))
    if not moved.backed:
        largest = settings.max_stiffness_step * moved.least / step**2
        wanted = max(end + at_end - at_rest, LEAST_RISE * end) / way
        stiffness = Term(wanted, source) if wanted <= largest else Term(largest, Source.RULE, wanted)
        return FeltSpring(stiffness, moved.rest - outward * at_rest / stiffness.value, 0.0)
    preload = max(start + at_rest, 0.0)
    wanted = max(end + at_end - preload, LEAST_RISE * max(start, end)) / way
    needed = max(wanted * step**2 / settings.max_stiffness_step, preload * step**2 / (settings.max_press_step * way))
    reference = moved.rest - outward * preload / wanted
    return FeltSpring(Term(wanted, source), reference, max(0.0, needed - moved.least))
