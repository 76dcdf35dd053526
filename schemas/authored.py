"""Belief in what a file says of an object's physics."""

from schemas.base import Frozen
from schemas.vocabulary import Quantity, Trust


class Belief(Frozen):
    """How far one number of a file is believed, and why."""

    trust: Trust
    reason: str


class Authored(Belief):
    """The same of all numbers of one quantity that are judged alike: ``of`` these links or joints, of none where it is
    the whole object's."""

    quantity: Quantity
    of: tuple[str, ...] = ()
