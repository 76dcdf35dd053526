"""Where a record's joints are in the end, in the coordinates of the asset as authored."""

from schemas.asset import AssetRecord
from schemas.overlay import JointPhysics, PhysicsOverlay


def initial_positions(record: AssetRecord) -> dict[str, float]:
    """Joint name → where it starts, rad or m at the final scale, counted from the authored zero; {} without overlay.

    A baked overlay counts from the state that it holds: its closed ends say how far that is from the authored zero.
    """
    overlay = record.overlay
    if overlay is None:
        return {}
    shifts = _shifts(record, overlay) if all(joint.initial_position == 0.0 for joint in overlay.joints) else {}
    return {joint.name: joint.initial_position + shifts.get(joint.name, 0.0) for joint in overlay.joints}


def final_positions(record: AssetRecord) -> dict[str, float]:
    """Joint name → where it was when it had settled untouched and the test was over; where nobody measured, the start.

    A simulation that left the finite numbers says nothing of where a joint is.
    """
    positions = initial_positions(record)
    measured = record.measurement
    if measured is not None and measured.finite:
        positions |= {motion.name: motion.final_position for motion in measured.joints if motion.name in positions}
    return positions


def _shifts(record: AssetRecord, overlay: PhysicsOverlay) -> dict[str, float]:
    authored = {joint.name: joint for joint in record.features.joints} if record.features is not None else {}
    return {
        joint.name: _at_final_scale(authored[joint.name].closed or 0.0, joint, overlay.scale) - joint.closed
        for joint in overlay.joints
        if joint.name in authored
    }


def _at_final_scale(position: float, joint: JointPhysics, scale: float) -> float:
    return position * scale if joint.type == "prismatic" else position
