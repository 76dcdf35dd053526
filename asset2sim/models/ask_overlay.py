"""Questions to a model that are repeated where the answer is invalid; the overlay of an object by such a question."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from asset2sim.models.answers import InvalidFieldsError, parse_overlay
from asset2sim.models.prompts import with_validation_errors
from schemas.errors import AssetError, InvalidAnswerError
from schemas.features import Features
from schemas.finding import Finding, remark, warning
from schemas.overlay import NoteKind, Overlay
from schemas.request import ModelAnswer, ModelAsk, ModelCall, ModelRequest
from schemas.vocabulary import FailureMode, Stage

CODES: dict[NoteKind, str] = {
    "size": "model_note_size", "mass": "model_note_mass", "motion": "model_note_motion", "state": "model_note_state",
    "support": "model_note_support", "data": "model_note_data", "unmet": "model_note_unmet",
}  # fmt: skip
"""Kind of a model's remark → code of its finding."""


def model_findings(overlay: Overlay, features: Features) -> tuple[Finding, ...]:
    """A finding for each of the model's remarks, a warning where it cannot do what the user asked or could not tell it,
    and one for a restitution, for which a URDF has no place."""
    links, joints = ({item.name for item in items} for items in (features.links, features.joints))

    def where(about: str | None) -> dict[str, str | None]:
        return {"link": about if about in links else None, "joint": about if about in joints else None}

    found = list[Finding]()
    for note in overlay.findings:
        say, text = (
            warning if note.kind == "unmet" else remark,
            f"{note.about}: {note.text}" if note.about else note.text,
        )
        found.append(say(Stage.SYNTHESIZE, CODES[note.kind], text, **where(note.about)))
    for item in overlay.unclear:
        text = f"the model could not tell {item.about}: {item.why}"
        found.append(warning(Stage.SYNTHESIZE, "model_unclear", text, **where(item.about)))
    if overlay.size_reason:
        message = f"scale {overlay.scale:.4g}: {overlay.size_reason}"
        found.append(remark(Stage.SYNTHESIZE, "model_note_size", message))
    if overlay.restitution is not None:
        message = (
            f"a restitution of {overlay.restitution:.3g} is stated; a URDF has no place for it, and contacts here do "
            "not bounce: set it in your engine"
        )
        found.append(warning(Stage.SYNTHESIZE, "restitution_unused", message, value=overlay.restitution))
    return tuple(found)


MAX_ASKS = 2
"""Times that a question is asked: the second states what was wrong with the first answer, and a third rarely helps."""

Synthesized = tuple[Overlay, tuple[ModelCall, ...], tuple[Finding, ...]]
"""An overlay, every model call made for it, and the findings."""

Value = TypeVar("Value")


@dataclass(frozen=True)
class Replies(Generic[Value]):
    """Result of one question: the value of the answer that fits (None without one), every answer, every model call
    with those of refused answers marked, and why answers were refused."""

    value: Value | None
    answers: tuple[ModelAnswer, ...]
    calls: tuple[ModelCall, ...]
    refused: tuple[InvalidAnswerError, ...]


class SynthesisError(AssetError):
    """No valid overlay; ``calls`` are the model calls made until then."""

    def __init__(self, mode: FailureMode, code: str, message: str, calls: Sequence[ModelCall]) -> None:
        super().__init__(mode, code, message)
        self.calls = tuple(calls)

    def __reduce__(self) -> tuple[object, ...]:
        return SynthesisError, (self.mode, self.code, str(self), self.calls)


def ask_overlay(first: ModelRequest, features: Features, ask: ModelAsk) -> Synthesized:
    """A model's overlay for a request, asked once more where the answer is invalid. Raises ``SynthesisError``:
    ``budget`` (spent), ``model_error`` (the provider fails), ``no_valid_estimate`` (neither answer fits)."""
    said = ask_until_valid(first, ask, lambda text: parse_overlay(text, features))
    last = said.answers[-1]
    if last.content is None and last.unrecorded and said.refused:
        message = f"the recorded answer does not fit: {said.refused[-1]}; {last.error}"
        raise SynthesisError(FailureMode.NO_VALID_ESTIMATE, "invalid_answer", message, said.calls)
    if last.content is None:
        raise no_answer_error(last, said.calls)
    if said.value is None:
        message = f"the model answered {MAX_ASKS} times and no answer fits: {said.refused[-1]}"
        raise SynthesisError(FailureMode.NO_VALID_ESTIMATE, "invalid_answer", message, said.calls)
    told = model_findings(said.value, features)
    return said.value, said.calls, (*remarks(said.answers[0]), *map(_refusal, said.refused), *told)


def ask_until_valid(
    first: ModelRequest, ask: ModelAsk, parse: Callable[[str], Value], most: int = MAX_ASKS
) -> Replies[Value]:
    """The first answer that ``parse`` accepts, of at most ``most``; each repeated question states what was wrong.
    Asking ends with an answer without content: a provider that failed, or a budget that is spent. ``parse`` raises
    ``InvalidAnswerError`` for an answer that does not fit."""
    request, answers, calls, refused = first, list[ModelAnswer](), list[ModelCall](), list[InvalidAnswerError]()
    value = None
    while value is None and len(answers) < most:
        answer = ask(request)
        answers.append(answer)
        try:
            value = None if answer.content is None else parse(answer.content)
            calls.extend(answer.calls)
        except InvalidAnswerError as error:
            refused.append(error)
            calls.extend(marked_invalid(answer.calls))
            violations = error.violations if isinstance(error, InvalidFieldsError) else (str(error),)
            request = with_validation_errors(first, violations)
        if answer.content is None:
            break
    return Replies(value, tuple(answers), tuple(calls), tuple(refused))


def no_answer_error(answer: ModelAnswer, calls: Sequence[ModelCall]) -> SynthesisError:
    """The error for an answer without content: a spent budget is not the model's fault."""
    if answer.budget_spent:
        return SynthesisError(FailureMode.BUDGET, "budget_spent", answer.error or "the budget is spent", calls)
    return SynthesisError(FailureMode.MODEL_ERROR, "model_error", answer.error or "the model failed", calls)


def remarks(answer: ModelAnswer) -> tuple[Finding, ...]:
    """Findings on the first answer: images that were not sent, or a recorded answer to another question."""
    if answer.other_question is None:
        return images_not_sent(answer)
    return (
        *images_not_sent(answer),
        warning(Stage.SYNTHESIZE, "other_question", f"the recorded answer {answer.other_question}"),
    )


def images_not_sent(answer: ModelAnswer) -> tuple[Finding, ...]:
    """A finding where the request's images were not sent, so that the answer is from text alone."""
    if answer.without_images is None:
        return ()
    return (
        warning(Stage.SYNTHESIZE, "images_not_sent", f"the model was asked without the views: {answer.without_images}"),
    )


def marked_invalid(calls: tuple[ModelCall, ...]) -> tuple[ModelCall, ...]:
    """The calls of one answer, the last of them marked as ``invalid_answer``."""
    return (*calls[:-1], *(call.model_copy(update={"outcome": "invalid_answer"}) for call in calls[-1:]))


def _refusal(error: InvalidAnswerError) -> Finding:
    return warning(
        Stage.SYNTHESIZE, "invalid_answer", f"the model's answer was refused and it was asked again: {error}"
    )
