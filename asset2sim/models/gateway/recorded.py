"""Recorded models, ``recorded/<folder>``: answers from files, by asset and purpose, in place of a model's.

``<asset_id>.json`` answers the synthesis (and, where it has no answer of its own, the direct method, whose answers have
the same fields), ``<asset_id>.<purpose>.json`` another purpose's first question, and
``<asset_id>.<purpose>.<n>.json`` the n-th, whatever it asks. A file holds the model's answer as it was; where that
called tools, it is a JSON object with ``tool_calls``. ``recording.json`` says where the answers came from, and may be
missing.
"""

import functools
import hashlib
import json
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from pydantic import Field, ValidationError

from asset2sim.models.gateway.answer_cache import MAX_FILE_BYTES
from asset2sim.models.prompts import DIRECT, SYNTHESIS
from schemas.base import Frozen
from schemas.errors import ModelError, UsageError
from schemas.model_names import RECORDED_FORM, is_recorded, named_models, recorded_folder
from schemas.request import AnswerOrigin, ModelRequest, Recording, ToolCall
from schemas.settings import ModelSettings

RECORDING = "recording.json"


class RecordingError(ModelError):
    """A recorded answer cannot be had; the message names the file and says what to do."""


class UnrecordedError(RecordingError):
    """The folder has no answer to this question."""


class ToolAnswer(Frozen):
    """The file of an answer that calls tools."""

    content: str | None = None
    tool_calls: tuple[ToolCall, ...] = Field(min_length=1)


@dataclass(frozen=True)
class RecordedAnswer:
    """An answer from ``file`` to a question of ``purpose``, and where it came from."""

    file: str
    purpose: str
    origin: AnswerOrigin
    content: str | None
    tool_calls: tuple[ToolCall, ...] = ()


def answer_names(asset_id: str, purpose: str, number: int = 1) -> tuple[str, ...]:
    """Names that the file of the answer to an asset's ``number``-th question of a purpose may have, first its usual."""
    names = [f"{asset_id}.{purpose}.{number}.json"]
    if number == 1:
        names.insert(0, f"{asset_id}.{purpose}.json")
        if purpose == SYNTHESIS and f"{asset_id}.json" != RECORDING:
            names.insert(0, f"{asset_id}.json")
    return tuple(names)


def find_answer(folder: Path, asset_id: str, request: ModelRequest, number: int) -> RecordedAnswer:
    """The recorded answer to the ``number``-th question of the request's purpose about an asset. Raises
    ``UnrecordedError`` where there is none, ``RecordingError`` for files that cannot be used."""
    names = answer_names(asset_id, request.purpose, number)
    there = [name for name in names if (folder / name).is_file()]
    purpose = request.purpose
    if not there and purpose == DIRECT:
        purpose = SYNTHESIS
        there = [name for name in answer_names(asset_id, purpose, number) if (folder / name).is_file()]
    if not there and not folder.is_dir():
        raise RecordingError(f"{folder} is not a folder on this machine, which asks; make it visible here")
    if not there:
        raise UnrecordedError(
            f"no answer is recorded to question {number} ({request.purpose}) about asset {asset_id}: put one into "
            f"{names[0]}, or name a model that can be asked"
        )
    if len(there) > 1:
        raise RecordingError(f"{' and '.join(there)} answer the same question; keep one of them")
    text = _read(folder / there[0])
    origin = origin_of(read_recording(folder), there[0])
    if request.tools and '"tool_calls"' in text:
        try:
            answer = ToolAnswer.model_validate_json(text)
        except ValidationError as error:
            raise RecordingError(f"{there[0]}: {_first(error)}") from None
        return RecordedAnswer(there[0], purpose, origin, answer.content, answer.tool_calls)
    return RecordedAnswer(there[0], purpose, origin, text)


def answer_text(content: str | None, tool_calls: tuple[ToolCall, ...] = ()) -> str:
    """Text of an answer's file, from which ``find_answer`` reads the same answer."""
    if not tool_calls:
        return content or ""
    return ToolAnswer(content=content, tool_calls=tool_calls).model_dump_json(indent=1)


def origin_of(recording: Recording, file: str) -> AnswerOrigin:
    """Where an answer came from, by its own entry, else by what the recording says of all."""
    own = recording.answers.get(file, AnswerOrigin())
    whole = {"model": own.model or recording.model, "prompt": own.prompt or recording.prompt}
    return own.model_copy(update=whole)


def read_recording(folder: Path) -> Recording:
    """The folder's ``recording.json``, empty without one. Raises ``RecordingError`` for one that cannot be read."""
    file = folder / RECORDING
    try:
        seen = file.stat()
    except OSError:
        return Recording()
    return _recording(file, seen.st_mtime_ns, seen.st_size)


@functools.lru_cache(maxsize=8)
def _recording(file: Path, _mtime_ns: int, _size: int) -> Recording:
    try:
        return Recording.model_validate_json(_read(file))
    except ValidationError as error:
        raise RecordingError(f"{file}: {_first(error)}; mend it, or remove the file") from None


def check_recorded(model: str) -> str:
    """Contents of a recorded model, in words. Raises ``UsageError`` for a folder without answers or with a
    ``recording.json`` that cannot be read."""
    folder = Path(recorded_folder(model))
    if not recorded_folder(model) or not folder.is_dir():
        raise UsageError(
            f"model '{model}': no folder {folder.resolve() if recorded_folder(model) else '<folder>'}; write it as "
            f"{RECORDED_FORM}, relative to where you are. `asset2sim record` makes one of a run, `asset2sim ask` "
            "writes questions to answer by hand"
        )
    try:
        recording = read_recording(folder)
    except RecordingError as error:
        raise UsageError(f"model '{model}': {error}") from error
    count = sum(name != RECORDING for name in answer_files(folder))
    if not count:
        raise UsageError(
            f"model '{model}': {folder.resolve()} holds no answers; each is a file such as <asset_id>.json, the answer "
            "to the synthesis"
        )
    models = dict.fromkeys(origin.model or recording.model for origin in recording.answers.values())
    named = ", ".join(name for name in models or (recording.model,) if name)
    return f"{count} recorded answers" + (f" of {named}" if named else "")


def answer_files(folder: Path) -> list[str]:
    """Names of the JSON files in a folder, in order."""
    return sorted(path.name for path in folder.iterdir() if path.suffix == ".json" and path.is_file())


def answer_digests(settings: ModelSettings, asset_ids: Iterable[str]) -> dict[str, str]:
    """Asset id → SHA-256 over its recorded answers and their origins, of all recorded models that the settings name; no
    entry for an asset without any. Raises ``UsageError`` for a folder that cannot be read."""
    wanted, lines = set(asset_ids), defaultdict[str, list[str]](list)
    for model in filter(is_recorded, named_models(settings)):
        folder = Path(recorded_folder(model))
        try:
            recording = read_recording(folder)
            for name in answer_files(folder):
                # An id may hold dots, so that several assets may own a file by its name.
                parts = name.split(".")
                owners = wanted.intersection(".".join(parts[:count]) for count in range(1, len(parts)))
                if owners:
                    content = hashlib.sha256((folder / name).read_bytes()).hexdigest()
                    line = f"{model}\0{name}\0{content}\0{origin_of(recording, name).model_dump_json()}\n"
                    for owner in owners:
                        lines[owner].append(line)
        except (OSError, RecordingError) as error:
            raise UsageError(f"model '{model}': {error}") from error
    return {owner: hashlib.sha256("".join(own).encode()).hexdigest() for owner, own in lines.items()}


def _read(file: Path) -> str:
    try:
        if file.stat().st_size > MAX_FILE_BYTES:
            raise RecordingError(f"{file.name} has over {MAX_FILE_BYTES} bytes, and is not read")
        text = file.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{file.name} cannot be read: {error}") from error
    if not text.strip():
        raise RecordingError(f"{file.name} is empty; put the answer into it, or remove it")
    return text


def _first(error: ValidationError) -> str:
    item = error.errors(include_url=False)[0]
    return f"{'.'.join(map(str, item['loc'])) or 'the file'}: {item['msg']}"


def json_text(value: Frozen) -> str:
    """A record as the JSON text of a file that people read, without fields that say nothing."""
    return json.dumps(value.model_dump(mode="json", exclude_none=True), indent=1, ensure_ascii=False) + "\n"
