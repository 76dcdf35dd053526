"""Support that an object stands on, hangs from or is held by, where that was read, and how sure it is."""

from enum import StrEnum

from schemas.base import Fraction, Frozen
from schemas.vocabulary import Source


class SupportKind(StrEnum):
    """Kinds of support of an object in the world."""

    FREESTANDING = "freestanding"
    """It stands or lies on a floor or a table by its own weight."""
    FIXED = "fixed"
    """It is screwed, built or hung to something that does not move (see ``Mount``)."""
    HANDHELD = "handheld"
    """A hand holds it while it is used; put down, it lies as a freestanding object does."""


class Mount(StrEnum):
    """Mounts of a fixed object."""

    FLOOR = "floor"
    WALL = "wall"
    COUNTER = "counter"
    CEILING = "ceiling"
    BUILT_IN = "built_in"
    """Set into a wall, a frame, a pipe or a row of cupboards."""


class Support(Frozen):
    """Support of an object, with where that was read (``source``), how sure it is (0 to 1), and why in words.

    ``mount`` is None unless the object is fixed, and may be None where it is: what it is fixed to is then not known.
    """

    kind: SupportKind = SupportKind.FREESTANDING
    mount: Mount | None = None
    source: Source = Source.RULE
    confidence: Fraction = 0.0
    reason: str = "nothing says otherwise"

    @property
    def fixed(self) -> bool:
        """Whether the root link is held to the world."""
        return self.kind is SupportKind.FIXED


class SupportProposal(Frozen):
    """A model's answer on what carries the object; ``mount`` is what a fixed one is fixed to, ``confidence`` 0 to 1."""

    kind: SupportKind
    mount: Mount | None = None
    confidence: Fraction = 0.5
    reason: str = ""
