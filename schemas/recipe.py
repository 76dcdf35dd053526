"""The recipe of a refined folder: all that makes it again from a copy of its asset, without a model or an engine.

It holds numbers of ours and content hashes. Of geometry it has planes alone: a hull is that of the asset's own mesh,
cut. Nothing in it is a vertex of the asset's.
"""

from typing import Any, Literal

from pydantic import Field

from schemas.base import Finite, Frozen
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import UpAxis

RECIPE_NAME = "recipe.json"
MEASUREMENT_NAME = "measurement.json"
"""Files of a refined folder: how it was made, and what the engines recorded of it."""
DECIDING: dict[str, Any] = {
    "physics": True, "collision": True, "state": True, "base": True, "exports": True, "views": True,
    "engine": {"timestep_s"},
}  # fmt: skip
"""The settings that decide what is written of an asset and its overlay."""


Outcome = Literal["same", "differs", "original", "failed"]


class Remade(Frozen):
    """Result of making one object again: ``outcome`` is same (the bytes that its checksums say), differs
    (written, with other bytes), original (its asset's files are not those of the recipe) or failed; ``reason`` in
    words, and the seconds that it took."""

    asset_id: str
    outcome: Outcome
    reason: str = ""
    seconds: float = 0.0

    @property
    def written(self) -> bool:
        """Whether its refined folder is there."""
        return self.outcome in ("same", "differs")


class CutHull(Frozen):
    """One collision hull: the number of the whole one among its link's, and the half-spaces to which it is cut, one
    after the other: (a, b, c, d) keeps what has a·x + b·y + c·z ≥ d, m at the final scale in the link's frame."""

    hull: int
    planes: tuple[tuple[Finite, Finite, Finite, Finite], ...] = ()


class Recipe(Frozen):
    """How one refined folder is made of its asset."""

    version: int = 1
    asset_id: str
    originals: dict[str, str]
    """Path of each file that was read, relative to the asset's folder, or ``package://NAME/...`` → its SHA-256."""
    part: str | None = None
    """The part of a scene that it is; None: the file is all its own."""
    keep: tuple[str, ...] = ()
    up: UpAxis
    """The axis of its file that points up."""
    corrected: bool
    """Whether joints are corrected where geometry is unambiguous."""
    settings: dict[str, Any]
    """Those of ``DECIDING``; the collision mode is that of the shapes that were chosen."""
    cuts: dict[str, tuple[CutHull, ...]] = Field(default_factory=dict)
    """Link whose hulls were cut → the hulls that it has; those of other links are whole."""
    boxed: tuple[str, ...] = ()
    """Hulls' files that an engine died of, and that hold their boxes."""
    overlay: PhysicsOverlay | None = None
    """The overlay before its state was baked; None: ``overlay.json`` holds it."""
    made_with: dict[str, str]
    """Package → version, of those that decide what is written."""

    @property
    def run_settings(self) -> Settings:
        """Settings with which the folder is written. Raises ValidationError for settings that are not known."""
        return Settings.model_validate(self.settings)
