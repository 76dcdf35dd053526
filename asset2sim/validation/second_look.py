"""A second look at a guess: a model is shown a part at both ends of its travel, and says at which it is closed."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from asset2sim.assets.extract import Extraction
from asset2sim.intake.guessed_ends import GuessedEnd, ToldEnd, guessed_ends
from asset2sim.models.answers import InvalidFieldsError, strict_fit, trimmed
from asset2sim.models.ask_overlay import ask_until_valid, remarks
from asset2sim.models.lenient_json import parse_json
from asset2sim.models.object_facts import axis_names
from asset2sim.models.prompts import data_block, system_text
from asset2sim.render.marked import end_pictures
from schemas.base import Fraction, Frozen
from schemas.errors import AssetError, first_words, shortened
from schemas.finding import Finding, remark, warning
from schemas.request import LabelledImage, ModelAsk, ModelCall, ModelRequest
from schemas.settings import Settings
from schemas.vocabulary import Stage

ENDS = "ends"
"""Purpose of the question."""
MOST_JOINTS = 4
"""Joints that one question is about, the least sure first; two pictures each."""
LONGEST_REASON = 200
"""Characters kept of what the model saw."""


class EndAnswer(Frozen):
    """The end at which a part is closed, how sure the model is, and what it saw."""

    closed: Literal["a", "b"]
    sure: Fraction
    why: str = ""


class EndsAnswer(Frozen):
    """A model's whole answer: joint → the end at which its part is closed."""

    joints: dict[str, EndAnswer] = Field(default_factory=dict)


@dataclass(frozen=True)
class SecondLook:
    """The ends that a model told, its calls, and the findings; nothing of each where there was nothing to ask."""

    ends: Mapping[str, ToldEnd]
    calls: tuple[ModelCall, ...] = ()
    findings: tuple[Finding, ...] = ()


def look_again(extraction: Extraction, settings: Settings, ask: ModelAsk, stated: Collection[str]) -> SecondLook:
    """The closed ends of the main parts of which only a guess says so, as the model tells that sees them at both ends,
    in one question; none of joints whose position is ``stated``. Where it does not answer the guesses stay."""
    sure = settings.physics.sure_of_closed
    guessed = [item for item in guessed_ends(extraction, sure) if item.joint.name not in stated]
    if not guessed:
        return SecondLook({})
    guessed = sorted(guessed, key=lambda item: item.joint.openness_confidence)[:MOST_JOINTS]
    request = ends_request(extraction, guessed, pictures_of(extraction, settings, guessed))
    names = [item.joint.name for item in guessed]
    said = ask_until_valid(request, ask, lambda text: parse_ends(text, names))
    last, told = said.answers[-1], remarks(said.answers[0])
    if said.value is None:
        why = last.error or "the model did not answer"
        if last.content is not None:
            why = f"no answer fits: {said.refused[-1]}"
        message = f"which end of {first_words(names, 4)} is closed stays a guess: {why}"
        return SecondLook({}, said.calls, (*told, warning(Stage.SYNTHESIZE, "closed_end_unanswered", message)))
    ends = {item.joint.name: told_end(item, said.value.joints[item.joint.name]) for item in guessed}
    told = (*told, *(told_finding(item, ends[item.joint.name], said.value) for item in guessed))
    return SecondLook(ends, said.calls, told)


def ends_request(
    extraction: Extraction, guessed: Sequence[GuessedEnd], images: Sequence[LabelledImage]
) -> ModelRequest:
    """The question: what the joints are, what either end would mean, and the pictures."""
    features = extraction.features
    joints = [
        {
            "name": item.joint.name,
            "type": item.joint.type,
            "part": item.part,
            "parent": item.joint.parent,
            "child": item.joint.child,
            **{
                end: {"position": at, "picture": f"{number}{end}", "would": item.means[at]}
                for end, at in ends_of(item).items()
            },
        }
        for number, item in enumerate(guessed, 1)
    ]
    information = {
        "purpose": ENDS,
        "asset_id": features.asset_id,
        "category": features.category,
        "directions": axis_names(features),
        "joints": joints,
    }
    return ModelRequest(
        purpose=ENDS,
        system=system_text(ENDS),
        text=data_block("structured_information", information),
        images=tuple(images),
        answer_schema=trimmed(EndsAnswer.model_json_schema(), frozenset()),
    )


def ends_of(item: GuessedEnd) -> dict[str, float]:
    """The two ends by their names in the question, the lower first, so that the order does not tell the guess."""
    return dict(zip("ab", sorted(item.means), strict=True))


def pictures_of(extraction: Extraction, settings: Settings, guessed: Sequence[GuessedEnd]) -> tuple[LabelledImage, ...]:
    """The pictures of each part at both ends; none where there is nothing to draw, or for a model that takes none."""
    shown = [
        (item.joint, {f"{number}{end}": at for end, at in ends_of(item).items()})
        for number, item in enumerate(guessed, 1)
    ]
    try:
        return end_pictures(extraction, settings, shown)
    except AssetError:  # the words alone still ask
        return ()


def parse_ends(text: str, names: Sequence[str]) -> EndsAnswer:
    """The ends in a model's answer, one of each of these joints. Raises ``InvalidAnswerError``."""
    answer = strict_fit(EndsAnswer, parse_json(text))
    other = [f"joints.{name}: this joint is not asked about" for name in answer.joints if name not in names]
    missing = [f"joints.{name}: this field is required" for name in names if name not in answer.joints]
    if other or missing:
        raise InvalidFieldsError([*other, *missing])
    return answer


def told_end(item: GuessedEnd, said: EndAnswer) -> ToldEnd:
    """The end that the model chose."""
    return ToldEnd(ends_of(item)[said.closed], said.sure)


def told_finding(item: GuessedEnd, end: ToldEnd, said: EndsAnswer) -> Finding:
    """A finding that says what was asked and answered."""
    name, guess = item.joint.name, item.joint.closed
    agrees = "as guessed" if end.closed == guess else f"and not at {guess:.4g}, as guessed"
    why = f": {shortened(saw, LONGEST_REASON)}" if (saw := said.joints[name].why.strip()) else ""
    message = (
        f"joint '{name}' ({item.part}): which end is closed was a guess ({item.joint.openness_confidence:.2g} sure); "
        f"the model, shown both, says at {end.closed:.4g} ({end.sure:.2g} sure), {agrees}{why}"
    )
    return remark(Stage.SYNTHESIZE, "closed_end_asked", message, joint=name, value=end.closed)
