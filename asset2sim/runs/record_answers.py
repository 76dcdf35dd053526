"""A run's answers as a folder of a recorded model, which anybody can run again without a key."""

from collections import Counter
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

import pandas as pd

from asset2sim.catalog.read import latest_rows
from asset2sim.models.gateway import answer_cache
from asset2sim.models.gateway.recorded import (
    RECORDING,
    RecordingError,
    answer_names,
    answer_text,
    json_text,
    origin_of,
    read_recording,
)
from asset2sim.storage.objects import working_folder
from schemas.errors import UsageError
from schemas.location import Location
from schemas.model_names import is_recorded, recorded_folder
from schemas.request import AnswerOrigin, Recording

ANSWERED = ("ok", "invalid_answer", "cached")
"""Outcomes of calls that had an answer."""


@dataclass
class AnswerFiles:
    """Answers to record: file name → text and origin; their assets and methods; and, for each answer that is not kept,
    the asset, the purpose and why."""

    texts: dict[str, bytes] = field(default_factory=dict)
    origins: dict[str, AnswerOrigin] = field(default_factory=dict)
    assets: set[str] = field(default_factory=set)
    methods: set[str] = field(default_factory=set)
    lost: list[str] = field(default_factory=list)


def record_answers(out: Path | str, folder: Path) -> AnswerFiles:
    """Write the answers of the latest run in ``out`` into ``folder``, beside what it holds, and its ``recording.json``.
    Raises UsageError, with nothing written, where there are none or the folder holds others under their names."""
    (calls,) = latest_rows(out, "model_calls")
    found = collect(calls, working_folder(Location(out)) / answer_cache.FOLDER)
    if not found.texts:
        why = f" ({found.lost[0]}, …)" if found.lost else ": it made no model calls"
        raise UsageError(f"{out}: its latest run left no answers to record{why}")
    others = [name for name, text in found.texts.items() if _differs(folder / name, text)]
    if others:
        raise UsageError(f"{folder} holds another answer in {', '.join(sorted(others)[:5])}; choose another folder")
    try:
        before = read_recording(folder)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    recording = before.model_copy(
        update={
            "methods": tuple(sorted({*before.methods, *found.methods})),
            "recorded_at": datetime.now(UTC).replace(microsecond=0),
            "asset2sim": metadata.version("asset2sim"),
            "answers": dict(sorted((before.answers | found.origins).items())),
        }
    )
    write_files(folder, found.texts, recording)
    return found


def write_files(folder: Path, texts: dict[str, bytes], recording: Recording) -> None:
    """Write files and the ``recording.json`` of a recorded model. Raises UsageError where the folder takes none."""
    try:
        for name, text in texts.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(text)
        (folder / RECORDING).write_text(json_text(recording), encoding="utf-8")
    except OSError as error:
        raise UsageError(f"{folder}: {error.strerror}; choose another folder") from error


def collect(calls: pd.DataFrame, answers: Path) -> AnswerFiles:
    """The kept answers of rows of ``model_calls``, in the order in which they were asked for; ``answers`` is the
    answer cache. An answer that was asked for twice counts once, as after an attempt that died."""
    found, numbers, seen = AnswerFiles(), Counter[tuple[str, str]](), set[tuple[str, str, str]]()
    for row in calls.sort_values(["asset_id", "call_index"]).to_dict("records"):
        asset_id, purpose, file = str(row["asset_id"]), str(row["purpose"]), row.get("answer_file")
        if row["outcome"] not in ANSWERED:
            continue
        if not isinstance(file, str):
            found.lost.append(f"asset {asset_id}, {purpose}: not kept, with --no-answer-cache or by an earlier version")
            continue
        if (asset_id, purpose, file) in seen:
            continue
        seen.add((asset_id, purpose, file))
        numbers[asset_id, purpose] += 1
        name = answer_names(asset_id, purpose, numbers[asset_id, purpose])[0]
        answer = _answer(str(row["call_model"]), answers, file)
        if answer is None:
            found.lost.append(f"asset {asset_id}, {purpose}: {file} is gone")
            continue
        found.texts[name], found.origins[name] = answer
        found.assets.add(asset_id)
        found.methods.add(str(row["method"]))
    return found


def _answer(model: str, answers: Path, file: str) -> tuple[bytes, AnswerOrigin] | None:
    """Text and origin of an answer; None where its file is gone."""
    try:
        if is_recorded(model):
            folder = Path(recorded_folder(model))
            return (folder / file).read_bytes(), origin_of(read_recording(folder), file)
        stored = answer_cache.read_answer(answers, Path(file).stem)
        if stored is None:
            return None
        answered = datetime.fromtimestamp((answers / file).stat().st_mtime, UTC).replace(microsecond=0)
    except (OSError, RecordingError):
        return None
    known = {name: getattr(stored, name) for name in AnswerOrigin.model_fields} | {"answered_at": answered}
    return answer_text(stored.content, stored.tool_calls).encode(), AnswerOrigin(**known)


def _differs(file: Path, text: bytes) -> bool:
    return file.exists() and (not file.is_file() or file.read_bytes() != text)
