"""The interface that every engine implements: one object in one simulated world."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from asset2sim.engines.contacts import ContactPoint
from asset2sim.physics.arrays import Array
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.errors import AssetError
from schemas.features import Mimic
from schemas.vocabulary import Engine, FailureMode

CONTACT_SPEED_M_S = 1.2
"""Speed, m/s, up to which contact is generated a step ahead: a fall of 5 cm ends at 1 m/s, and must not end inside. A
larger one makes a step of an object of many parts several times slower, for neighbours that never touch."""


class World(Protocol):
    """A loaded object whose joint damping, friction, stiffness and mechanisms are in force as its URDF states them.

    The world has a plane at z = 0 and the object's root is free, or it has none and the root is held. Gravity is along
    -z. Frames are the world's, quaternions xyzw, positions rad or m in ``joint_names``' order. Joints that follow
    others (``mimic``) are bound to them.
    """

    engine: Engine
    timestep_s: float
    skin_m: float
    """Distance between two shapes from which the engine reports contact, m; 0 where only when they touch."""
    link_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    console: tuple[str, ...]
    """What the engine printed while loading."""

    def place(
        self,
        positions: Mapping[str, float],
        *,
        height_m: float = 0.0,
        shift_m: tuple[float, float] = (0.0, 0.0),
        tilt_rad: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> None:
        """Set the object at rest: joints at ``positions`` (others at zero, followers where their leaders
        have them), no effort applied.

        With a plane, upright as authored and then turned by the rotation vector ``tilt_rad``, shifted along the plane,
        its lowest point ``height_m`` above it. A held root stays as authored.
        """

    def step(self, count: int = 1) -> None:
        """Advance by that many time steps."""

    def root_pose(self) -> tuple[Array, Array]:
        """(3,) position and (4,) xyzw orientation of a frame fixed to the root link."""

    def root_center(self) -> Array:
        """(3,) position of the root link's centre of mass, m."""

    def positions(self) -> Array:
        """(n,) joint positions."""

    def velocities(self) -> Array:
        """(n,) joint velocities."""

    def kick(self, velocities: Mapping[str, float]) -> None:
        """Give these joints a velocity (rad/s or m/s) at once; all else keeps its own."""

    def push(self, efforts: Mapping[str, float]) -> None:
        """Apply these constant efforts (N·m or N) from now on, and none to joints not named."""

    def link_speeds(self) -> Array:
        """(l,) speeds of the links' centres of mass, m/s."""

    def lowest_m(self) -> float:
        """Height of the lowest collision point over the plane, m; negative where it has sunk in."""

    def contacts(self) -> list[ContactPoint]:
        """The object's contact points with itself at its present joint positions, under the engine's default filter."""


class Opener(Protocol):
    """Opens a world for one URDF; raises AssetError (engine_refused) where the engine refuses it."""

    def __call__(
        self, urdf: Path, *, plane: bool, timestep_s: float, contact_friction: float, gravity_m_s2: float = GRAVITY_M_S2
    ) -> AbstractContextManager[World]:
        """The loaded object, until the context ends."""


def bias_efforts(terms: Array, positions: Array) -> Array:
    """(n,) what mechanisms exert at (n,) positions, N·m or N; ``terms`` (n, 5) are the joints' ``Dynamics.bias``."""
    exerted: Array = np.clip(terms[:, 0] * (positions - click_near(terms, positions)), terms[:, 2], terms[:, 3])
    return exerted


def click_near(terms: Array, positions: Array) -> Array:
    """(n,) where mechanisms exert nothing, nearest to (n,) positions, rad or m: of a selector the nearest click."""
    none_at, period = terms[:, 1], terms[:, 4]
    counts = np.round((positions - none_at) / np.where(period > 0.0, period, np.inf))
    nearest: Array = none_at + np.where(period > 0.0, counts * period, 0.0)
    return nearest


def with_followers(mimics: Mapping[str, Mimic], velocities: Mapping[str, float]) -> dict[str, float]:
    """The joint velocities with those of the joints that follow any of these."""
    led = {
        name: mimic.multiplier * velocities[mimic.joint] for name, mimic in mimics.items() if mimic.joint in velocities
    }
    return {**velocities, **led}


def nothing_collides() -> AssetError:
    """AssetError (engine_refused) for an object that cannot stand on a plane."""
    return AssetError(FailureMode.ENGINE_REFUSED, "nothing_collides", "no link has a collision shape; add one")


def contact_distance_m(timestep_s: float) -> float:
    """Distance, m, from which contact with the plane is generated."""
    return CONTACT_SPEED_M_S * timestep_s


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
    ready: Callable[[], None] = lambda: None
    """Makes what its worlds need, once, for all processes that fork from this one."""
