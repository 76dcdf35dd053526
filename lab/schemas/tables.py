"""The laboratory's tables: trials of a scripted arm and of policies, trainings, and what outer judges made of them.
Their columns are rows of ``columns.csv``, as those of the catalog's tables are of ``schemas/columns.csv``."""

from pathlib import Path

from schemas.table import Table, columns_of, make_table

COLUMNS = Path(__file__).with_name("columns.csv")


def lab_table(name: str, grain: str, key: tuple[str, ...], description: str) -> Table:
    """A table of the columns that ``COLUMNS`` lists of it."""
    return make_table(name, grain, key, description, columns_of(name, COLUMNS))


TRIALS = lab_table(
    "trials", "one row per task and method's variant of an asset", ("task", "asset_id", "method", "model"),
    "Tasks that a scripted arm did with refined objects, and what the physical judge measured",
)  # fmt: skip
"""Trials: a folder of files in an output folder, each written by one recording."""
PROBE_TRIALS = lab_table(
    "probe_trials", "one row per trial of a policy at a task with a method's variant of an asset",
    ("task", "asset_id", "method", "model", "policy", "trial"),
    "Tasks that policies behind a socket did with refined objects, in the DROID scene",
)  # fmt: skip
"""Probe trials: a folder of files in an output folder, each written by one run of ``asset2sim probe``. Of several rows
of a trial the latest counts."""
LEARNING = lab_table(
    "learning", "one row per task, method's variant of an asset, and seed",
    ("task", "asset_id", "method", "model", "seed"),
    "What policies learnt to do with refined objects: PPO, the paper's reward, success over rollouts",
)  # fmt: skip
"""Trainings: a folder of files in an output folder, each written by one run of the command."""
LEARNING_CURVES = lab_table(
    "learning_curves", "one row per checkpoint of a training",
    ("task", "asset_id", "method", "model", "seed", "steps"), "How trainings came to what they learnt",
)  # fmt: skip
"""Their checkpoints, written when a training ends."""
VIDEO_SCORES = lab_table(
    "video_scores", "one row per candidate of a judge's trial of a task",
    ("task", "asset_id", "judge", "trial", "method", "model"),
    "What judges made of videos of the same task, candidates side by side and anonymous",
)  # fmt: skip
"""Scores of videos: a folder of files, each written by one run of a judge."""
RATINGS = lab_table(
    "ratings", "one row per variant that a rater has rated", ("rater", "asset_id", "label"),
    "What people made of variants that they looked at and handled without knowing the method",
)  # fmt: skip
"""Ratings: a folder of files, each written by one rating page."""
RATING_KEYS = lab_table(
    "rating_keys", "one row per variant that a rater is shown", ("rater", "asset_id", "label"),
    "Which variant a label of ratings stands for: joined in analysis alone",
)  # fmt: skip
"""Keys of ratings, in a folder of their own: a row of ratings alone does not name a method."""

_ALL = (TRIALS, PROBE_TRIALS, LEARNING, LEARNING_CURVES, VIDEO_SCORES, RATINGS, RATING_KEYS)
JUDGED = {table.name: table for table in _ALL}
"""The tables by name, each a folder ``NAME`` of Parquet files in an output folder that no run touches."""
