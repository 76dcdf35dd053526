"""Log of a model's refused answers, one text file per asset."""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from schemas.request import ModelAnswer, ModelCall, ModelRequest
from schemas.secret import redact_answer

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
