"""One row for each object, method and model, read from the runs' catalogs."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from asset2sim.catalog.read import latest_rows
from asset2sim.studies.methods.method_runs import Run
from schemas.settings import Thresholds
from schemas.vocabulary import PAPER_FAILURE_MODES, FailureMode

JUDGING = "judge"
"""Purpose of the vision judge's calls, which are not part of a method."""


def read_objects(runs: Sequence[Run], limits: Thresholds) -> pd.DataFrame:
    """The latest run of every folder, as rows of ``schemas.tables_compare.OBJECTS``; numbers not measured are NaN.

    Raises UsageError where a folder has no run.
    """
    return pd.concat([_objects(run, limits) for run in runs], ignore_index=True)


def _objects(run: Run, limits: Thresholds) -> pd.DataFrame:
    assets, aligned, calls = latest_rows(run.folder, "assets", "alignment", "model_calls")
    columns = ["asset_id", "alignment", "judged", "scale_deviation", "reference_states_scale", "joint_deviation_rad"]
    merged = assets.merge(aligned[columns], on="asset_id", how="left")
    merged = merged.merge(_spent(calls), on="asset_id", how="left")
    drift = (_number(merged, "drift_m") <= limits.drift_m) & (_number(merged, "drift_rad") <= limits.drift_rad)
    phi = _number(merged, "penetration_mm")
    # An object that exploded has no drift; one that was never measured passes nothing.
    steady = merged["finite"].fillna(False).astype(bool) & (_number(merged, "oscillating_joints") == 0)
    stated = merged["reference_states_scale"].astype("boolean").fillna(False).astype(bool)
    slow = _number(merged, "peak_speed_m_s") <= limits.peak_speed_m_s
    return pd.DataFrame(
        {
            "method": run.method.value,
            "model": run.label,
            "asset_id": merged["asset_id"].astype(str),
            "category": merged["category"].astype(str),
            "ok": merged["status"] == "ok",
            "failure_mode": merged["failure_mode"].astype(str),
            "paper_failure_mode": [PAPER_FAILURE_MODES.get(FailureMode(mode)) for mode in merged["failure_mode"]],
            "penetration_mm": phi,
            "drift_passes": drift,
            "oscillation_passes": steady,
            "paper_tests_pass": drift & steady & slow & (phi <= 1000.0 * limits.penetration_m),
            "alignment": _number(merged, "alignment"),
            "judged": _number(merged, "judged"),
            "scale_deviation": _number(merged, "scale_deviation").where(stated),
            "joint_deviation_rad": _number(merged, "joint_deviation_rad"),
            "calls": merged["calls"].fillna(0).astype(int),
            "tokens": merged["tokens"].fillna(0).astype(int),
            "cost_usd": _number(merged, "spent_usd").fillna(0.0),
            "seconds": _number(merged, "seconds_total"),
        }
    )


def _spent(calls: pd.DataFrame) -> pd.DataFrame:
    """Calls, tokens and cost of each asset; an answer from the cache counts as a call."""
    own = calls[calls["purpose"] != JUDGING]
    tokens = own["prompt_tokens"] + own["completion_tokens"]
    grouped = own.assign(tokens=tokens).groupby("asset_id")
    spent = grouped.agg(calls=("call_index", "size"), tokens=("tokens", "sum"), spent_usd=("cost_usd", "sum"))
    return spent.reset_index()


def _number(frame: pd.DataFrame, name: str) -> "pd.Series[float]":
    return pd.to_numeric(frame[name], errors="coerce").astype("float64").replace([np.inf, -np.inf], np.nan)
