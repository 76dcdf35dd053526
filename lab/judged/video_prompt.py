"""The question to a judge of videos, in which nothing says who made what, and its answer."""

import re
from collections.abc import Sequence

from pydantic import Field, field_validator

from asset2sim.gym.arm.tasks import Verb
from asset2sim.models.answers import InvalidFieldsError, strict_fit, trimmed
from asset2sim.models.lenient_json import parse_json
from asset2sim.models.prompts import data_block, system_text
from lab.judged.video_frames import FilmFrame
from lab.probes.tasks import PAPER11
from schemas.base import Frozen
from schemas.request import LabelledImage, ModelRequest

PURPOSE = "video_judge"
FULL = 5.0
MOTION_PROMPTS = {
    Verb.CLOSE: "The robot tries to push a part shut that stands open.",
    Verb.PRESS: "The robot tries to press a part down, and lets it go.",
    Verb.OPEN: "The robot tries to push a part further open.",
    Verb.TURN: "The robot tries to turn a part.",
    Verb.LAY: "The robot tries to lay a part over to its other side.",
    Verb.GRASP: "The robot tries to pick up the object and put it into the bowl.",
}
"""Verb → the judge's words for tasks that are none of the paper's, which have published words of their own."""
SHOWN = "You are shown candidate videos for the following motion prompt: '{}'"
"""The published first sentence of the question."""


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
        "candidates": len(candidates),
        "frames_each": max(len(frames) for frames in candidates),
    }
    return ModelRequest(
        purpose=f"{PURPOSE}-{re.sub(r'[^a-z0-9]+', '-', task.lower())[:24]}-{seed}",
        system=system_text(PURPOSE),
        text=f"{SHOWN.format(motion_prompt(task, verb))}\n\n{data_block('structured_information', information)}",
        images=tuple(
            LabelledImage(label=f"candidate {place}, {frame.time_s:.2f} s of {frame.length_s:.2f} s", png=frame.png)
            for place, frames in enumerate(candidates, start=1)
            for frame in frames
        ),
        answer_schema=trimmed(VideoAnswer.model_json_schema(), frozenset()),
        sample=seed,
    )


def motion_prompt(task: str, verb: str) -> str:
    """The sentence in which a judge is told a task: that of the paper for each of its eleven."""
    return PAPER11[task].motion_prompt if task in PAPER11 else MOTION_PROMPTS[Verb(verb)]


def parse_video_answer(text: str, count: int) -> tuple[CandidateAnswer, ...]:
    """A judge's answers on each of ``count`` candidates, in their order. Raises InvalidAnswerError for what does not
    fit."""
    answer = strict_fit(VideoAnswer, parse_json(text))
    found = sorted(answer.candidates, key=lambda item: item.index)
    if [item.index for item in found] != list(range(1, count + 1)):
        said = ", ".join(str(item.index) for item in answer.candidates) or "none"
        raise InvalidFieldsError([f"candidates: their indices are {said}; 1 to {count} are wanted, each once"])
    return tuple(found)
