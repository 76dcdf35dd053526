"""Mend joint dynamics where an asset drifts or oscillates untouched: more damping, more friction, measured
again each time."""

from collections.abc import Callable
from dataclasses import dataclass

from asset2sim.metrics.verdict import judge, oscillating_joints
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.features import Features
from schemas.finding import Finding
from schemas.measurement import Measurement
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import Settings
from schemas.trace import TraceStep
from schemas.vocabulary import FailureMode, Severity, Source, Stage

MOVES = 1e-4
"""Amplitude over the test, rad or m, from which a joint counts as moving untouched."""

Remeasure = Callable[[PhysicsOverlay], Measurement]
"""Writes the overlay and measures the asset again."""


@dataclass(frozen=True)
class Mended:
    """The overlay that measured best and its measurement, with the steps taken."""

    overlay: PhysicsOverlay
    measurement: Measurement
    trace: tuple[TraceStep, ...]
    findings: tuple[Finding, ...]


def mend_dynamics(
    features: Features, overlay: PhysicsOverlay, measurement: Measurement, settings: Settings, remeasure: Remeasure
) -> Mended:
    """Raise damping and friction of the joints that move untouched, until nothing fails or the rounds are over.

    Each round goes further than the last; the overlay that measures best is kept, and is the one that stays written.
    """
    trace: list[TraceStep] = []
    sliders = frozenset(joint.name for joint in overlay.joints if joint.type == "prismatic")
    best, seen, candidate = overlay, measurement, overlay
    lowest = badness(measurement, sliders, settings)
    for round_number in range(settings.search.mend_rounds):
        verdict = judge(seen, sliders, settings.thresholds)
        moving = [motion.name for motion in seen.joints if motion.amplitude > MOVES]
        if verdict.mode not in (FailureMode.DRIFT, FailureMode.OSCILLATION) or not moving:
            break
        candidate = firmer(features, candidate, moving, settings)
        seen = remeasure(candidate)
        found = badness(seen, sliders, settings)
        trace.append(
            TraceStep(
                step=round_number,
                proposer="dynamics",
                phi_before_m=measurement.penetration_m,
                phi_after_m=seen.penetration_m,
                moved={},
                accepted=found < lowest,
                evaluations=1,
                reason=f"{verdict.reason}: damping and friction of {len(moving)} moving joints raised",
            )
        )
        if found < lowest:
            best, measurement, lowest = candidate, seen, found
    if candidate is not best:
        remeasure(best)
    return Mended(best, measurement, tuple(trace), tuple(raised(overlay, best)))


def raised(before: PhysicsOverlay, after: PhysicsOverlay) -> list[Finding]:
    """A finding for every joint whose terms were raised."""
    return [
        Finding(
            stage=Stage.REFINE,
            severity=Severity.INFO,
            code="dynamics_raised",
            message=f"joint '{new.name}': damping raised from {old.damping:.3g} to {new.damping:.3g} and friction from "
            f"{old.friction:.3g} to {new.friction:.3g}, because it moved untouched",
            joint=new.name,
            value=new.damping,
            limit=old.damping,
        )
        for old, new in zip(before.joints, after.joints, strict=True)
        if (old.damping, old.friction) != (new.damping, new.friction)
    ]


def badness(measurement: Measurement, sliders: frozenset[str], settings: Settings) -> tuple[bool, int, float]:
    """How bad a measurement is, in order: whether it fails, how many joints oscillate, drift over its bounds."""
    limits = settings.thresholds
    drift = max(measurement.drift_m / limits.drift_m, measurement.drift_rad / limits.drift_rad)
    fails = not judge(measurement, sliders, limits).passed
    return fails, len(oscillating_joints(measurement, sliders, limits)), drift


def firmer(features: Features, overlay: PhysicsOverlay, names: list[str], settings: Settings) -> PhysicsOverlay:
    """The overlay with more damping and friction on these joints, damping within what the time step bears."""
    physics, search = settings.physics, settings.search
    weight = overlay.mass_kg * GRAVITY_M_S2
    joints: list[JointPhysics] = []
    for joint in overlay.joints:
        if joint.name in names:
            largest = physics.max_damping_step * joint.effective_inertia / physics.coarse_timestep_s
            size = max(features.link(features.joint(joint.name).child).box_size) * overlay.scale
            lever = 1.0 if joint.type == "prismatic" else size / 2.0
            resistance = search.rolling_resistance * weight * lever / len(names)
            changes: dict[str, object] = {
                "damping": max(min(search.mend_factor * joint.damping, largest), joint.damping),
                "damping_source": Source.SEARCH,
            }
            # A spring must be able to bring its part back: friction would hold it anywhere.
            if joint.stiffness == 0.0:
                changes |= {
                    "friction": max(search.mend_factor * joint.friction, resistance),
                    "friction_source": Source.SEARCH,
                }
            joint = joint.model_copy(update=changes)
        joints.append(joint)
    return overlay.model_copy(update={"joints": tuple(joints)})
