"""The table of probe trials: what a policy did with an object in the DROID scene, and what was measured meanwhile."""

from lab.schemas.tables_trials import MEASURED
from schemas.table import COUNT, FLAG, REAL, TEXT, TIME, Column, make_table

_PROBE_TRIALS: tuple[Column, ...] = (
    ("task!", TEXT, "", "What was to be done, as 'cabinet close'"),
    ("asset_id!", TEXT, "", "The asset"),
    ("method!", TEXT, "", "How the asset was refined"),
    ("model!", TEXT, "", "Model that was asked when it was refined; none where no model was"),
    ("policy!", TEXT, "", "The policy's name: as --name has it, or the probe of ours, or its address"),
    ("trial!", COUNT, "1", "0 for the first trial of the task, asset and policy"),
    ("seed!", COUNT, "1", "Seed of the trial's start; the same for all methods and policies"),
    ("protocol!", TEXT, "", "openpi or gr00t: how the policy was asked"),
    ("ours!", FLAG, "", "The policy is a probe of ours, which never acted in reality"),
    ("run_id", TEXT, "", "Run that had refined the asset; null if not known"),
    ("instruction", TEXT, "", "What the policy was told; null where no episode began"),
    ("outcome!", TEXT, "", "done, not done, failed (no episode), or how the policy ended it: policy died, policy timed "
     "out, answer refused, policy unreachable"),
    ("reason!", TEXT, "", "Why it is not done; empty if it is"),
    ("success", FLAG, "", "The final state is within the tolerance of the target; null where there is no result"),
    ("start", REAL, "rad or m", "State at the start: the joint's position, or distance of the object from the bowl"),
    ("target", REAL, "rad or m", "Where it should end"),
    ("end", REAL, "rad or m", "Where it ended"),
    ("distance", REAL, "1 or m", "Final distance ‖s_T − s*‖: a share of the joint's range, or m from the bowl"),
    ("tolerance", REAL, "1 or m", "ε: the distance that counts as success"),
    ("gripper", TEXT, "", "The arm's gripper; null in rows of older versions"),
    ("steps", COUNT, "1", "Actions carried out, each 1/15 s"),
    ("asked", COUNT, "1", "Times that the policy was asked"),
    ("latency_s", REAL, "s", "Median time to an answer; null where it was not asked"),
    ("latency_max_s", REAL, "s", "Longest time to an answer"),
    *MEASURED,
    ("video", TEXT, "", "The film, below the output folder; null where there is none"),
    ("seconds_simulated", REAL, "s", "Length of the episode"),
    ("seconds", REAL, "s", "Wall time of the trial"),
    ("recorded_at!", TIME, "UTC", "When"),
)  # fmt: skip

PROBE_TRIALS = make_table(
    "probe_trials", "one row per trial of a policy at a task with a method's variant of an asset",
    ("task", "asset_id", "method", "model", "policy", "trial"),
    "Tasks that policies behind a socket did with refined objects, in the DROID scene", _PROBE_TRIALS,
)  # fmt: skip
"""Probe trials: a folder of files in an output folder, each written by one run of ``asset2sim probe``. Of several rows
of a trial the latest counts."""
