"""Declaration of a pack: what one consumer's folder has, and how it is opened there."""

import functools
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from asset2sim import packs
from asset2sim.assets.exports.refined_object import CLEARANCE_M
from asset2sim.load.description import Description
from schemas.csv_rows import rows_beside
from schemas.errors import UnknownChoiceError
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import Export

OBJECTS = "objects"
"""Folder of a pack that holds a folder an object."""


@dataclass(frozen=True)
class PackedObject:
    """One object of a pack: its ``folder`` in it, what its URDF and overlay say, its row of the run's tables, and
    ``name``, its id as Python and ROS take names."""

    asset_id: str
    name: str
    folder: Path
    about: Description
    overlay: PhysicsOverlay
    row: Mapping[str, Any]

    @property
    def fixed(self) -> bool:
        """Whether its root is held to the world."""
        return self.overlay.support.fixed

    @property
    def stand_m(self) -> float:
        """Height of its root's origin at which it stands on z = 0, m; what is fixed clears the floor."""
        return float(self.about.height_m) + (CLEARANCE_M if self.fixed else 0.0)

    @property
    def initial(self) -> dict[str, float]:
        """Movable joint → initial position, rad or m."""
        return {joint.name: joint.initial_position for joint in self.about.joints}


Finish = Callable[[Path, Sequence[PackedObject], Mapping[str, Any]], None]
"""Writes what no template can: the pack's folder, its objects, and what templates are given."""


@dataclass(frozen=True)
class Pack:
    """A consumer's pack. Templates in ``templates/<name>/pack`` are its files, those in ``templates/<name>/object`` the
    files of each object; ``exports`` are written into every object's folder, ``finish`` the rest."""

    name: str
    title: str
    """The consumer."""
    contents: str
    """Its files, in a sentence."""
    opens: str
    """How it is opened: a shell line."""
    exports: tuple[Export, ...] = ()
    finish: Finish | None = None


PACKS = tuple(
    Pack(row["name"], row["title"], row["contents"], row["opens"], tuple(map(Export, row["exports"].split())))
    for row in rows_beside(__file__, "packs.csv")
)
"""Those that templates and exports alone make: Gazebo, Isaac Lab, LeRobot and others."""


@functools.cache
def known_packs() -> dict[str, Pack]:
    """Every declared pack by its name: those in the ``PACKS`` of this package's modules."""
    modules = (import_module(f"{packs.__name__}.{module.name}") for module in pkgutil.iter_modules(packs.__path__))
    found: list[Pack] = [pack for module in modules for pack in getattr(module, "PACKS", ())]
    return {pack.name: pack for pack in sorted(found, key=lambda pack: pack.name)}


def find_pack(name: str) -> Pack:
    """The pack of this name. Raises UnknownChoiceError."""
    if name not in known_packs():
        raise UnknownChoiceError("pack", name, known_packs())
    return known_packs()[name]
