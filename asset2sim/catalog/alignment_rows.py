"""Rows of how well each asset is what its user asked for."""

from schemas.asset import AssetRecord

Row = dict[str, object]


def alignment_rows(key: Row, record: AssetRecord) -> list[Row]:
    """The row of ``alignment``, none where the record has none; ``key`` holds the columns that every row begins
    with."""
    found = record.alignment
    if found is None:
        return []
    slider = found.joint_is_slider
    return [
        key
        | {
            "alignment": found.value,
            "scale_score": found.scale.value,
            "scale_reason": found.scale.reason,
            "state_score": found.state.value,
            "state_reason": found.state.reason,
            "judged": found.judged.value if found.judged is not None else None,
            "judged_reason": found.judged.reason if found.judged is not None else None,
            "scale_deviation": found.scale_deviation,
            "reference_states_scale": found.reference_states_scale,
            "joint_deviation_rad": None if slider else found.joint_deviation,
            "joint_deviation_m": found.joint_deviation if slider else None,
        }
    ]
