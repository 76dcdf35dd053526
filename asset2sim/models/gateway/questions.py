"""The questions that were asked, as files: what a report shows beside the answers. Pictures are named, not kept."""

import contextlib
import hashlib
import json
from pathlib import Path

from pydantic import ValidationError

from asset2sim.storage.regular_files import write_whole
from schemas.base import Frozen
from schemas.request import ModelRequest

FOLDER = ".cache/questions"
"""Under the output folder: shared by all assets, workers and runs."""


class AskedTurn(Frozen):
    """A later message of a conversation: the model's own, what a tool returned, or what the user added."""

    role: str
    content: str
    tools: tuple[str, ...] = ()


class Question(Frozen):
    """A question as it was sent: the system part's digest, the text, the pictures' labels, and the later turns."""

    system: str
    text: str
    images: tuple[str, ...] = ()
    turns: tuple[AskedTurn, ...] = ()


def keep_question(folder: Path, prompt_hash: str, request: ModelRequest) -> None:
    """Write a question under its hash, and its system part, which all assets share, once. Of a conversation, whose
    questions have one hash, the longest is kept. Disk errors are ignored."""
    turns = tuple(
        AskedTurn(
            role=turn.role, content=turn.content, tools=tuple(f"{c.name}({c.arguments})" for c in turn.tool_calls)
        )
        for turn in request.turns
    )
    system = hashlib.sha256(request.system.encode("utf-8", "replace")).hexdigest()[:16]
    labels = tuple(image.label for image in request.images)
    asked = Question(system=system, text=request.text, images=labels, turns=turns)
    before = read_question(folder, prompt_hash)
    if before is not None and len(before.turns) >= len(turns) and before.images == labels:
        return
    with contextlib.suppress(OSError):
        if not (folder / f"{system}.txt").is_file():
            write_whole(folder / f"{system}.txt", request.system.encode("utf-8", "replace"))
        write_whole(folder / f"{prompt_hash}.json", json.dumps(asked.model_dump()).encode())


def read_question(folder: Path, prompt_hash: str) -> Question | None:
    """The question of a hash; None where it is not kept, or its file is damaged."""
    try:
        return Question.model_validate_json((folder / f"{prompt_hash}.json").read_bytes())
    except (OSError, ValidationError):
        return None
