"""Files for people: questions as they were asked, which a report shows beside the answers, and refused answers."""

import contextlib
import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from asset2sim.storage.regular_files import write_whole
from schemas.base import Frozen
from schemas.request import ModelAnswer, ModelCall, ModelRequest
from schemas.secret import redact_answer

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


LOG_FOLDER = "logs"
MAX_ANSWER_CHARACTERS = 100_000
"""Characters kept of one answer: more than the largest object's overlay has."""
MAX_FILE_BYTES = 2_000_000
"""File size from which no answer is added, bytes."""
REFUSED = "invalid_answer"
"""The outcome of a call whose answer was refused."""


@dataclass(frozen=True)
class LoggedAnswer:
    """One request, without its images, and the model's answer."""

    request: ModelRequest
    answer: ModelAnswer

    @staticmethod
    def of(request: ModelRequest, answer: ModelAnswer) -> "LoggedAnswer":
        """The request and its answer, without what is not logged."""
        slim = request.model_copy(update={"images": (), "turns": (), "tools": (), "text": "", "answer_schema": None})
        content = None if answer.content is None else answer.content[: 2 * MAX_ANSWER_CHARACTERS]
        return LoggedAnswer(slim, answer.model_copy(update={"content": content}))


def answers_file(out: Path, asset_id: str) -> Path:
    """Where the refused answers of one asset are kept, if there are any."""
    return out / LOG_FOLDER / f"{asset_id}.answers.txt"


def write_refused_answers(out: Path, asset_id: str, heard: Sequence[LoggedAnswer], calls: Sequence[ModelCall]) -> None:
    """Write the answers that the asset's record marks as refused, in place of those of an earlier run. A record's call
    and its answer's call are equal in every field but the outcome, the latency included."""
    with contextlib.suppress(OSError):
        answers_file(out, asset_id).unlink(missing_ok=True)
    refused = {call.model_copy(update={"outcome": ""}) for call in calls if call.outcome == REFUSED}
    for item in heard:
        last = item.answer.calls[-1:]
        if any(call.model_copy(update={"outcome": ""}) in refused for call in last):
            append_refused_answer(out, asset_id, item.request, answer_text(item.answer))


def append_refused_answer(out: Path, asset_id: str, request: ModelRequest, text: str) -> None:
    """Append a refused answer to the asset's file, shortened and without keys; disk errors are ignored."""
    path = answers_file(out, asset_id)
    text = redact_answer(text)
    if len(text) > MAX_ANSWER_CHARACTERS:
        more = len(text) - MAX_ANSWER_CHARACTERS
        text = f"{text[:MAX_ANSWER_CHARACTERS]}\n… ({more} characters more)"
    title = f"refused answer to '{request.purpose}'" + (f", sample {request.sample}" if request.sample else "")
    with contextlib.suppress(OSError):
        if path.exists() and path.stat().st_size > MAX_FILE_BYTES:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8", errors="replace") as file:
            file.write(f"--- {title} ---\n{text}\n\n")


def answer_text(answer: ModelAnswer) -> str:
    """Text of a model's answer, with its tool calls below."""
    wishes = [f"{call.name}({call.arguments})" for call in answer.tool_calls]
    return "\n".join([answer.content or "", *wishes]).strip()
