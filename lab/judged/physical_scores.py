"""The judge that needs no model: what the physical judge measured of a recording, as a row of ``video_scores``.

The score is a formula over its findings (``lab.trials.physical_judge.score``): nobody looked at the film.
"""

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import pandas as pd

from lab.schemas.tables import VIDEO_SCORES
from schemas.table import Row

PHYSICAL_JUDGE = "physical-judge"
"""Its name in the table, and for ``--judges``."""
FAULTS = {
    "moved_before_contact": "it moved {moved_rad:.2g} rad or {moved_m:.2g} m before it was touched",
    "energy_appeared": "energy appeared, enough to lift it by {appeared_m:.2g} m",
    "jumped": "an impulse that no touch explains, worth {impulse_m_s:.2g} m/s",
    "overlapped": "the tool was {overlap_m:.2g} m deep in it",
    "rang": "it swung to and fro {ringing_turns} times after it was let go",
    "forced": "the tool pressed on it with {force_n:.0f} N",
    "tipped": "it was tipped by {tilted_rad:.2g} rad",
}
"""Fault → what it is, with its number."""


def physical_scores(trials: pd.DataFrame) -> list[Row]:
    """A row for each recorded trial of these, by the formula: one trial only, as it always comes out the same."""
    now = datetime.now(UTC)
    rows: list[Row] = []
    for found in trials.dropna(subset=["score"]).to_dict("records"):
        who = {name: found[name] for name in ("task", "asset_id", "method", "model")}
        rows.append(
            dict.fromkeys(VIDEO_SCORES.schema.names)
            | who
            | {"run_id": found["run_id"] if isinstance(found["run_id"], str) else None, "judge": PHYSICAL_JUDGE}
            | {"trial": 0, "trials": 1, "score": float(found["score"]), "cost_usd": 0.0, "judged_at": now}
            | {"description": _description(found), "pros": _pros(found), "cons": "; ".join(_cons(found))}
        )
    return rows


def _description(found: dict[Any, Any]) -> str:
    if pd.isna(found["first_contact_s"]):
        return "measured, not looked at: never touched"
    force = f"pushed with up to {found['force_n']:.2g} N"
    return f"measured, not looked at: first touched after {found['first_contact_s']:.2f} s, {force}, {found['outcome']}"


def _pros(found: dict[Any, Any]) -> str:
    done = ["the task is done"] if found["outcome"] == "done" else []
    return "; ".join(done + ([] if any(found[name] is True for name in FAULTS) else ["none of the faults looked for"]))


def _cons(found: dict[Any, Any]) -> Iterator[str]:
    if found["outcome"] != "done":
        yield f"{found['outcome']}: {found['reason']}"
    for name, text in FAULTS.items():
        if found[name] is True:
            yield text.format(**found)
