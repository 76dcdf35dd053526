"""Columns of the table that holds how well each asset is what its user asked for."""

from schemas.table import ASSET_COLUMNS, FLAG, REAL, TEXT, Column

ALIGNMENTS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("alignment!", REAL, "1", "Prompt alignment, 0 to 1: half for scale, half for the articulated state"),
    ("scale_score!", REAL, "1", "Credit for the scale, 0 to 1"),
    ("scale_reason!", TEXT, "", "Why, in a sentence"),
    ("state_score!", REAL, "1", "Credit for the articulated state, 0 to 1"),
    ("state_reason!", TEXT, "", "Why, in a sentence"),
    ("judged", REAL, "1", "A vision model's score of the whole, 0 to 1; null where none was asked or it failed"),
    ("judged_reason", TEXT, "", "Its reasons; null likewise"),
    ("scale_deviation", REAL, "1", "|s − s_ref| / s_ref of the expert reference; null without one"),
    ("reference_states_scale!", FLAG, "", "Whether the expert states a scale, rather than the reference's loader"),
    ("joint_deviation_rad", REAL, "rad", "|q − q_ref| of the joint of interest, a hinge; null for sliders"),
    ("joint_deviation_m", REAL, "m", "|q − q_ref| of the joint of interest, a slider, at the final scale; else null"),
)
