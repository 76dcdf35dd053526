"""The paper's verdict on an object left alone: no overlap in its initial state, no drift, no oscillation."""

from asset2sim.checks.declared_check import DeclaredCheck
from schemas.interaction import JointMotion, Measurement
from schemas.settings import Thresholds
from schemas.verdict import Guide, Verdict
from schemas.vocabulary import FailureMode


def oscillates(motion: JointMotion, prismatic: bool, thresholds: Thresholds) -> bool:
    """Whether one joint oscillated: enough reversals, with enough amplitude to be seen."""
    bound = thresholds.oscillation_m if prismatic else thresholds.oscillation_rad
    return motion.sign_changes >= thresholds.oscillation_sign_changes and motion.amplitude > bound


def oscillating_joints(measurement: Measurement, prismatic: frozenset[str], thresholds: Thresholds) -> tuple[str, ...]:
    """The names of the joints that oscillated; ``prismatic`` names those whose positions are metres."""
    return tuple(m.name for m in measurement.joints if oscillates(m, m.name in prismatic, thresholds))


def measurement_verdict(measurement: Measurement, prismatic: frozenset[str], thresholds: Thresholds) -> Verdict:
    """The first failure in the order explosion, penetration, drift, oscillation; else ``none``."""
    if not measurement.finite or measurement.peak_speed_m_s > thresholds.peak_speed_m_s:
        speed = measurement.peak_speed_m_s
        reason = f"it explodes in {measurement.engine}: a link reaches {speed:.3g} m/s"
        return Verdict(FailureMode.DRIFT, reason, speed, thresholds.peak_speed_m_s)
    if measurement.penetration_m > thresholds.penetration_m:
        worst = measurement.pairs[0] if measurement.pairs else None
        where = "" if worst is None else f", worst between '{worst.link_a}' and '{worst.link_b}'"
        reason = f"links overlap by {1e3 * measurement.penetration_m:.3g} mm in the initial state{where}"
        return Verdict(FailureMode.PENETRATION, reason, measurement.penetration_m, thresholds.penetration_m)
    for value, limit, unit in (
        (measurement.drift_m, thresholds.drift_m, "m"),
        (measurement.drift_rad, thresholds.drift_rad, "rad"),
    ):
        if value > limit:
            return Verdict(FailureMode.DRIFT, f"the root drifts {value:.3g} {unit} untouched", value, limit)
    names = oscillating_joints(measurement, prismatic, thresholds)
    if names:
        motion = next(m for m in measurement.joints if m.name == names[0])
        over = motion.amplitude
        limit = thresholds.oscillation_m if motion.name in prismatic else thresholds.oscillation_rad
        reason = f"joint '{motion.name}' oscillates untouched: {motion.sign_changes} reversals over {over:.3g}"
        return Verdict(FailureMode.OSCILLATION, reason, over, limit)
    return Verdict(FailureMode.NONE, "interaction-ready")


CHECK = DeclaredCheck(
    name="rest",
    modes={
        FailureMode.PENETRATION: Guide(
            "Links overlap by more than 2 mm in the initial state, and no state, hull or cut near it frees them",
            "look at the pairs in `link_overlaps`: `authored` overlaps are in the meshes; ask for another state",
        ),
        FailureMode.DRIFT: Guide(
            "Left alone, the root moves over 1 mm or turns over 0.01 rad",
            "see which part touches the floor: a single point or a rounded base; `--support` if it is mounted or held",
        ),
        FailureMode.OSCILLATION: Guide(
            "Left alone, a joint keeps moving to and fro",
            "a spring or a hull that pushes: `trace` says what was tried; give the joint damping in the guidance",
        ),
    },
    done="left alone on a plane (the paper's)",
    holds="Φ ≤ 2 mm, drift ≤ 1 mm and 0.01 rad, no joint oscillates",
    bounds=(
        *("penetration_m", "drift_m", "drift_rad", "oscillation_sign_changes", "oscillation_rad", "oscillation_m"),
        "peak_speed_m_s",
    ),
    measure=None,
    judge=None,
    place=0,
    planted=("link shifted into its neighbour",),
)
