"""Belief in what a file says of an object's physics."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import BeforeValidator

from schemas.base import Frozen
from schemas.vocabulary import Keep, Quantity, Trust

KEEP_WORDS = (*Keep, *Quantity)
"""Words of ``--keep``: one of ``Keep`` for all quantities, or the quantities that stay as their file has them."""
KEPT_AS_ASKED = "its size is kept, as asked"
"""Why lengths count as metres where nothing but the user says so."""
MASSES_FIT = "its masses fit its volumes in metres"
"""Why they do where it is weighed: at another size it would be as light as air or heavier than lead."""
UNLIKE_UNITS = "its size is none to which datasets bring their objects"
"""Why they do where no more is known of them, unless that is no size for its kind."""


def keep_words(said: str | Sequence[str]) -> tuple[str, ...]:
    """The words of ``--keep``, of a text with commas or blanks between them. Raises ValueError for one that is none,
    and for ``nothing`` beside others."""
    words = said.replace(",", " ").split() if isinstance(said, str) else said
    for word in words:
        if word not in KEEP_WORDS:
            raise ValueError(f"'{word}' is none of {', '.join(KEEP_WORDS)}")
    if not words or (Keep.NOTHING in words and len(words) > 1):
        raise ValueError(f"it names {'nothing beside others' if words else 'nothing'}; choose what is kept")
    return tuple(dict.fromkeys(map(str, words)))


KeepWords = Annotated[tuple[str, ...], BeforeValidator(keep_words)]


def kept_share(words: tuple[str, ...], quantity: Quantity) -> Keep:
    """How much of a quantity these words keep: what is not impossible where they name it, or what is plausible."""
    if Keep.ALL in words or quantity in words:
        return Keep.ALL
    return Keep.PLAUSIBLE if Keep.PLAUSIBLE in words else Keep.NOTHING


class Belief(Frozen):
    """How far one number of a file is believed, and why."""

    trust: Trust
    reason: str


class Authored(Belief):
    """The same of numbers judged alike: ``of`` these links or joints, of none where it is the whole object's."""

    quantity: Quantity
    of: tuple[str, ...] = ()
