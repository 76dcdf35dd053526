"""The models of this process by name: the offline prior, and those that extensions add."""

from collections.abc import Callable

from schemas.errors import UnknownChoiceError, UsageError
from schemas.extensions import local_models, missing, named
from schemas.model_names import HOUSEHOLD

Answers = Callable[[str, str, int], str]
"""Question with an object's facts, all that was said, number of the sample → the answer's text."""


def answers_of(model: str) -> Answers:
    """The answers of the model of that name. Raises UsageError for a name that no model of this process has."""
    found = local_models()
    if model == HOUSEHOLD:
        return _household
    kind = found.get(model.partition("@")[0])
    if kind is not None:
        answers: Answers = named(kind.answers)(model)
        return answers
    needed = missing(model)
    raise UsageError(needed) if needed else UnknownChoiceError("model", model, local_forms())


def local_forms() -> tuple[str, ...]:
    """How the names of the models of this process are written."""
    return HOUSEHOLD, *(model.form for model in local_models().values())


def _household(text: str, conversation: str, sample: int) -> str:
    from asset2sim.models.prior.answer import answer

    return answer(text)
