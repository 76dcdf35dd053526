"""Access of the viewer to a world beyond ``World``: poses of links, a force, gravity, contacts, energy."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from asset2sim.engines.contacts import ContactPoint
from asset2sim.physics.arrays import Array

GROUND = ""
"""Name of the plane in a contact."""


@dataclass(frozen=True, eq=False)
class WorldContact(ContactPoint):
    """A contact point with its (3,) ``place`` in the world, m; ``link_b`` is ``GROUND`` where it is the plane's."""

    place: Array


class Handle(Protocol):
    """Reads and touches one object of an engine, in the world's frame."""

    def poses(self) -> dict[str, Array]:
        """Link → (4, 4) link-to-world transform."""

    def masses(self) -> dict[str, float]:
        """Link → its mass in the engine, kg: what a raw URDF does not state, the engine invents."""

    def point_velocity(self, link: str, point: Array) -> Array:
        """(3,) velocity of the link's material at the (3,) ``point`` in the world, m/s."""

    def pull(self, link: str, point: Array, force: Array, against: str | None = None) -> None:
        """Apply a (3,) ``force`` (N) on a link at a (3,) ``point`` in the world in the next step, and its reaction on
        the link ``against``, if one is named. Call it again before every step, and with no force to let go."""

    def set_gravity(self, gravity: Sequence[float]) -> None:
        """Set the (3,) gravity, m/s²."""

    def touches(self) -> list[WorldContact]:
        """Contact points of the last step, of the object with itself and with the plane."""

    def kinetic_energy(self) -> float:
        """Kinetic energy of all links, J."""
