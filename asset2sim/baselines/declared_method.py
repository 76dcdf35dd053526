"""Declaration of a method, in its module: ``METHOD``."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from asset2sim.assets.extract import Extraction
from schemas.asset import AssetRef
from schemas.declared import METHOD, declared
from schemas.extensions import unknown
from schemas.finding import Finding
from schemas.guidance import Guidance
from schemas.overlay import Overlay
from schemas.request import ModelAsk, ModelCall
from schemas.settings import Settings
from schemas.vocabulary import Method, Source

Proposed = tuple[Overlay | None, tuple[ModelCall, ...], tuple[Finding, ...]]
"""The overlay that a method proposes, None for an asset that is measured as it came; its model calls, and findings."""
Dashes = str | tuple[int, tuple[int, ...]]
"""Matplotlib's style of a line."""
DASHED, DOTTED = (0, (5, 1)), (0, (1, 1))


class ProposalJob(Protocol):
    """A request to a method: one asset, its words, the run's settings and the one way to ask a model."""

    @property
    def ref(self) -> AssetRef:
        """The asset."""

    @property
    def settings(self) -> Settings:
        """The run's settings."""

    @property
    def ask(self) -> ModelAsk:
        """The one way to ask a model."""

    @property
    def guidance(self) -> Guidance:
        """Guidance of the asset's prompt."""

    @property
    def source(self) -> Source:
        """Source of the numbers that are proposed."""


def as_it_is(ask: ModelAsk, extraction: Extraction) -> tuple[ModelAsk, Extraction]:
    """The same: nothing is withheld."""
    return ask, extraction


@dataclass(frozen=True)
class DeclaredMethod:
    """One method: where an asset's physics come from."""

    method: Method
    """``Method.add(name)`` where it is none of the known."""
    name: str
    """What tables and charts call it."""
    words: str
    """What it is, in a sentence."""
    propose: Callable[[ProposalJob, Extraction], Proposed]
    """Raises AssetError or SynthesisError."""
    place: int = 100
    """Its place in tables: the paper's first."""
    rules: bool = False
    """Whether our rules correct, complete, bound and refine what it proposes."""
    asks: bool = True
    """Whether a model is asked."""
    source: Source | None = None
    """Where its numbers come from; None where from the model or ``prior/household``."""
    given: Callable[[ModelAsk, Extraction], tuple[ModelAsk, Extraction]] = as_it_is
    """How a model is asked, and what of the asset the method, rules and all, may know."""
    reads_above: str = ""
    """File in the folders above an asset that it reads, which is fetched with an asset behind a URL."""
    colour: str = "#222222"
    """Colour of its curve, of Okabe and Ito's palette; ours is the darkest blue."""
    dashes: Dashes = "-"


@functools.cache
def known_methods() -> dict[Method, DeclaredMethod]:
    """Every method that a module of this package, or one from outside, declares; in the order of tables."""
    found = [item for item in declared(METHOD) if isinstance(item, DeclaredMethod)]
    return {item.method: item for item in sorted(found, key=lambda item: item.place)}


def require_method(method: Method) -> None:
    """Raise UsageError for a method that nothing installed declares."""
    if method not in known_methods():
        raise unknown("method", method.value, known_methods())
