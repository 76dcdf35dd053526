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
    """Raise damping and friction of the joints that move untouched, as long as it helps and something fails.

    Accepted only where the asset then measures better; the last accepted overlay has been written.
    """
    trace: list[TraceStep] = []
    findings: list[Finding] = []
    sliders = frozenset(joint.name for joint in overlay.joints if joint.type == "prismatic")
    for round_number in range(settings.search.mend_rounds):
        verdict = judge(measurement, sliders, settings.thresholds)
        if verdict.mode not in (FailureMode.DRIFT, FailureMode.OSCILLATION):
            break
        moving = [motion.name for motion in measurement.joints if motion.amplitude > MOVES]
        if not moving:
            break
        stiffer = firmer(features, overlay, moving, settings)
        seen = remeasure(stiffer)
        better = badness(seen, sliders, settings) < badness(measurement, sliders, settings)
        trace.append(
            TraceStep(
                step=round_number,
                proposer="dynamics",
                phi_before_m=measurement.penetration_m,
                phi_after_m=seen.penetration_m,
                moved={},
                accepted=better,
                evaluations=1,
                reason=f"{verdict.reason}: damping and friction of {len(moving)} moving joints raised",
            )
        )
        if not better:
            remeasure(overlay)
            break
        findings = [
            Finding(
                stage=Stage.REFINE,
                severity=Severity.INFO,
                code="dynamics_raised",
                message=f"joint '{joint.name}': damping raised to {joint.damping:.3g} and friction to "
                f"{joint.friction:.3g}, because it moved untouched",
                joint=joint.name,
                value=joint.damping,
            )
            for joint in stiffer.joints
            if joint.name in moving
        ]
        overlay, measurement = stiffer, seen
    return Mended(overlay, measurement, tuple(trace), tuple(findings))


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
