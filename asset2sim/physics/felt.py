"""A spring from the force that a finger, hand or foot feels: where the part starts to move, and at its far end."""

import math
from dataclasses import dataclass

from asset2sim.physics.terms import UNLIMITED_FAR, JointLoad, Term
from schemas.overlay import JointPhysics, JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source

START_SHARE = 0.7
"""Force at the start over that at the end where only one is stated: coil springs and rubber domes of small controls are
preloaded to about two thirds, and a flat curve is what a key feels like."""
QUICK_S = 0.2
"""Time to return, s, up to which the felt spring itself meets the wish: it brings its part back within 0.1 s."""
LEAST_PRESS_N = 1e-6
"""Force at a part, N, below which it is not pressed at all: no finger feels a ten-thousandth of a gram."""
LEAST_RISE = 0.1
"""Least rise of the spring's force over its travel, as a share of the force at the start: without one it has no end."""


SWING_FRICTION = 0.2
"""Dry friction of a spring without a stop behind its rest, as a share of its force at the end: each swing past the rest
is two fifths of the travel smaller than the one before."""
HYSTERESIS = 0.4
"""Most dry friction beside a spring, as a share of its force at the start, where no armature bears all of that: a dome
of a button lets go at about half of the force that presses it."""


@dataclass(frozen=True)
class FeltSpring:
    """Stiffness (N·m/rad or N/m), relaxed position (rad or m), the armature (kg·m² or kg) that the step needs, and the
    dry friction (N·m or N) without which the part would swing."""

    stiffness: Term
    reference: float
    armature: float
    friction: float = 0.0


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
    the part. Without a stop there nothing preloads it, and dry friction keeps the armature from swinging. Forces whose
    armature would exceed ``max_armature_ratio`` are lowered together, and what the start lacks then is dry friction,
    which a hundredth of that armature bears.
    """
    forces = press_forces(proposal)
    if forces is None or max(forces) < LEAST_PRESS_N or moved.far == 0.0:
        return None
    start, end = (force * moved.reach for force in forces)
    outward, way, step = math.copysign(1.0, moved.far), abs(moved.far), settings.coarse_timestep_s
    at_rest, at_end = (outward * float(moved.pull.at(position)) for position in (moved.rest, moved.rest + moved.far))
    preload = max(start + at_rest, 0.0) if moved.backed else at_rest
    wanted = max(end + at_end - preload, LEAST_RISE * max(start, end)) / way
    needed = max(wanted * step**2 / settings.max_stiffness_step, preload * step**2 / (settings.max_press_step * way))
    most = (1.0 + settings.max_armature_ratio) * moved.least
    share = min(1.0, most / needed)
    stiffness = Term(wanted, source) if share == 1.0 else Term(share * wanted, Source.RULE, wanted)
    armature = max(0.0, share * needed - moved.least)
    if moved.backed:
        lacks = min(1.0 - share, HYSTERESIS * share) * preload
        return FeltSpring(stiffness, moved.rest - outward * preload / wanted, armature, lacks)
    friction = SWING_FRICTION * share * end if armature > 0.0 else 0.0
    return FeltSpring(stiffness, moved.rest - outward * at_rest / stiffness.value, armature, friction)


def effort_limit(stated: float | None, joint: JointPhysics, settings: PhysicsSettings) -> float:
    """The effort limit of a joint, N·m or N: that of its file, unless it does not move the joint against its friction,
    its load and its mechanism, which an author's weak motor had not to; else several times what does."""
    bias = 0.0 if joint.bias is None else max(joint.bias.most, -joint.bias.least)
    resists = joint.friction + abs(joint.gravity_load) + bias
    if stated and stated > resists:
        return stated
    return max(0.0 if stated else settings.default_effort, settings.effort_margin * resists)


def plain_spring(joint: JointPhysics, settings: PhysicsSettings) -> tuple[float, float]:
    """Stiffness (N·m/rad or N/m) and relaxed position (rad or m) of the spring that a joint has in a file that holds no
    armature: its own, or one lighter in proportion that its part alone bears at ``plain_timestep_s``; no spring where
    that would not outweigh the part."""
    if joint.armature <= 0.0 or joint.stiffness <= 0.0:
        return joint.stiffness, joint.spring_reference
    lower, upper = joint.initial_position - UNLIMITED_FAR, joint.initial_position + UNLIMITED_FAR
    ends = (lower if joint.lower is None else joint.lower, upper if joint.upper is None else joint.upper)
    travel = abs(ends[1] - ends[0])
    most = joint.stiffness * max(abs(joint.spring_reference - end) for end in ends)
    per_step = (joint.least_inertia or joint.effective_inertia) / settings.plain_timestep_s**2
    bears = (
        settings.max_stiffness_step * per_step / joint.stiffness,
        settings.plain_press_step * travel * per_step / most,
    )
    share = min(1.0, *bears)
    at_rest = share * joint.stiffness * abs(joint.spring_reference - joint.initial_position)
    if share < 1.0 and at_rest < settings.preload_margin * abs(joint.gravity_load):
        return 0.0, joint.spring_reference
    return share * joint.stiffness, joint.spring_reference
