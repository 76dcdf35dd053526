"""Tables of a comparison of methods and models, written beside its charts, not into a run's catalog."""

from schemas.table import COUNT, FLAG, REAL, TEXT, Column, Table, make_table

_RUN: tuple[Column, ...] = (
    ("method!", TEXT, "", "How the assets were refined"),
    ("model!", TEXT, "", "Model that was asked; none for methods that ask no model"),
)

_OBJECTS: tuple[Column, ...] = (
    *_RUN,
    ("asset_id!", TEXT, "", "The asset"),
    ("category!", TEXT, "", "What the object is"),
    ("subset", TEXT, "", "The manifest's subset; null where it names none"),
    ("ok!", FLAG, "", "Whether it passed every test that was run"),
    ("failure_mode!", TEXT, "", "Why it failed, none for ok"),
    ("paper_failure_mode", TEXT, "", "The paper's name for the failure mode; null for ok, and where it has none"),
    ("penetration_mm", REAL, "mm", "Φ at the initial position; null where not measured"),
    ("drift_passes!", FLAG, "", "Whether it stayed where it was, untouched; not where not measured"),
    ("oscillation_passes!", FLAG, "", "Whether no joint oscillated; not where not measured"),
    ("paper_tests_pass!", FLAG, "", "Whether it passed the paper's three tests: penetration, drift, oscillation"),
    ("alignment", REAL, "1", "Prompt alignment, 0 to 1, by rubric; null where it never came to an overlay"),
    (
        "meaning",
        REAL,
        "1",
        "Half for an expected size, half for the share of expected joints at rest; null without any",
    ),
    ("size_met", FLAG, "", "Whether its size is as expected; null where none is"),
    ("joints_asked", COUNT, "1", "Joints of which the dataset expects something"),
    ("joints_met_at_start", COUNT, "1", "Those that start as expected"),
    ("joints_met", COUNT, "1", "Those that end as expected, in every engine; what swings: that start so"),
    ("judged", REAL, "1", "The same by a vision model; null where none was asked"),
    ("scale_deviation", REAL, "1", "|s − s_ref| / s_ref where an expert states a scale; else null"),
    ("joint_deviation_rad", REAL, "rad", "|q − q_ref| where the joint of interest is a hinge; else null"),
    ("calls!", COUNT, "1", "Model calls, those answered from the cache included, the judge's left out"),
    ("tokens!", COUNT, "1", "Tokens of those calls, sent and received"),
    ("cost_usd!", REAL, "USD", "What those calls cost"),
    ("seconds!", REAL, "s", "Wall time"),
)

_FIGURES: tuple[Column, ...] = (
    *_RUN,
    ("figure!", TEXT, "", "Which figure"),
    ("unit!", TEXT, "", "Its unit"),
    ("value", REAL, "as the unit says", "The figure over all objects that have it; null if none has"),
    ("low", REAL, "as the unit says", "Lower end of its 95 % bootstrap interval over objects; null for one object"),
    ("high", REAL, "as the unit says", "Upper end"),
    ("n!", COUNT, "1", "Objects that it is taken from"),
    ("difference", REAL, "as the unit says", "The figure less ours, over the objects that both have; null for ours"),
    ("difference_low", REAL, "as the unit says", "Lower end of its 95 % paired bootstrap interval"),
    ("difference_high", REAL, "as the unit says", "Upper end"),
    ("n_paired", COUNT, "1", "Objects that both have; null for ours"),
    ("first!", FLAG, "", "Whether no other method with the same model is better"),
    ("paper", REAL, "as the unit says", "The paper's figure; null where it states none"),
    ("paper_spread", REAL, "as the unit says", "Its standard deviation over objects; null where not stated"),
)

_FAILURES: tuple[Column, ...] = (
    *_RUN,
    ("outcome!", TEXT, "", "ok, or the paper's name for how assets failed"),
    ("assets!", COUNT, "1", "Assets that ended so"),
    ("share_percent!", REAL, "%", "Of all"),
    ("failure_modes!", TEXT, "", "Our failure modes among them, as JSON: mode → assets"),
)

_GROWTH: tuple[Column, ...] = (
    ("method!", TEXT, "", "How the assets were refined"),
    ("level!", REAL, "1", "Size of the simulated model's errors; 1 is the default"),
    ("figure!", TEXT, "", "success or scale"),
    ("unit!", TEXT, "", "Its unit"),
    ("value", REAL, "as the unit says", "The figure; null where no object has it"),
    ("low", REAL, "as the unit says", "Lower end of its 95 % bootstrap interval over objects"),
    ("high", REAL, "as the unit says", "Upper end"),
    ("n!", COUNT, "1", "Objects that it is taken from"),
)

_RUN_KEY = ("method", "model")

OBJECTS = make_table(
    "objects", "one row per object, method and model", (*_RUN_KEY, "asset_id"),
    "What the other tables are computed from", _OBJECTS,
)  # fmt: skip
FAILURES = make_table(
    "failures", "one row per outcome of a method and model", (*_RUN_KEY, "outcome"),
    "How assets ended, by the paper's names (Table 6)", _FAILURES,
)  # fmt: skip
GROWTH = make_table(
    "growth", "one row per method, error level and figure", ("method", "level", "figure"),
    "How each method stands a model whose errors grow", _GROWTH,
)  # fmt: skip


def figures_table(name: str, description: str) -> Table:
    """A table of figures, one row per method, model and figure."""
    return make_table(name, "one row per figure of a method and model", (*_RUN_KEY, "figure"), description, _FIGURES)


STABILITY = figures_table("stability", "Stability and semantics (the paper's Table 1)")
SUCCESS = figures_table("success", "Success over the whole set (the paper's Table 6)")
COST = figures_table("cost", "Calls, tokens, cost and time an asset (the paper's Table 7)")
