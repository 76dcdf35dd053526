"""The model ``prior/noisy``: ``prior/household``'s answers with simulated errors."""

from collections.abc import Callable

from asset2sim.models.prior.answer import answer
from lab.noise.noise import noisy
from lab.noise.noise_level import noise_of


def noisy_answers(model: str) -> Callable[[str, str, int], str]:
    """The answers of a model by its whole name: question, all that was said, number of the sample → text. Raises
    UnknownChoiceError for a level or a seed that it cannot have."""
    noise = noise_of(model)

    def answered(text: str, conversation: str, sample: int) -> str:
        right = answer(text)
        return right if noise is None else noisy(right, text, noise, sample, f"{text}\n{conversation}")

    return answered
