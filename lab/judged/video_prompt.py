"""The question to a judge of videos, in which nothing says who made what, and its answer."""

import re
from collections.abc import Sequence

from pydantic import Field, field_validator

from asset2sim.gym.arm.tasks import Verb
from asset2sim.models.answers import InvalidFieldsError, strict_fit, trimmed
from asset2sim.models.lenient_json import parse_json
from asset2sim.models.prompts import data_block, system_text
from lab.judged.video_frames import FilmFrame
from schemas.base import Frozen
from schemas.request import LabelledImage, ModelRequest

PURPOSE = "video_judge"
FULL = 5.0
DONE = {
    Verb.CLOSE: "a part that stands open is pushed shut",
    Verb.PRESS: "a part is pressed down and let go",
    Verb.OPEN: "a part is pushed further open",
    Verb.GRASP: "the object is grasped, lifted and put into the bowl",
}
"""What a verb means, for the judge."""


class CandidateAnswer(Frozen):
    """A judge's answer on one candidate."""

    index: int
    description: str
    pros: str
    cons: str
    score: float = Field(ge=0.0, le=FULL)

    @field_validator("score")
    @classmethod
    def _halves(cls, value: float) -> float:
        if (2.0 * value) % 1.0:
            raise ValueError("a score is a whole number or a half")
        return value


class VideoAnswer(Frozen):
    """A judge's whole answer."""

    candidates: tuple[CandidateAnswer, ...]


def video_request(task: str, verb: str, candidates: Sequence[Sequence[FilmFrame]], seed: int) -> ModelRequest:
    """The question about the films of a task, in the order in which they are shown. ``seed`` is that of the order: the
    answer cache and a recorded judge know the trial by it."""
    information = {
        "purpose": PURPOSE,
        "task": task,
        "done": DONE[Verb(verb)],
        "candidates": len(candidates),
        "frames_each": max(len(frames) for frames in candidates),
    }
    return ModelRequest(
        purpose=f"{PURPOSE}-{re.sub(r'[^a-z0-9]+', '-', task.lower())[:24]}-{seed}",
        system=system_text(PURPOSE),
        text=data_block("structured_information", information),
        images=tuple(
            LabelledImage(label=f"candidate {place}, {frame.time_s:.2f} s of {frame.length_s:.2f} s", png=frame.png)
            for place, frames in enumerate(candidates, start=1)
            for frame in frames
        ),
        answer_schema=trimmed(VideoAnswer.model_json_schema(), frozenset()),
        sample=seed,
    )


def parse_video_answer(text: str, count: int) -> tuple[CandidateAnswer, ...]:
    """A judge's answers on each of ``count`` candidates, in their order. Raises InvalidAnswerError for what does not
    fit."""
    answer = strict_fit(VideoAnswer, parse_json(text))
    found = sorted(answer.candidates, key=lambda item: item.index)
    if [item.index for item in found] != list(range(1, count + 1)):
        said = ", ".join(str(item.index) for item in answer.candidates) or "none"
        raise InvalidFieldsError([f"candidates: their indices are {said}; 1 to {count} are wanted, each once"])
    return tuple(found)
