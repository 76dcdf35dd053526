"""Model calls with the question as it was sent and the answer as it came, as far as OUT's folder keeps them."""

import contextlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asset2sim.catalog.read import FrameRow
from asset2sim.models.gateway import answer_cache, questions
from asset2sim.models.gateway.questions import REFUSED, Question, answers_file
from asset2sim.models.gateway.recorded import answer_text
from schemas.model_names import described, is_recorded, recorded_folder


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
