"""The questions that a run would ask, as files: prompt, facts and pictures of each asset, for a person or another
program to answer. The folder is then a recorded model."""

import json
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from asset2sim.models.gateway.ask import prompt_hash, prompt_title
from asset2sim.models.gateway.chat_messages import downscaled
from asset2sim.models.gateway.recorded import RecordingError, answer_names, read_recording
from asset2sim.runs.asset_attempt import attempt_in_child
from asset2sim.runs.record_answers import write_files
from asset2sim.runs.remote.transfer import run_with_local_files
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.location import Location
from schemas.recording import AnswerOrigin
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import Settings
from schemas.vocabulary import Method

FOLDER = "questions"
METHODS = (Method.ASSET2SIM, Method.NO_SEMANTICS, Method.DIRECT)
"""Methods whose question can be written ahead: the others ask on from the answers, many times, or not."""
ANY_MODEL = "any/model"
"""Model of the settings with which questions are made: a name that stands for one that looks at pictures."""


@dataclass
class Questions:
    """Origin of the answer to come to each question, by the name of its file, and why an asset has none."""

    origins: dict[str, AnswerOrigin] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)


def write_questions(refs: Sequence[AssetRef], folder: Path, settings: Settings, pipeline: str) -> Questions:
    """Write the question about each asset below ``folder/questions``, and what is known of the answers to come into
    its ``recording.json``; answers that are there stay. ``pipeline`` is a ``module:function``. An asset that cannot be
    asked about is in ``failed``. Raises UsageError for another method, or a folder that cannot be written to."""
    if settings.method not in METHODS:
        raise UsageError(
            f"method {settings.method.value} has no question that can be written ahead; choose from: "
            f"{', '.join(METHODS)}, or run it and record its answers"
        )
    try:
        recording = read_recording(folder)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    model = settings.model.model_copy(update={"model": ANY_MODEL, "refinement_model": None, "judge_model": None})
    settings = settings.model_copy(update={"model": model})
    written = Questions()
    with (
        tempfile.TemporaryDirectory(prefix="asset2sim-ask-") as scratch,
        ThreadPoolExecutor(settings.run.workers) as pool,
    ):
        done = pool.map(lambda ref: question_of(ref, Path(scratch), settings, pipeline), refs)
        for ref, (request, reason) in zip(refs, done, strict=True):
            if request is None:
                written.failed[ref.asset_id] = reason
                continue
            files, answer = question_files(ref.asset_id, downscaled(request, settings.model.image_side_px))
            written.origins[answer] = AnswerOrigin(prompt=prompt_title(request), prompt_hash=prompt_hash(request))
            # One by one: the pictures of a large dataset are gigabytes.
            write_files(folder, files, recording)
    known = {name: recording.answers.get(name, origin) for name, origin in written.origins.items()}
    both = {"answers": dict(sorted((recording.answers | known).items()))}
    write_files(folder, {}, recording.model_copy(update=both))
    return written


def question_of(ref: AssetRef, scratch: Path, settings: Settings, pipeline: str) -> tuple[ModelRequest | None, str]:
    """The first question about an asset; None, and why, where the asset fails before. It runs in a child process."""
    asked: list[ModelRequest] = []

    def keep(request: ModelRequest) -> ModelAnswer:
        asked.append(request)
        return ModelAnswer(content=None, calls=(), error="the question is written to a file")

    attempt = partial(attempt_in_child, pipeline, out=scratch, settings=settings, ask=keep)
    local = not Location(ref.path).is_url
    record = (attempt(ref) if local else run_with_local_files(ref, Location(scratch), settings, attempt)).record
    return (asked[0], "") if asked else (None, record.reason)


def question_files(asset_id: str, request: ModelRequest) -> tuple[dict[str, bytes], str]:
    """The files of one question by their names in the recorded model's folder, and the name of its answer's file."""
    place, answer = f"{FOLDER}/{asset_id}", answer_names(asset_id, request.purpose)[0]
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
    return {f"{place}/{name}": data for name, data in (files | pictures).items()}, answer
