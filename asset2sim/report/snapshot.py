"""The catalog as the report reads it, and each model call with its question and answer, as far as OUT keeps them."""

import contextlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from asset2sim.catalog.changes import like_latest
from asset2sim.catalog.read import FrameRow, TableSlice, read_assets, read_tables, rows
from asset2sim.models.gateway import answer_cache, questions
from asset2sim.models.gateway.questions import REFUSED, Question, answers_file
from asset2sim.models.gateway.recorded import answer_text
from schemas.errors import UsageError
from schemas.model_names import described, is_recorded, recorded_folder
from schemas.table import ASSET_KEY
from schemas.tables import HISTORY

COLUMNS = (
    *ASSET_KEY, "run_id", "content_hash", "refined_path", "source_path", "category", "prompt", "status", "failure_mode",
    "reason", "support", "size_x_m", "size_y_m", "size_z_m", "mass_kg", "penetration_mm", "seconds_total", "cost_usd",
)  # fmt: skip
"""Columns of an asset that index, pages and pictures need: whole rows take five times the memory."""
NEEDED: Mapping[str, TableSlice] = {
    "assets": TableSlice(columns=COLUMNS),
    "runs": TableSlice(),
    "joints": TableSlice(columns=("position_unit", "damping")),
    "interactions": TableSlice((*ASSET_KEY, "test", "way", "value"), [("test", "==", "effort")]),
    HISTORY.name: TableSlice(("run_id", *ASSET_KEY, "failure_mode")),
}
"""Columns of the tables that an index shows: few, and few rows of the largest, so that ten thousand assets fit."""


@dataclass(frozen=True)
class Snapshot:
    """Table name → its rows, as far as ``NEEDED``, but for those of assets: these are ``assets``, of ``COLUMNS`` alone;
    ``runs`` are those that can be compared with the latest, oldest first, it included; and ``modes`` are run id →
    (asset, method, model) → failure mode, of the latest and the run before."""

    tables: Mapping[str, pd.DataFrame]
    assets: tuple[FrameRow, ...]
    runs: tuple[FrameRow, ...]
    modes: Mapping[str, Mapping[tuple[str, ...], str]]

    @property
    def run(self) -> FrameRow:
        """The latest run."""
        return self.runs[-1]

    @property
    def before(self) -> FrameRow | None:
        """The run before it over the same part of the dataset, by the same method and model."""
        return self.runs[-2] if len(self.runs) > 1 else None


def read_snapshot(out: Path | str) -> Snapshot:
    """The catalog of OUT, a folder or a URL. Raises UsageError where there is none, or no run in it."""
    tables = read_tables(out, NEEDED, lambda runs: [row["run_id"] for row in rows(like_latest(runs))[-2:]])
    runs = rows(like_latest(tables["runs"]))
    if not runs:
        raise UsageError(f"{out}: its catalog has no run; refine a dataset into it first")
    modes: dict[str, dict[tuple[str, ...], str]] = {row["run_id"]: {} for row in runs[-2:]}
    for row in rows(tables[HISTORY.name]):
        modes[row["run_id"]][tuple(row[name] for name in ASSET_KEY)] = row["failure_mode"]
    # A catalog that an earlier version wrote may lack a column.
    assets = tables.pop("assets").reindex(columns=list(COLUMNS))
    return Snapshot(tables, tuple(rows(assets)), tuple(runs), modes)


def newest_rows(found: Snapshot) -> dict[str, FrameRow]:
    """Asset id → its row that was written last, whichever its method and model: the one whose folder OUT has."""
    runs = found.tables["runs"].sort_values("started_at", kind="stable")["run_id"]
    at = {run_id: place for place, run_id in enumerate(runs)}
    return {row["asset_id"]: row for row in sorted(found.assets, key=lambda row: at.get(row["run_id"], len(at)))}


def rows_of(out: Path, assets: Sequence[str]) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Table name → asset id → its rows, for these assets only."""
    found: dict[str, dict[str, list[dict[str, Any]]]] = {}
    for name, table in read_assets(out, assets).items():
        found[name] = {}
        for row in rows(table):
            found[name].setdefault(row["asset_id"], []).append(row)
    return found


@dataclass(frozen=True)
class Exchange:
    """One call: its row, the question (None: not kept), the answer (None: not kept), and the name of its model."""

    call: FrameRow
    question: Question | None
    answer: str | None
    model: str


def exchanges_of(out: Path, calls: Sequence[FrameRow]) -> list[Exchange]:
    """An asset's calls in their order; ``out`` is the folder of this machine in which OUT's caches lie."""
    return [
        Exchange(call, read_question(out, call), read_answer(out, call), described(str(call["call_model"])))
        for call in sorted(calls, key=lambda call: call["call_index"])
    ]


def read_question(out: Path, call: FrameRow) -> Question | None:
    """The question of a call; None where it is not kept here."""
    return questions.read_question(out / questions.FOLDER, str(call["prompt_hash"]))


def read_answer(out: Path, call: FrameRow) -> str | None:
    """The answer of a call, indented where it is JSON; None where it is not kept here."""
    text, file = None, call.get("answer_file")
    with contextlib.suppress(OSError, UnicodeError):
        if file is not None and is_recorded(str(call["call_model"])):
            text = (Path(recorded_folder(str(call["call_model"]))) / file).read_text(encoding="utf-8")
        elif file is not None:
            stored = answer_cache.read_answer(out / answer_cache.FOLDER, Path(file).stem)
            text = None if stored is None else answer_text(stored.content, stored.tool_calls)
        elif call["outcome"] == REFUSED:
            text = answers_file(out, str(call["asset_id"])).read_text(encoding="utf-8")
    return None if text is None else _indented(text)


def _indented(text: str) -> str:
    try:
        value: Any = json.loads(text)
    except ValueError:
        return text
    return json.dumps(value, indent=1, ensure_ascii=False)
