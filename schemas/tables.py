"""The catalog's tables: an Arrow schema each, with units in column names and a description in every field."""

from schemas.extensions import further_columns
from schemas.table import ASSET_KEY, columns_of, make_table

USED, CONTENTS, LIFTED = (tuple(columns_of(check)) for check in ("used", "contents", "lifted"))
"""Columns of a hand's checks (``schemas.hand_settings``) in the table ``assets``."""
OUTCOME_COLUMNS = (
    *("category", "subset", "status", "failure_mode", "paper_failure_mode", "reason", "scale", "mass_kg"),
    *("penetration_mm", "drift_m", "drift_rad", "peak_speed_m_s", "oscillating_joints"),
    *("errors", "warnings", "content_hash"),
)
"""The asset's result and measurements; an unchanged asset keeps its earlier values."""

COST_COLUMNS = ("queries", "cached_calls", "prompt_tokens", "completion_tokens", "cost_usd", "seconds_total")
"""What the run spent on the asset: nothing where it was unchanged."""

TABLES = {
    table.name: table
    for table in (
        make_table("assets", "one row per asset, method and model: the latest", ASSET_KEY,
               "How each asset was refined, how it measures and what it cost",
               columns_of("assets", further={"further checks": further_columns()})),
        make_table("links", "one row per link of an asset, method and model", (*ASSET_KEY, "link"),
               "Mass, centre of mass and inertia as written, and where each number came from"),
        make_table("joints", "one row per movable joint of an asset, method and model", (*ASSET_KEY, "joint"),
               "Dynamics, limits and initial position as written, and what the joint did when measured"),
        make_table("model_calls", "one row per model call of an asset, method and model", (*ASSET_KEY, "call_index"),
               "Every call to a model: what for, what it cost and how it ended"),
        make_table("trace", "one row per refinement step of an asset, method and model", (*ASSET_KEY, "step_index"),
               "Every proposal of joint positions and what the simulator said of it"),
        make_table("findings", "one row per finding of an asset, method and model", (*ASSET_KEY, "finding_index"),
               "Everything that a stage noticed, changed or refused"),
        make_table("measurements", "one row per asset, method, model and engine", (*ASSET_KEY, "engine"),
               "What each engine measured of the paper's tests, and whether it passed"),
        make_table("interactions", "one row per test and subject of an asset, method, model and engine",
               (*ASSET_KEY, "engine", "test", "subject"),
               "Every interaction test: dropped, nudged, swept, held, released, opened, reset"),
        make_table("link_overlaps", "one row per overlapping pair of links of an asset, method and model",
               (*ASSET_KEY, "link_a", "link_b"),
               "All pairs that overlap in the initial state, parent and child included, and why"),
        make_table("alignment", "one row per asset, method and model that came to an overlay", ASSET_KEY,
               "How well each asset is what its user asked for, and how far from an expert's choice"),
        make_table("expectations", "one row per asset, method, model and thing that is expected", (*ASSET_KEY, "what"),
               "How each asset meets what readers of its prompt and pictures wrote down beforehand"),
        make_table("runs", "one row per run", ("run_id",),
               "What was run, with which settings and versions, and how it ended"),
    )
}  # fmt: skip
"""Tables of the catalog's folder by name: written together, with the latest rows of every asset."""

_OUTCOME_AND_COST = [
    column for column in columns_of("assets") if column[0].removesuffix("!") in (*OUTCOME_COLUMNS, *COST_COLUMNS)
]
HISTORY = make_table(
    "asset_history", "one row per run and asset, method and model", ("run_id", *ASSET_KEY),
    "How each asset ended in every run, how it measured and what it cost",
    columns_of("asset_history", further={"outcome and cost": _OUTCOME_AND_COST}),
)  # fmt: skip
"""History of all runs: an append-only folder of files by month of the run's start."""

REVIEWS = make_table(
    "reviews", "one row per review of an asset, method and model", (*ASSET_KEY, "reviewed_at", "reviewer"),
    "What people said of an asset in the viewer; no run removes or rewrites it",
)  # fmt: skip
"""Reviews: a folder of files, each written by one viewer."""

PUBLISHED = {**TABLES, HISTORY.name: HISTORY, REVIEWS.name: REVIEWS}
"""Every table that can be read, by name."""
