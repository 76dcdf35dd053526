"""Tables of outer judges: scores of videos by vision models, ratings by people, and which variant a person rated."""

from lab.schemas.tables_learning import LEARNING, LEARNING_CURVES
from lab.schemas.tables_probes import PROBE_TRIALS
from lab.schemas.tables_trials import TRIALS
from schemas.table import COUNT, REAL, TEXT, TIME, Column, make_table

_VIDEO_SCORES: tuple[Column, ...] = (
    ("task!", TEXT, "", "What is done to the object in the video, as 'cabinet close'"),
    ("asset_id!", TEXT, "", "The asset"),
    ("judge!", TEXT, "", "Who scored: a model's name, or the rule that makes a score of measurements"),
    ("trial!", COUNT, "1", "0 for the judge's first look at the task's candidates; 0 too for a row of several trials"),
    ("trials!", COUNT, "1", "Trials that the row stands for: 1, or more where only their mean was published"),
    ("method!", TEXT, "", "How the candidate was refined; real for a video of reality"),
    ("model!", TEXT, "", "Model that was asked when it was refined; none where no model was, or none is known"),
    ("run_id", TEXT, "", "Run that had refined the candidate; null where none is known"),
    ("position", COUNT, "1", "Place among the candidates of the trial as shown, 0 for the first; null if not known"),
    ("candidates", COUNT, "1", "How many candidates the trial showed; null if not known"),
    ("seed", COUNT, "1", "Seed of the trial's shuffle; null if not known"),
    ("frames", COUNT, "1", "Frames that were shown of each candidate; null if not known, or none were"),
    ("temperature", REAL, "1", "Temperature at which the judge was asked; null if not known, or it has none"),
    ("score", REAL, "1", "0 to 5; the mean over the trials of a row that stands for several; null without an answer"),
    ("score_deviation", REAL, "1", "Sample deviation over those trials; null for one trial"),
    ("description", TEXT, "", "What the judge saw"),
    ("pros", TEXT, "", "What spoke for it"),
    ("cons", TEXT, "", "What spoke against it"),
    ("reason", TEXT, "", "Why there is no score; null where there is one"),
    ("cost_usd", REAL, "USD", "Cost of the trial's calls, shared equally among its candidates; null if not known"),
    ("judged_at", TIME, "UTC", "When the judge began with the task; the latest time counts; null if not known"),
)

_RATER: tuple[Column, ...] = (
    ("rater!", TEXT, "", "Who rated: a name or a code"),
    ("asset_id!", TEXT, "", "The asset"),
    ("label!", TEXT, "", "The variant on the page: A, B, …, in the rater's own order; says nothing of the method"),
)
_OUT_OF_TEN = "0 to 10; null if not asked"

_RATINGS: tuple[Column, ...] = (
    *_RATER,
    ("rated_at", TIME, "UTC", "When; of several ratings of a variant by a rater the latest counts; null if not known"),
    ("score_before", REAL, "1", f"Stage 1, before touching, nothing simulated: {_OUT_OF_TEN}"),
    ("score_untouched", REAL, "1", f"Stage 2, simulated and untouched: {_OUT_OF_TEN}"),
    ("score_touched", REAL, "1", f"Stage 3, pushed and moved: {_OUT_OF_TEN}"),
    ("score!", REAL, "1", "In all, 0 to 10"),
    ("seconds", REAL, "s", "From the variant's first appearance to its score; null if not known"),
    ("seconds_touched", REAL, "s", "Time simulated in stage 3; null if not known"),
    ("position", COUNT, "1", "Place among the asset's variants as shown to the rater, 0 first; null if not known"),
    ("presented", COUNT, "1", "Place among all that the rater was shown, 0 first; null if not known"),
    ("note!", TEXT, "", "What the rater wrote; may be empty"),
)

_RATING_KEYS: tuple[Column, ...] = (
    *_RATER,
    ("method!", TEXT, "", "How the variant was refined"),
    ("model!", TEXT, "", "Model that the run asked for; none where no model was, or none is known"),
    ("run_id", TEXT, "", "Run that had refined it as it was rated; null if not known"),
    ("out", TEXT, "", "Output folder that it was shown from; null if not known"),
    ("seed", COUNT, "1", "Seed of the rater's order; null if not known"),
)

VIDEO_SCORES = make_table(
    "video_scores", "one row per candidate of a judge's trial of a task",
    ("task", "asset_id", "judge", "trial", "method", "model"),
    "What judges made of videos of the same task, candidates side by side and anonymous", _VIDEO_SCORES,
)  # fmt: skip
"""Scores of videos: a folder of files, each written by one run of a judge."""
RATINGS = make_table(
    "ratings", "one row per variant that a rater has rated", ("rater", "asset_id", "label"),
    "What people made of variants that they looked at and handled without knowing the method", _RATINGS,
)  # fmt: skip
"""Ratings: a folder of files, each written by one rating page."""
RATING_KEYS = make_table(
    "rating_keys", "one row per variant that a rater is shown", ("rater", "asset_id", "label"),
    "Which variant a label of ratings stands for: joined in analysis alone", _RATING_KEYS,
)  # fmt: skip
"""Keys of ratings, in a folder of their own: a row of ratings alone does not name a method."""

_ALL = (TRIALS, PROBE_TRIALS, LEARNING, LEARNING_CURVES, VIDEO_SCORES, RATINGS, RATING_KEYS)
JUDGED = {table.name: table for table in _ALL}
"""Tables of outer judges by name, each a folder ``NAME`` of Parquet files in an output folder that no run touches."""
