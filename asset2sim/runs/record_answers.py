"""A recorded model's folder, which anybody can run without a key: questions as files (prompt, facts, pictures), to be
answered by a person or a program, and a run's answers. Asked again, it has the questions that follow."""

import json
import tempfile
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from importlib import metadata
from pathlib import Path

import pandas as pd

from asset2sim.baselines.declared_method import known_methods
from asset2sim.catalog.read import latest_rows
from asset2sim.models.gateway import answer_cache
from asset2sim.models.gateway.ask import prompt_hash, prompt_title
from asset2sim.models.gateway.chat_messages import downscaled
from asset2sim.models.gateway.recorded import (
    RECORDING,
    RecordingError,
    UnrecordedError,
    answer_names,
    answer_text,
    find_answer,
    json_text,
    origin_of,
    read_recording,
)
from asset2sim.runs.asset_attempt import attempt_in_child
from asset2sim.runs.remote.transfer import run_with_local_files
from asset2sim.storage.objects import working_folder
from asset2sim.validation.second_look import ENDS
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.location import Location
from schemas.model_names import is_recorded, recorded_folder
from schemas.request import AnswerOrigin, ModelAnswer, ModelRequest, Recording
from schemas.settings import Settings

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


FOLDER = "questions"
ANY_MODEL = "any/model"
"""Model of the settings with which questions are made: a name that stands for one that looks at pictures."""


Unanswered = list[tuple[str, ModelRequest]]
"""Name of the file in which an answer is missing, and its question."""


@dataclass
class Questions:
    """Origin of the answer to come to each question, by the name of its file; why an asset cannot be asked about; and
    the assets whose every question has its answer."""

    origins: dict[str, AnswerOrigin] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)
    answered: list[str] = field(default_factory=list)


def write_questions(refs: Sequence[AssetRef], folder: Path, settings: Settings, pipeline: str) -> Questions:
    """Write the questions about each asset that have no answer in ``folder`` yet, below ``folder/questions``, and what
    is known of the answers to come into its ``recording.json``. A question that follows from an answer is written once
    that is there: call it again. ``pipeline`` is a ``module:function``. An asset that cannot be asked about is in
    ``failed``. Raises UsageError for a method that asks nothing, or a folder that cannot be read or written to."""
    methods = known_methods()
    if settings.method in methods and not methods[settings.method].asks:
        raise UsageError(
            f"method {settings.method.value} asks no model; choose from: "
            f"{', '.join(method.value for method, declared in methods.items() if declared.asks)}"
        )
    try:
        recording = read_recording(folder)
        folder.mkdir(parents=True, exist_ok=True)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    model = settings.model.model_copy(update={"model": ANY_MODEL, "refinement_model": None, "judge_model": None})
    settings = settings.model_copy(update={"model": model})
    written = Questions()
    with (
        tempfile.TemporaryDirectory(prefix="asset2sim-ask-") as scratch,
        ThreadPoolExecutor(settings.run.workers) as pool,
    ):
        done = pool.map(lambda ref: questions_about(ref, folder, Path(scratch), settings, pipeline), refs)
        for ref, (unanswered, asked, reason) in zip(refs, done, strict=True):
            if not unanswered and asked:
                written.answered.append(ref.asset_id)
            elif not unanswered:
                written.failed[ref.asset_id] = reason
            # One by one: the pictures of a large dataset are gigabytes.
            for answer, request in unanswered:
                files = question_files(answer, downscaled(request, settings.model.image_side_px))
                written.origins[answer] = AnswerOrigin(prompt=prompt_title(request), prompt_hash=prompt_hash(request))
                write_files(folder, files, recording)
    known = {name: recording.answers.get(name, origin) for name, origin in written.origins.items()}
    both = {"answers": dict(sorted((recording.answers | known).items()))}
    write_files(folder, {}, recording.model_copy(update=both))
    return written


def questions_about(
    ref: AssetRef, folder: Path, scratch: Path, settings: Settings, pipeline: str
) -> tuple[Unanswered, int, str]:
    """The questions about an asset without an answer in the folder, how many were asked in all, and why the asset
    failed, if so. It runs in a child process; an answer that cannot be read counts as none."""
    numbers, unanswered = Counter[str](), Unanswered()

    def answer(request: ModelRequest) -> ModelAnswer:
        numbers[request.purpose] += 1
        try:
            found = find_answer(folder, ref.asset_id, request, numbers[request.purpose])
        except UnrecordedError:
            name = answer_names(ref.asset_id, request.purpose, numbers[request.purpose])[0]
            unanswered.append((name, request))
            return ModelAnswer(content=None, calls=(), error="the question is written to a file", unrecorded=True)
        except RecordingError as error:
            return ModelAnswer(content=None, calls=(), error=str(error))
        return ModelAnswer(content=found.content, calls=(), tool_calls=found.tool_calls)

    attempt = partial(attempt_in_child, pipeline, out=scratch, settings=settings, ask=answer)
    local = not Location(ref.path).is_url
    record = (attempt(ref) if local else run_with_local_files(ref, Location(scratch), settings, attempt)).record
    # What follows from which end is closed is asked once that is answered.
    first = [item for item in unanswered if item[1].purpose == ENDS]
    return first or unanswered, numbers.total(), record.reason


def question_files(answer: str, request: ModelRequest) -> dict[str, bytes]:
    """The files of one question, whose answer goes into ``answer``, by their names in the recorded model's folder."""
    place = f"{FOLDER}/{answer.removesuffix('.json')}"
    pictures = {f"{image.label}.png": image.png for image in request.images}
    shown = "\n\n".join(f"Image: {name.removesuffix('.png')}\n\n![{name}]({name})" for name in pictures)
    schema = json.dumps(request.answer_schema, indent=1)
    text = (
        f"Write the answer, one JSON object, into `../../{answer}`.\n\n---\n\n{request.system}\n\n---\n\n{request.text}"
        f"\n\n{shown}\n\n---\n\nThe JSON Schema of the answer:\n\n```json\n{schema}\n```\n"
    )
    plain = {
        "answer_file": f"../../{answer}",
        "system": request.system,
        "text": request.text,
        "images": list(pictures),
        "answer_schema": request.answer_schema,
    }
    files = {"question.md": text.encode(), "question.json": json.dumps(plain, indent=1, ensure_ascii=False).encode()}
    return {f"{place}/{name}": data for name, data in (files | pictures).items()}
