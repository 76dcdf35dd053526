"""Columns of the tables of engine measurements, interaction checks, overlaps, alignment and refinement steps."""

from schemas.table import ASSET_COLUMNS, COUNT, FLAG, POSITION, REAL, REALS, TEXT, TEXTS, Column

MEASUREMENTS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("engine!", TEXT, "", "Simulator"),
    ("engine_version!", TEXT, "", "Its version"),
    ("passed!", FLAG, "", "Whether every test in this engine passed"),
    ("failure_mode!", TEXT, "", "The first test that failed in this engine, none where all passed"),
    ("reason!", TEXT, "", "The verdict in a sentence"),
    ("penetration_mm", REAL, "mm", "Φ at the initial position under the engine's default filter; null if not measured"),
    ("drift_m", REAL, "m", "Furthest the root moved over the test; null if not measured or not finite"),
    ("drift_rad", REAL, "rad", "Furthest the root turned over the test; null if not measured or not finite"),
    ("peak_speed_m_s", REAL, "m/s", "Fastest link over settling and test; null if not measured or not finite"),
    ("stand_tilt_rad", REAL, "rad", "Furthest it tilted from how it was set down; null if not measured"),
    ("stand_travel_m", REAL, "m", "Furthest its root travelled from where it was set down; null if not measured"),
    ("stand_speed_m_s", REAL, "m/s", "Fastest its root moved while it settled; null if not measured"),
    ("tip_margin_deg", REAL, "deg", "Angle by which it is turned when it tips over its nearest edge; null likewise"),
    ("tip_energy_j", REAL, "J", "What it takes to tip it over; null if not measured"),
    ("oscillating_joints", COUNT, "1", "Joints that fail the oscillation thresholds; null if not measured"),
    ("finite", FLAG, "", "Whether the simulation stayed finite; null if not measured"),
    ("timestep_s", REAL, "s", "Time step; null if not measured"),
    ("tests!", COUNT, "1", "Interaction tests that were judged"),
    ("tests_failed!", COUNT, "1", "Those that failed"),
    ("problem", TEXT, "", "Why something was not measured: the engine crashed or hung; null where all was"),
    ("seconds!", REAL, "s", "Wall time of the verification in this engine"),
)

INTERACTIONS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("engine!", TEXT, "", "Simulator"),
    ("test!", TEXT, "", "What the check fails as (`docs/checks.md`): stands, jam …; or opening or closing"),
    ("subject!", TEXT, "", "Joint, or which drop or start"),
    ("passed", FLAG, "", "Verdict; null for opening and closing efforts, which have none"),
    ("value", REAL, "as the reason says", "Number measured; null where there is none"),
    ("limit_value", REAL, "as the reason says", "Bound that it met; null where there is none"),
    ("reason!", TEXT, "", "The verdict in a sentence, with units"),
    ("way", TEXT, "", "Which way the part is moved, opening or closing; null where a test has none"),
)

OVERLAPS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("link_a!", TEXT, "", "One link"),
    ("link_b!", TEXT, "", "The other"),
    ("related!", FLAG, "", "Whether one is the other's parent: engines do not see these overlaps by default"),
    ("cause!", TEXT, "", "authored: the meshes overlap; hull: only the collision shapes do"),
    ("depth_mm!", REAL, "mm", "Deepest point"),
    ("penetration_mm!", REAL, "mm", "Summed over the pair's contact points"),
)

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

EXPECTATIONS: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    (
        "what!",
        TEXT,
        "",
        "size (longest edge with all closed), a joint (position at scale 1), or none: nothing is asked",
    ),
    ("unit!", TEXT, "", "cm, rad or m; swings: a joint, in its own unit, that may end elsewhere"),
    ("lows!", REALS, "as the column unit says", "Lower ends of the ranges that a reader accepts; any range will do"),
    ("highs!", REALS, "as the column unit says", "Their upper ends"),
    ("start", REAL, "as the column unit says", "Size, or where the joint starts; null where nothing is asked or known"),
    ("met_at_start", FLAG, "", "Whether that is expected; false without an overlay, null where nothing is asked"),
    ("rest", REAL, "as the column unit says", "Where the joint settled, in the engine that left it furthest off"),
    ("rest_engine", TEXT, "", "That engine"),
    ("met_at_rest", FLAG, "", "Whether it settled as expected in every engine; null for sizes and what swings"),
    ("why!", TEXT, "", "The reader's reason"),
    ("reason!", TEXT, "", "Why it could not be held against the asset; empty where it could"),
)

TRACE: tuple[Column, ...] = (
    *ASSET_COLUMNS,
    ("step_index!", COUNT, "1", "0 for the asset's first step"),
    ("step!", COUNT, "1", "The step as the search counts it"),
    ("proposer!", TEXT, "", "What proposed the positions"),
    ("phi_before_mm!", REAL, "mm", "Φ before the step"),
    ("phi_after_mm!", REAL, "mm", "Φ of the proposal"),
    ("moved_joints!", TEXTS, "", "Joints that the proposal moves"),
    ("moved_positions!", REALS, POSITION, "Their new positions, in the same order"),
    ("accepted!", FLAG, "", "Whether the proposal was kept"),
    ("evaluations!", COUNT, "1", "Evaluations of Φ that the step took"),
    ("reason!", TEXT, "", "Why it was accepted or not"),
    ("test", TEXT, "", "Failing test that the step was to mend: engine, test and subject; null for steps over Φ"),
    ("value_before", REAL, "as the reason says", "What that test measured before; null where it has no number"),
    ("value_after", REAL, "as the reason says", "What it measured of the proposal; null where it has no number"),
)

USED: tuple[Column, ...] = (
    ("used", REAL, "1", "Share of the joints tried that a hand opened and closed; null: not asked for, or none to try"),
    ("used_joints", COUNT, "1", "Joints that a hand operates, of which at most eight are tried; null: not asked for"),
    ("used_by", TEXT, "", "What did it: gripper or fingertips, which float, and whether another hand held the object"),
    ("used_reason", TEXT, "", "Why a joint was not, and whose fault it is; what others did meanwhile; null for none"),
)
"""Columns of the check ``used`` in the table ``assets``."""

CONTENTS: tuple[Column, ...] = (
    ("contents", REAL, "1", "Share of the interiors tried in which three bodies stayed; null: not asked for, or none"),
    ("contents_interiors", COUNT, "1", "Interiors of drawers, boxes and shelves that were tried, at most four"),
    ("contents_room_l", REAL, "l", "Room in these that the meshes leave free to the smallest body's middle"),
    ("contents_free", REAL, "1", "Share of that room that is free of collision shapes; null without an interior"),
    ("contents_reason", TEXT, "", "Why what lay in one did not stay, by link, or that none opens it; null for nothing"),
)
"""Columns of the check ``contents`` in the table ``assets``."""

LIFTED: tuple[Column, ...] = (
    ("lifted", REAL, "1", "Share of four yaws at which hands lifted it and set it down; null: not asked, or no load"),
    ("lifted_by", TEXT, "", "What did it: gripper or fingertips, at an edge, or both hands; they float; null: nothing"),
    ("lifted_reason", TEXT, "", "Why not at each: whose fault, object or hand, and what; null for nothing"),
)
"""Columns of the check ``lifted`` in the table ``assets``."""
