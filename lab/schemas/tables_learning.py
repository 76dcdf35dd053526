"""The tables of learning: what a policy learnt to do with an object, and how it came to it."""

from schemas.table import COUNT, REAL, TEXT, TIME, Column, make_table

_WHO: tuple[Column, ...] = (
    ("task!", TEXT, "", "What was to be learnt, as 'cabinet close'"),
    ("asset_id!", TEXT, "", "The asset"),
    ("method!", TEXT, "", "How the asset was refined"),
    ("model!", TEXT, "", "Model that was asked when it was refined; none where no model was"),
    ("seed!", COUNT, "1", "Seed of the training"),
)
_FOUND = "Of these rollouts, those in which"

_LEARNING: tuple[Column, ...] = (
    *_WHO,
    ("category!", TEXT, "", "The asset's category"),
    ("run_id", TEXT, "", "Run that had refined it; null if not known"),
    ("outcome!", TEXT, "", "learnt (held at two checkpoints), not learnt, solved at start, diverged, or failed"),
    ("reason!", TEXT, "", "Why it is not learnt; empty if it is"),
    ("budget!", COUNT, "1", "Actions that the training might do"),
    ("steps", COUNT, "1", "Actions that it did"),
    ("chosen_steps", COUNT, "1", "Actions before the chosen checkpoint: that with most successes, then the highest S"),
    ("seconds", REAL, "s", "Wall time of training, its checkpoints' rollouts included"),
    ("fps", REAL, "1/s", "Actions a second of that time"),
    ("s", REAL, "1", "Mean S of the chosen checkpoint's rollouts, 0 to 1: not comparable between assets"),
    ("success", REAL, "1", "Share of these rollouts that end at the target with no guard firing"),
    ("reached", REAL, "1", "Share of them that end at the target, guards aside; null in rows of older versions"),
    ("tilted_rad", REAL, "rad", "Largest tilt of the object in these rollouts"),
    ("lifted_m", REAL, "m", "How far it was lifted in them at most"),
    ("travelled_m", REAL, "m", "How far it was shoved in them at most"),
    ("rollouts", COUNT, "1", "How many they are, from perturbed starts, without noise"),
    ("first_seed", COUNT, "1", "Seed of the first of them; the others follow"),
    ("solved_at_start", COUNT, "1", f"{_FOUND} the start was the target"),
    ("drifted", COUNT, "1", f"{_FOUND} the part moved before anything touched the object"),
    ("moved_untouched", COUNT, "1", f"{_FOUND} it went most of its way untouched"),
    ("struck", COUNT, "1", f"{_FOUND} it was struck, faster than a hand; null in rows of older versions"),
    ("spring_did_it", COUNT, "1", f"{_FOUND} its spring did the work"),
    ("displaced", COUNT, "1", f"{_FOUND} the object was tipped, lifted or shoved away"),
    ("diverged", COUNT, "1", f"{_FOUND} the simulation diverged"),
    ("gripper", TEXT, "", "The arm's gripper"),
    ("device", TEXT, "", "What it was trained on"),
    ("video", TEXT, "", "Film of the first of these rollouts, below the output folder; null without one"),
    ("recorded_at!", TIME, "UTC", "When"),
)

_CURVES: tuple[Column, ...] = (
    *_WHO,
    ("steps!", COUNT, "1", "Actions done"),
    ("seconds!", REAL, "s", "Wall time of training"),
    ("s!", REAL, "1", "Mean S of the checkpoint's rollouts"),
    ("success!", REAL, "1", "Share of them that succeeded"),
    ("reward!", REAL, "1", "Mean sum of their rewards"),
    ("recorded_at!", TIME, "UTC", "When the training ended"),
)

LEARNING = make_table(
    "learning", "one row per task, method's variant of an asset, and seed",
    ("task", "asset_id", "method", "model", "seed"),
    "What policies learnt to do with refined objects: PPO, the paper's reward, success over rollouts", _LEARNING,
)  # fmt: skip
"""Trainings: a folder of files in an output folder, each written by one run of the command."""
LEARNING_CURVES = make_table(
    "learning_curves", "one row per checkpoint of a training",
    ("task", "asset_id", "method", "model", "seed", "steps"), "How trainings came to what they learnt", _CURVES,
)  # fmt: skip
"""Their checkpoints, written when a training ends."""
