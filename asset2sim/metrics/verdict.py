"""The verdict on a measurement: a pure function of the record and the thresholds."""

from dataclasses import dataclass

from schemas.measurement import JointMotion, Measurement
from schemas.settings import Thresholds
from schemas.vocabulary import FailureMode


@dataclass(frozen=True)
class Verdict:
    """What failed, or ``none``; ``reason`` says it with the numbers, ``value`` and ``limit`` are what was compared."""

    mode: FailureMode
    reason: str
    value: float | None = None
    limit: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the asset is interaction-ready by these thresholds."""
        return self.mode is FailureMode.NONE


def oscillates(motion: JointMotion, prismatic: bool, thresholds: Thresholds) -> bool:
    """Whether one joint oscillated: enough reversals, with enough amplitude to be seen."""
    bound = thresholds.oscillation_m if prismatic else thresholds.oscillation_rad
    return motion.sign_changes >= thresholds.oscillation_sign_changes and motion.amplitude > bound


def oscillating_joints(measurement: Measurement, prismatic: frozenset[str], thresholds: Thresholds) -> tuple[str, ...]:
    """The names of the joints that oscillated; ``prismatic`` names those whose positions are metres."""
    return tuple(m.name for m in measurement.joints if oscillates(m, m.name in prismatic, thresholds))


def judge(measurement: Measurement, prismatic: frozenset[str], thresholds: Thresholds) -> Verdict:
    """The first thing that fails, in order: engine, penetration, drift, oscillation; else ``none``."""
    if not measurement.finite or measurement.peak_speed_m_s > thresholds.peak_speed_m_s:
        speed = measurement.peak_speed_m_s
        return Verdict(
            FailureMode.DRIFT,
            f"it explodes in {measurement.engine}: a link reaches {speed:.3g} m/s",
            speed,
            thresholds.peak_speed_m_s,
        )
    if measurement.penetration_m > thresholds.penetration_m:
        worst = measurement.pairs[0] if measurement.pairs else None
        where = "" if worst is None else f", worst between '{worst.link_a}' and '{worst.link_b}'"
        return Verdict(
            FailureMode.PENETRATION,
            f"links overlap by {1e3 * measurement.penetration_m:.3g} mm in the initial state{where}",
            measurement.penetration_m,
            thresholds.penetration_m,
        )
    for value, limit, unit in (
        (measurement.drift_m, thresholds.drift_m, "m"),
        (measurement.drift_rad, thresholds.drift_rad, "rad"),
    ):
        if value > limit:
            return Verdict(FailureMode.DRIFT, f"the root drifts {value:.3g} {unit} untouched", value, limit)
    names = oscillating_joints(measurement, prismatic, thresholds)
    if names:
        motion = next(m for m in measurement.joints if m.name == names[0])
        return Verdict(
            FailureMode.OSCILLATION,
            f"joint '{motion.name}' oscillates untouched: {motion.sign_changes} reversals over {motion.amplitude:.3g}",
            motion.amplitude,
            thresholds.oscillation_m if motion.name in prismatic else thresholds.oscillation_rad,
        )
    return Verdict(FailureMode.NONE, "interaction-ready")
