"""The table of what proposes states, a search first or a model at every step, on the same overlapping objects. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from asset2sim.catalog.text import NOTHING, markdown_table
from asset2sim.models.gateway.recorded import answer_files, answer_names
from schemas.model_names import REFINEMENT_PURPOSE, described, is_recorded, recorded_folder
from schemas.settings import EngineSettings, Settings
from schemas.vocabulary import Engine, Proposer, Status

BLOCK = "proposers"
"""Name of the page's block."""
STATE_STEPS = ("request", "line", "perturbation", "grid", "groups", "return", "authored", "model")
"""Proposers of joint positions in the table ``trace``; the others change shapes and terms."""
UNRECORDED = "no answer is recorded"
"""Words of a finding about a question that a recorded model does not answer."""
MM_PER_M = 1e3
HEADINGS = (
    "model", "proposer", "objects", "model calls each", "iterations each", "Φ at the start, mm",
    "after the last step", "as written", "moved, rad", "moved, mm", "ok",
)  # fmt: skip


@dataclass(frozen=True)
class ProposerRun:
    """One model's run with one proposer over one dataset: its tables by name, of objects that overlap at the start."""

    model: str
    proposer: Proposer
    assets: pd.DataFrame
    joints: pd.DataFrame
    trace: pd.DataFrame
    calls: pd.DataFrame
    findings: pd.DataFrame


def settings_with(base: Settings, model: str, proposer: Proposer | None) -> Settings:
    """Settings of a run, checked in PyBullet, in which states are refined; the model that is asked for sizes and
    states is asked for steps, too. Without a proposer, those of the quick run that finds out which objects
    overlap at the start."""
    chosen = {"model": model, "refinement_model": None}
    engine = EngineSettings(verify=(Engine.PYBULLET,), interact=proposer is not None)
    changes: dict[str, object] = {"model": base.model.model_copy(update=chosen), "engine": engine}
    if proposer is None:
        changes["search"] = base.search.model_copy(update={"mend_rounds": 0})
    else:
        changes["search"] = base.search.model_copy(update={"proposer": proposer})
    return base.model_copy(update=changes)


def answered(model: str, asset_ids: Sequence[str]) -> list[str]:
    """The assets about which a model can be asked: of a recorded one, those with an answer to the synthesis."""
    if not is_recorded(model):
        return list(asset_ids)
    files = set(answer_files(Path(recorded_folder(model))))
    return [name for name in asset_ids if f"{name}.json" in files]


def proposers_of(model: str, asset_ids: Sequence[str]) -> tuple[Proposer, ...]:
    """The proposers that a model can be: a recorded one proposes every step only where it answers the first question
    about every object, since no other model may answer for it. ``unrecorded`` says whether it answered the others."""
    if is_recorded(model):
        files = set(answer_files(Path(recorded_folder(model))))
        asked = [set(answer_names(asset_id, REFINEMENT_PURPOSE)) for asset_id in asset_ids]
        if not all(names & files for names in asked):
            return (Proposer.SEARCH,)
    return tuple(Proposer)


def unrecorded(runs: Sequence[ProposerRun]) -> list[str]:
    """The objects about which a step was asked that no recording answers: the run went on without the model."""
    findings = pd.concat([run.findings for run in runs])
    left = (findings["code"] == "refinement_unanswered") & findings["message"].str.contains(UNRECORDED, na=False)
    return sorted(set(findings.loc[left, "asset_id"]))


def overlapping_at_start(trace: pd.DataFrame, target_mm: float) -> list[str]:
    """The assets whose requested state has Φ above ``target_mm``."""
    starts = first_steps(trace)
    return sorted(starts[starts["phi_before_mm"] > target_mm]["asset_id"])


def first_steps(trace: pd.DataFrame) -> pd.DataFrame:
    """Each asset's first step: the requested state."""
    return trace.sort_values("step_index").groupby("asset_id", as_index=False).first()


def proposers_table(runs: Sequence[ProposerRun]) -> str:
    """A Markdown table with a row per model and proposer, the same one's datasets together, but for those of which a
    question was not answered; a sentence below names these."""
    rows, left = [], []
    for model in dict.fromkeys(run.model for run in runs):
        for proposer in Proposer:
            own = [run for run in runs if (run.model, run.proposer) == (model, proposer)]
            if own and (missing := unrecorded(own)):
                left.append(f"`{model}` as `{proposer.value}`, whose recordings end early for {', '.join(missing)}")
            elif own:
                rows.append([described(model), f"`{proposer.value}`", *figures(own)])
    table = markdown_table(list(HEADINGS), rows, range(2, len(HEADINGS)))
    return f"{table}\n\nLeft out: {'; '.join(left)}." if left else table


def figures(runs: Sequence[ProposerRun]) -> list[str]:
    """The figures of one model and proposer, means over objects, the largest in brackets."""
    assets = pd.concat([run.assets for run in runs])
    trace = pd.concat([run.trace for run in runs])
    calls = pd.concat([run.calls for run in runs])
    ids = list(assets["asset_id"])
    asked = calls[calls["purpose"] == REFINEMENT_PURPOSE].groupby("asset_id").size().reindex(ids, fill_value=0)
    steps = trace[trace["proposer"].isin(STATE_STEPS)].groupby("asset_id")
    iterations = trace[trace["proposer"] == "model"].groupby("asset_id").size().reindex(ids, fill_value=0)
    moved = pd.concat([distances(run.findings, run.joints) for run in runs])
    good = int((assets["status"] == Status.OK.value).sum())
    return [
        str(len(ids)),
        mean_and_most(asked.astype(float), ".2f", ".0f"),
        mean_and_most(iterations.astype(float), ".2f", ".0f"),
        mean_and_most(first_steps(trace)["phi_before_mm"], ".1f", ".0f"),
        mean_and_most(steps["phi_after_mm"].min(), ".2f", ".1f"),
        mean_and_most(assets["penetration_mm"].dropna(), ".3f", ".2f"),
        mean_and_most(moved[~moved["slides"]]["distance"], ".3f", ".2f"),
        mean_and_most(MM_PER_M * moved[moved["slides"]]["distance"], ".1f", ".0f"),
        f"{good} of {len(ids)}",
    ]


def distances(findings: pd.DataFrame, joints: pd.DataFrame) -> pd.DataFrame:
    """A row for each joint that does not start where it was asked to: ``distance`` (rad, or m where it ``slides``)."""
    moved = findings[findings["code"] == "state_moved"].merge(joints[["asset_id", "joint", "type"]])
    away = (moved["value"] - moved["limit_value"]).abs()
    return pd.DataFrame({"distance": away, "slides": moved["type"] == "prismatic"})


def mean_and_most(values: "pd.Series[float]", mean: str, most: str) -> str:
    """The mean and, in brackets, the largest; a dash for no values."""
    if values.empty:
        return NOTHING
    return f"{format(float(values.mean()), mean)} ({format(values.max(), most)})"
