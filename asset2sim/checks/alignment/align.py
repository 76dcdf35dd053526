"""The alignment of one record: rubric, and distance from an expert's choice. Pure over the record."""

import math

from asset2sim.checks.alignment.rubric import score_scale, score_state
from asset2sim.checks.alignment.user_request import read_request
from schemas.alignment import Alignment, Reference
from schemas.asset import AssetRecord


def initial_positions(record: AssetRecord) -> dict[str, float]:
    """Joint name → where it starts, rad or m at the final scale, from the authored zero; {} without overlay."""
    return {} if record.overlay is None else record.overlay.initial_positions


def final_positions(record: AssetRecord) -> dict[str, float]:
    """Joint name → its position at the end of the rest check, else its initial one; units as ``initial_positions``. A
    simulation with non-finite numbers does not count as measured."""
    positions = initial_positions(record)
    measured = record.measurement
    if measured is not None and measured.finite:
        positions |= {motion.name: motion.final_position for motion in measured.joints if motion.name in positions}
    return positions


def align(record: AssetRecord) -> Alignment | None:
    """Alignment of an asset with its user's request; None for a record without an overlay.

    The rubric (paper, evaluation, section 2): half for scale, half for the articulated state, each 0 to 1, with partial
    credit for near. All its thresholds, with their reasons, are in ``Rubric``; the readings of a size that count are in
    ``score_scale``. *State* is where the joints are when the object has settled and the rest check is over, as a share
    of the way from closed to open; where it starts, if nothing was measured or the guidance wants something to move
    freely, which gravity then takes from its state.

    Deviations from the expert's reference are of the positions in which the asset starts, as the expert's.
    """
    overlay, features = record.overlay, record.features
    if overlay is None or features is None or record.guidance is None:
        return None
    reference = record.ref.reference
    request = read_request(features, record.guidance, overlay.scale, record.ref.overrides)
    positions = initial_positions(record) if request.free else final_positions(record)
    return Alignment(
        scale=score_scale(overlay.scale, features.rest_size, request.size, reference),
        state=score_state(positions, overlay.scale, features, request),
        **(_deviations(record, reference) if reference is not None else {}),
    )


def _deviations(record: AssetRecord, reference: Reference) -> dict[str, float | bool | None]:
    """|s − s_ref| / s_ref, and |q − q_ref|: angles modulo a turn, sliders in m at the final scale. A slider's reference
    is stated at the authored scale; at the asset's own it is that times the scale, so that a wrong scale is not counted
    twice."""
    assert record.overlay is not None
    scale = record.overlay.scale
    joint = next((joint for joint in record.overlay.all_joints if joint.name == reference.joint), None)
    slider = joint is not None and joint.type == "prismatic"
    off: float | None = None
    if joint is not None:
        gap = initial_positions(record)[joint.name] - reference.position * (scale if slider else 1.0)
        off = abs(gap if slider else math.remainder(gap, 2.0 * math.pi))
    return {
        "scale_deviation": abs(scale - reference.scale) / reference.scale,
        "reference_states_scale": reference.states_scale,
        "joint_deviation": off,
        "joint_is_slider": slider,
    }
