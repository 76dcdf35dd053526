"""The numbers that a user states for one asset."""

from typing import Literal

from pydantic import Field

from schemas.base import Finite, Frozen, Positive
from schemas.features import Features

Unit = Literal["", "share", "deg", "rad", "m"]
"""Of a stated position: the joint's own (""), a share of the way from closed to open, or one that was named."""


class StatedPosition(Frozen):
    """An initial position, in the joint's unit (rad, or m of the refined object), or as a share from closed to open."""

    value: Finite
    unit: Unit = ""


class Overrides(Frozen):
    """A user's statements on one asset; it wins over any model and any prior, and its source is ``user``.

    ``size_m`` is the longest edge of the closed object, ``mass_kg`` the whole object's mass; ``joints`` maps joint →
    initial position, ``materials`` link → material of the table. ``where`` says of each column the file and the line.
    """

    scale: Positive | None = None
    size_m: Positive | None = None
    mass_kg: Positive | None = None
    joints: dict[str, StatedPosition] = Field(default_factory=dict)
    materials: dict[str, str] = Field(default_factory=dict)
    where: dict[str, str] = Field(default_factory=dict)

    def scale_of(self, features: Features) -> float | None:
        """The uniform scale that is stated, or that gives the closed object's longest edge; None without either."""
        if self.size_m is None:
            return self.scale
        return self.size_m / (max(features.closed_size) or max(features.rest_size))

    def place(self, column: str) -> str:
        """File, line and column of a number, for messages."""
        return f"{self.where.get(column, 'overrides')}, column '{column}'"
