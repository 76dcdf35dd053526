"""One refined object as an engine's own loader makes it, behind one small interface: nothing is mended."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from asset2sim.physics.arrays import Array
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.vocabulary import Engine

BALL_RADIUS_M = 0.01
BALL_MASS_KG = 0.01
"""A ball that is dropped into what is hollow."""
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Setting:
    """Surroundings of the object: gravity (m/s²), a floor at z = 0, a free ball (its centre, m). ``timestep_s``: the
    engine's or file's own where it is None. ``held``: the root is fixed, or free, or (None) as the loader leaves it; it
    starts at ``height_m``. ``loose``: what the engine itself holds joints with (a hidden motor, a default friction) is
    taken away, so that what the file states can be seen."""

    timestep_s: float | None = None
    gravity: Vector = (0.0, 0.0, -GRAVITY_M_S2)
    held: bool | None = None
    height_m: float = 0.0
    loose: bool = False
    floor: bool = False
    ball: Vector | None = None


class LoadedObject(Protocol):
    """A loaded object; rad, m, s, N·m, N. Joints that are not named are at zero, at rest, and without effort."""

    timestep_s: float

    def positions(self) -> dict[str, float]:
        """Joint → position."""

    def velocity(self, joint: str) -> float:
        """Velocity of a joint."""

    def place(self, positions: Mapping[str, float], velocities: Mapping[str, float]) -> None:
        """Set positions and velocities of all joints."""

    def step(self, efforts: Mapping[str, float]) -> None:
        """Advance by one time step under these efforts, as that engine lets a user apply them."""

    def root_position(self) -> Array:
        """(3,) position of the root link, or of its centre of mass, m."""

    def ball_position(self) -> Array:
        """(3,) position of the ball, m."""


@dataclass(frozen=True)
class Loader:
    """A way to load a refined folder: its heading in the table, and the call that a user writes."""

    name: str
    engine: Engine
    how: str
    open: Callable[[Path, Setting], AbstractContextManager[LoadedObject]]
