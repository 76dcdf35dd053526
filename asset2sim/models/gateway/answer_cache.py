"""Cache of model answers: one JSON file each, named by a hash of everything that could change the answer."""

import contextlib
import functools
import hashlib
import json
from importlib import import_module
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from pydantic import ValidationError

from asset2sim.storage.regular_files import write_whole
from schemas.extensions import offline_answers
from schemas.model_names import is_prior
from schemas.request import AnswerOrigin, LabelledImage, ModelRequest, ToolCall
from schemas.settings import ModelSettings

FOLDER = ".cache/answers"
"""Under the output folder: shared by all assets, workers and runs."""
VERSION = 1
"""Part of every key: raise it when requests or cache files change in form."""
MAX_FILE_BYTES = 16_000_000
"""Larger files are not read: this program writes none."""


class StoredAnswer(AnswerOrigin):
    """A cached answer. The question is not stored: its digest is the file's name, and its time that of the file."""

    model: str
    purpose: str
    prompt_hash: str
    content: str | None
    tool_calls: tuple[ToolCall, ...] = ()
    without_images: str | None = None


def answer_key(request: ModelRequest, settings: ModelSettings, shown: bool) -> str:
    """SHA-256 in hexadecimal over everything that the answer may depend on. The texts, turns, tools and schema; the
    pictures as they are sent (where the model is ``shown`` any); the model, the server (host, port and path) and the
    parameters; the tables of a prior; and the sample's number, so that repeats are answered anew."""
    server = urlsplit(settings.api_base or "")
    material: dict[str, Any] = {
        "version": VERSION,
        "system": request.system,
        "text": request.text,
        "images": _images(request.images) if shown else [],
        "turns": [
            [turn.role, turn.content, turn.call_id, [call.model_dump() for call in turn.tool_calls],
             _images(turn.images) if shown else []]
            for turn in request.turns
        ],
        "tools": [tool.model_dump() for tool in request.tools],
        "answer_schema": request.answer_schema,
        "sample": request.sample,
        "model": settings.model,
        "tables": tables_digest() if is_prior(settings.model) else "",
        "server": server.netloc.rpartition("@")[2] + server.path,
        "temperature": settings.temperature,
        "max_completion_tokens": settings.max_completion_tokens,
    }  # fmt: skip
    return hashlib.sha256(json.dumps(material, sort_keys=True).encode("ascii")).hexdigest()


@functools.cache
def tables_digest() -> str:
    """SHA-256 over the sources and tables of the offline model: another table is another model."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[3]
    for room in ("asset2sim/guidance", "asset2sim/models/prior"):
        for source in sorted((root / room).rglob("*")):
            if source.suffix in (".py", ".csv"):
                digest.update(source.read_bytes())
    digest.update((root / "schemas" / "guidance.py").read_bytes())
    for module in sorted({function.partition(":")[0] for function in offline_answers().values()}):
        digest.update(Path(str(import_module(module).__file__)).read_bytes())
    return digest.hexdigest()


def answer_file(key: str) -> str:
    """Name of the file that keeps the answer of a key."""
    return f"{key}.json"


def read_answer(folder: Path, key: str) -> StoredAnswer | None:
    """The answer kept under a key; None where there is none, or the file is damaged."""
    path = folder / answer_file(key)
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            return None
        stored = StoredAnswer.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return None
    return stored if stored.content or stored.tool_calls else None


def store_answer(folder: Path, key: str, answer: StoredAnswer) -> None:
    """Store an answer atomically: a concurrent reader sees the whole file or none. Disk errors are ignored."""
    with contextlib.suppress(OSError):
        write_whole(folder / answer_file(key), answer.model_dump_json().encode("utf-8", "replace"))


def _images(images: tuple[LabelledImage, ...]) -> list[list[str]]:
    return [[image.label, hashlib.sha256(image.png).hexdigest()] for image in images]
