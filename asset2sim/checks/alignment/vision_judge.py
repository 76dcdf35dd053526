"""A vision model's score of how well an asset is what was asked for (paper, evaluation, section 2)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from PIL import Image
from pydantic import ValidationError

from asset2sim.checks.alignment.align import final_positions
from asset2sim.models.ask_overlay import MAX_ASKS, ask_until_valid
from asset2sim.models.lenient_json import parse_json
from asset2sim.models.prompts import data_block, system_text
from asset2sim.render import png_bytes
from schemas.alignment import Score
from schemas.asset import AssetRecord
from schemas.base import Fraction, Frozen
from schemas.errors import InvalidAnswerError
from schemas.finding import Finding, warning
from schemas.request import LabelledImage, ModelAnswer, ModelCall, ModelRequest
from schemas.vocabulary import Stage

JUDGE = "judge"
LONGEST_REASON = 400
"""Characters kept of each of the judge's reasons."""


class HalfAnswer(Frozen):
    """A judge's score of one half, with its reason."""

    score: Fraction
    reason: str


class JudgeAnswer(Frozen):
    """A judge's whole answer."""

    scale: HalfAnswer
    state: HalfAnswer


@dataclass(frozen=True)
class Judgement:
    """A judge's score (None without a valid answer), every model call made for it, and why there is no score."""

    score: Score | None
    calls: tuple[ModelCall, ...]
    findings: tuple[Finding, ...] = ()


def judge(
    record: AssetRecord, views: Mapping[str, Image.Image], ask: Callable[[ModelRequest], ModelAnswer]
) -> Judgement:
    """The judge's score of a record that has features and an overlay: half scale, half state, 0 to 1 together.
    ``views`` maps a view's name to its picture. An answer that does not fit is asked for once more with what was wrong;
    a judge that fails leaves a warning, never a failed asset."""
    said = ask_until_valid(judge_request(record, views), ask, parse_answer)
    last = said.answers[-1]
    if said.value is None:
        why = last.error or "the judge did not answer"
        if last.content is not None:
            why = f"the judge answered {MAX_ASKS} times and no answer fits: {said.refused[-1]}"
        return Judgement(None, said.calls, (warning(Stage.ALIGN, "not_judged", f"no judge's score: {why}"),))
    unseen = last.without_images
    blind = (
        ()
        if unseen is None
        else (warning(Stage.ALIGN, "judged_without_views", f"the judge saw no pictures: {unseen}"),)
    )
    return Judgement(_score(said.value), said.calls, blind)


def judge_request(record: AssetRecord, views: Mapping[str, Image.Image]) -> ModelRequest:
    """The question: what was asked for, the pictures, and the size and joints as they are in the end."""
    overlay, features = record.overlay, record.features
    assert overlay is not None and features is not None
    positions = final_positions(record)
    joints = []
    labels = {link.name: link.label for link in features.links}
    for joint in features.movable_joints:
        factor = overlay.scale if joint.prismatic else 1.0
        closed, opened = factor * (joint.closed or 0.0), factor * (joint.open or 0.0)
        position = positions.get(joint.name)
        share = None if position is None or closed == opened else (position - closed) / (opened - closed)
        joints.append(
            {
                "name": joint.name,
                "type": joint.type,
                "label": labels.get(joint.child, ""),
                "position": position,
                "closed": closed,
                "open": opened,
                "open_share": share,
            }
        )
    information = {
        "purpose": JUDGE,
        "category": features.category,
        "size_m": [overlay.scale * edge for edge in features.rest_size],
        "joints": joints,
    }
    blocks = (data_block("structured_information", information), data_block("user_guidance", record.ref.prompt or ""))
    return ModelRequest(
        purpose=JUDGE,
        system=system_text(JUDGE),
        text="\n\n".join(blocks),
        images=tuple(LabelledImage(label=name, png=png_bytes(picture)) for name, picture in views.items()),
        answer_schema=JudgeAnswer.model_json_schema(),
    )


def parse_answer(text: str) -> JudgeAnswer:
    """The scores in a judge's answer. Raises InvalidAnswerError, naming every field that does not fit."""
    value = parse_json(text)
    try:
        return JudgeAnswer.model_validate(value)
    except ValidationError as error:
        lines = [f"{'.'.join(str(part) for part in item['loc']) or 'answer'}: {item['msg']}" for item in error.errors()]
        raise InvalidAnswerError("; ".join(lines)) from error


def _score(answer: JudgeAnswer) -> Score:
    halves = (("scale", answer.scale), ("state", answer.state))
    reason = "; ".join(f"{name} {half.score:.2g}: {_short(half.reason)}" for name, half in halves)
    return Score(value=(answer.scale.score + answer.state.score) / 2.0, reason=reason)


def _short(text: str) -> str:
    plain = " ".join(text.split())
    return plain if len(plain) <= LONGEST_REASON else plain[: LONGEST_REASON - 1] + "…"
