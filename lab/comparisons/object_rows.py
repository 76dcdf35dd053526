"""One row for each object, method and model, read from the runs' catalogs."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from asset2sim.catalog.read import latest_rows
from asset2sim.checks.alignment.expectations import SWINGS
from lab.comparisons.method_runs import MethodRun
from schemas.alignment import NOTHING, SIZE
from schemas.model_names import JUDGE_PURPOSE
from schemas.settings import Thresholds
from schemas.vocabulary import PAPER_FAILURE_MODES, FailureMode

NO_REFERENCE = "no_reference"
"""Finding of an object for which no expert chose anything."""


def read_objects(runs: Sequence[MethodRun], limits: Thresholds) -> pd.DataFrame:
    """A row for each object in the latest run of every folder; numbers not measured are NaN. ``alignment`` is the
    rubric's, 0 to 1, ``meaning`` half for an expected size and half for the share of expected joints at rest;
    deviations are from the experts'. An object for which the human reference has no expert's choice is no row of that
    method. Raises UsageError where a folder has no run."""
    return pd.concat([_objects(run, limits) for run in runs], ignore_index=True)


def _objects(run: MethodRun, limits: Thresholds) -> pd.DataFrame:
    tables = "assets", "alignment", "model_calls", "expectations", "findings"
    assets, aligned, calls, expected, findings = latest_rows(run.folder, *tables)
    unchosen = findings.loc[findings["code"] == NO_REFERENCE, "asset_id"]
    assets = assets[~assets["asset_id"].isin(unchosen)]
    columns = ["asset_id", "alignment", "judged", "scale_deviation", "reference_states_scale", "joint_deviation_rad"]
    merged = assets.merge(aligned[columns], on="asset_id", how="left")
    merged = merged.merge(_spent(calls), on="asset_id", how="left")
    merged = merged.merge(_met(expected), on="asset_id", how="left")
    drift, steady = drift_passes(merged, limits), oscillation_passes(merged)
    phi = _number(merged, "penetration_mm")
    stated = true_of(merged["reference_states_scale"])
    slow = _number(merged, "peak_speed_m_s") <= limits.peak_speed_m_s
    return pd.DataFrame(
        {
            "method": run.method.value,
            "model": run.label,
            "asset_id": merged["asset_id"].astype(str),
            "category": merged["category"].astype(str),
            "subset": merged["subset"],
            "ok": merged["status"] == "ok",
            "failure_mode": merged["failure_mode"].astype(str),
            "paper_failure_mode": [PAPER_FAILURE_MODES.get(FailureMode(mode)) for mode in merged["failure_mode"]],
            "penetration_mm": phi,
            "drift_passes": drift,
            "oscillation_passes": steady,
            "paper_tests_pass": drift & steady & slow & (phi <= 1000.0 * limits.penetration_m),
            "alignment": _number(merged, "alignment"),
            "meaning": _number(merged, "meaning"),
            "size_met": merged["size_met"].astype("boolean"),
            **{name: _number(merged, name).astype("Int64") for name in JOINT_COUNTS},
            "judged": _number(merged, "judged"),
            "scale_deviation": _number(merged, "scale_deviation").where(stated),
            "joint_deviation_rad": _number(merged, "joint_deviation_rad"),
            "calls": merged["calls"].fillna(0).astype(int),
            "tokens": merged["tokens"].fillna(0).astype(int),
            "cost_usd": _number(merged, "spent_usd").fillna(0.0),
            "seconds": _number(merged, "seconds_total"),
        }
    )


def true_of(flags: "pd.Series[bool]") -> "pd.Series[bool]":
    """The flags, with null as False."""
    return flags.astype("boolean").fillna(False).astype(bool)


def drift_passes(rows: pd.DataFrame, limits: Thresholds) -> "pd.Series[bool]":
    """Whether each row's drift is within the limits; False for null: not measured, or not finite."""
    return (_number(rows, "drift_m") <= limits.drift_m) & (_number(rows, "drift_rad") <= limits.drift_rad)


def oscillation_passes(rows: pd.DataFrame) -> "pd.Series[bool]":
    """Whether no joint of each row oscillated; False where it was not measured, or exploded."""
    return true_of(rows["finite"]) & (_number(rows, "oscillating_joints") == 0)


def _spent(calls: pd.DataFrame) -> pd.DataFrame:
    """Calls, tokens and cost of each asset without the vision judge's; an answer from the cache counts as a call."""
    own = calls[calls["purpose"] != JUDGE_PURPOSE]
    tokens = own["prompt_tokens"] + own["completion_tokens"]
    grouped = own.assign(tokens=tokens).groupby("asset_id")
    spent = grouped.agg(calls=("call_index", "size"), tokens=("tokens", "sum"), spent_usd=("cost_usd", "sum"))
    return spent.reset_index()


def asked_joints(expected: pd.DataFrame) -> pd.DataFrame:
    """The expectations of joints, each with ``met``, whether it ended as expected: what ``swings`` started so."""
    joints = expected[~expected["what"].isin([SIZE, NOTHING]) & expected["met_at_start"].notna()]
    swings = joints["unit"] == SWINGS
    met = true_of(joints["met_at_start"].where(swings, joints["met_at_rest"]))
    return joints.assign(swings=swings, met=met)


JOINT_COUNTS = ("joints_asked", "joints_met_at_start", "joints_met")


def _met(expected: pd.DataFrame) -> pd.DataFrame:
    """How each asset with expectations meets them: a row each, with ``meaning``, ``size_met`` and ``JOINT_COUNTS``."""
    rows: list[dict[str, object]] = []
    for asset_id, own in expected.groupby("asset_id"):
        size = own.loc[own["what"] == SIZE, "met_at_start"].dropna()
        joints = asked_joints(own)
        halves = [float(size.iloc[0])] if len(size) else []
        halves += [float(joints["met"].mean())] if len(joints) else []
        row: dict[str, object] = {"asset_id": asset_id, "meaning": float(np.mean(halves)) if halves else np.nan}
        row |= {"size_met": bool(size.iloc[0]) if len(size) else None}
        counts = (len(joints), int(true_of(joints["met_at_start"]).sum()), int(joints["met"].sum()))
        rows.append(row | dict(zip(JOINT_COUNTS, counts, strict=True)))
    return pd.DataFrame(rows, columns=["asset_id", "meaning", "size_met", *JOINT_COUNTS])


def _number(frame: pd.DataFrame, name: str) -> "pd.Series[float]":
    return pd.to_numeric(frame[name], errors="coerce").astype("float64").replace([np.inf, -np.inf], np.nan)
