"""Data types of a sample object before files are written: parts in their closed pose, and their joints."""

from collections.abc import Iterable
from dataclasses import dataclass

from asset2sim.studies.samples.shapes import Mesh, Point, textured

Colour = tuple[float, float, float]

GAP = 0.026
"""Clearance between parts that move against each other, object units.

At a scale of 0.1, which makes a hand-sized object of most, it is 2.6 mm: more than the 2 mm that PyBullet's margins
take up.
"""


@dataclass(frozen=True)
class Paint:
    """A material: ``rgb`` and ``alpha`` in 0 to 1, and a texture's name in ``textures.TEXTURES`` or None."""

    rgb: Colour
    alpha: float = 1.0
    texture: str | None = None


@dataclass(frozen=True)
class Piece:
    """One mesh file of a link, named for the part of the object that it is."""

    name: str
    mesh: Mesh
    paint: Paint


@dataclass(frozen=True)
class Hinge:
    """The joint of a part with its ``parent`` (a part's key): through ``point`` along ``axis``, in the closed pose.

    Positions are radians or object units from the closed pose. ``authored`` is the position in which the files show the
    part, and from which their limits count: real assets are often authored half open. ``kind`` is PartNet-Mobility's
    word for the joint.
    """

    parent: str
    type: str
    point: Point
    axis: Point
    lower: float = 0.0
    upper: float = 0.0
    authored: float = 0.0
    kind: str = "hinge"


@dataclass(frozen=True)
class Part:
    """One link. ``joint`` is None for the body that stands on the ground; ``kind`` is then free, heavy or static."""

    key: str
    label: str
    pieces: tuple[Piece, ...]
    joint: Hinge | None = None
    kind: str = "free"


@dataclass(frozen=True)
class Blueprint:
    """One asset. Parts are numbered as links in their order; the last is the body."""

    asset_id: str
    category: str
    prompt: str
    parts: tuple[Part, ...]
    subset: str = "sample"


def pieces(name: str, paint: Paint, meshes: Mesh | Iterable[Mesh]) -> tuple[Piece, ...]:
    """One piece for each mesh, all of one name and paint."""
    listed = [meshes] if isinstance(meshes, Mesh) else list(meshes)
    return tuple(Piece(name, textured(mesh) if paint.texture else mesh, paint) for mesh in listed)


def hinge(parent: str, point: Point, axis: Point, upper: float, *, lower: float = 0.0, authored: float = 0.0) -> Hinge:
    """A revolute joint."""
    return Hinge(parent, "revolute", point, axis, lower, upper, authored)


def turntable(parent: str, point: Point, axis: Point) -> Hinge:
    """A continuous joint: a knob, a tray."""
    return Hinge(parent, "continuous", point, axis)


def slider(parent: str, axis: Point, upper: float) -> Hinge:
    """A prismatic joint, its origin at the body's as the real data has it."""
    return Hinge(parent, "prismatic", (0.0, 0.0, 0.0), axis, 0.0, upper, kind="slider")
