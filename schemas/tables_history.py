"""Columns of ``assets`` that the history of all runs keeps."""

OUTCOME_COLUMNS = (
    "category",
    "subset",
    "status",
    "failure_mode",
    "paper_failure_mode",
    "reason",
    "scale",
    "mass_kg",
    "penetration_mm",
    "drift_m",
    "drift_rad",
    "peak_speed_m_s",
    "oscillating_joints",
    "errors",
    "warnings",
    "content_hash",
)
"""How the asset ended and measures: an unchanged one keeps what it had."""

COST_COLUMNS = (
    "queries",
    "cached_calls",
    "prompt_tokens",
    "completion_tokens",
    "cost_usd",
    "seconds_total",
)
"""What the run spent on the asset: nothing where it was unchanged."""
