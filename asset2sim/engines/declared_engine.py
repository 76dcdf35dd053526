"""Declaration of an engine, in the module that opens it: ``ENGINE``."""

from dataclasses import dataclass

from asset2sim.engines.world import Opener
from schemas.vocabulary import Engine


@dataclass(frozen=True)
class DeclaredEngine:
    """One engine: its name, how a world is opened in it."""

    engine: Engine
    """``Engine.add(name)`` where it is none of the known."""
    open: Opener
    started: tuple[object, str]
    """Object and its attribute that is called whenever a world is opened: tests that do are marked ``system``."""
    package: str = ""
    """Name of the package that it needs; that of the engine itself where none is stated."""
    version: str = ""
    """Its version; that of the installed package where none is stated."""
