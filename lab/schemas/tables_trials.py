"""The table of trials: what a scripted arm did with an object, and what was measured meanwhile."""

from schemas.table import COUNT, FLAG, REAL, TEXT, TIME, Column, make_table

MEASURED: tuple[Column, ...] = (
    ("first_contact_s", REAL, "s", "When the tool first touched the object; null if never"),
    ("moved_rad", REAL, "rad", "Largest turn of the object or a part that nothing had touched yet"),
    ("moved_m", REAL, "m", "Largest shift of the object or a sliding part that nothing had touched yet"),
    (
        "appeared_j",
        REAL,
        "J",
        "Energy that stops and contacts other than the tool's put into the object, picture by picture",
    ),
    ("appeared_m", REAL, "m", "The same, as the height to which it would lift the object"),
    ("impulse_m_s", REAL, "m/s", "Speed that the object would have of the most of it in one picture (1/15 s)"),
    ("overlap_m", REAL, "m", "How deep the tool was in the object"),
    (
        "ringing_turns",
        COUNT,
        "1",
        "Changes of direction of a part after it was let go, above the amplitude that counts",
    ),
    ("force_n", REAL, "N", "Largest force between tool and object"),
    ("work_j", REAL, "J", "Work of the tool on the object"),
    ("tilted_rad", REAL, "rad", "How far the object was tilted from how it stood, at most"),
    ("moved_before_contact", FLAG, "", "Something moved before it was touched"),
    ("energy_appeared", FLAG, "", "Energy appeared"),
    ("jumped", FLAG, "", "An impulse that no touch explains"),
    ("overlapped", FLAG, "", "Tool and object interpenetrated"),
    ("rang", FLAG, "", "A part swung to and fro after it was let go"),
    ("forced", FLAG, "", "The tool pressed harder than a household object bears; null in rows of older versions"),
    ("tipped", FLAG, "", "The object was tipped that was not to be carried; null in rows of older versions"),
)
"""What the physical judge measures of a recording, and its faults."""

_TRIALS: tuple[Column, ...] = (
    ("task!", TEXT, "", "What was to be done, as 'cabinet close'"),
    ("asset_id!", TEXT, "", "The asset"),
    ("method!", TEXT, "", "How the asset was refined"),
    ("model!", TEXT, "", "Model that was asked when it was refined; none where no model was"),
    ("run_id", TEXT, "", "Run that had refined it; null if not known"),
    ("verb!", TEXT, "", "close, press, open, turn or grasp"),
    ("joint", TEXT, "", "Joint that was to move; null for grasp"),
    ("tool", TEXT, "", "arm, or pusher where the arm could not reach; null where neither could"),
    ("gripper", TEXT, "", "panda, the arm's own, or robotiq; null in rows of older versions"),
    ("outcome!", TEXT, "", "done, not done, solved at start, unreachable, or failed (no recording)"),
    ("reason!", TEXT, "", "Why it is not done; empty if it is"),
    ("score", REAL, "1", "Of the physical judge, 0 to 5; null without a recording"),
    ("start", REAL, "rad or m", "Position of the joint at the start"),
    ("target", REAL, "rad or m", "Where it should end"),
    ("end", REAL, "rad or m", "Where it ended"),
    *MEASURED,
    ("seconds_simulated", REAL, "s", "Length of the recording"),
    ("seconds", REAL, "s", "Wall time of planning, simulation and film"),
    ("recorded_at!", TIME, "UTC", "When"),
)

TRIALS = make_table(
    "trials", "one row per task and method's variant of an asset", ("task", "asset_id", "method", "model"),
    "Tasks that a scripted arm did with refined objects, and what the physical judge measured", _TRIALS,
)  # fmt: skip
"""Trials: a folder of files in an output folder, each written by one recording."""
