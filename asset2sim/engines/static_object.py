"""An object's overlaps with itself where nothing moves: in PyBullet, or in MuJoCo where that is not installed."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Protocol

from asset2sim.engines.contacts import ContactPoint, LocatedContact, penetration
from asset2sim.engines.world import World
from asset2sim.physics.arrays import Array
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

MARGIN_M = 1e-3
"""PyBullet's margin around a mesh hull, m: hulls touch up to twice this far. MuJoCo's are cut for it, too."""


class StaticObject(Protocol):
    """A loaded object, its root held, no gravity."""

    def place(self, positions: Mapping[str, float]) -> None:
        """Set joint positions (rad, m) at rest; joints not named go to zero, those that follow others with these."""

    def contacts(self) -> list[ContactPoint]:
        """The object's contact points with itself as it is."""

    def located_contacts(self) -> list[LocatedContact]:
        """``contacts`` with places and normals, in the root link's frame."""

    def boxes(self) -> dict[str, tuple[Array, Array]]:
        """Link → lowest and highest corner, (3,) each, m, of its collision shapes' box along the root's axes."""


@cache
def with_pybullet() -> bool:
    """Whether PyBullet is installed; MuJoCo does its part where it is not."""
    return find_spec(Engine.PYBULLET.value) is not None


def static_object(
    urdf: Path, settings: EngineSettings, *, parents: bool = False
) -> AbstractContextManager[StaticObject]:
    """The object for ``contact_points`` at many joint positions; with ``parents``, a link's contacts with its parent,
    too. Raises AssetError (engine_refused) where the engine refuses the file."""
    if with_pybullet():
        from asset2sim.engines.pybullet_object import static_pybullet

        return static_pybullet(urdf, settings.timestep_s, parents=parents)
    from asset2sim.engines.mujoco_world import static_mujoco

    return static_mujoco(urdf, settings.timestep_s, parents=parents)


def contact_points(item: StaticObject | World, positions: Mapping[str, float]) -> list[ContactPoint]:
    """The object's contact points with itself at these joint positions."""
    item.place(positions)
    return item.contacts()


def contacts_at(urdf: Path, positions: Mapping[str, float], settings: EngineSettings) -> list[ContactPoint]:
    """Contact points at one pose in a fresh world: contact caches make Φ depend slightly on earlier poses."""
    with static_object(urdf, settings) as item:
        return contact_points(item, positions)


def phi_at(urdf: Path, positions: Mapping[str, float], settings: EngineSettings) -> float:
    """Φ (m) at one pose in a fresh world."""
    return penetration(contacts_at(urdf, positions, settings))
