"""The judge that needs no model: what the physical judge measured of a recording, as a row of ``video_scores``.

The score is a formula over its findings (``lab.trials.physical_judge.score``): nobody looked at the film.
"""

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import pandas as pd

from lab.schemas.tables import VIDEO_SCORES
from lab.trials.physical_judge import FAULTS
from schemas.table import Row

PHYSICAL_JUDGE = "physical-judge"
"""Its name in the table, and for ``--judges``."""


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
    for name, fault in FAULTS.items():
        if found[name] is True:
            yield fault.words.format(**found)
