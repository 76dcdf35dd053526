"""Data types of a sample object before files are written: parts in their closed pose, their joints and their paint."""

import struct
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from tests.samples.shapes import Mesh, Point, textured

Colour = tuple[float, float, float]

GAP = 0.026
"""Clearance between parts that move against each other, object units. At a scale of 0.1, which makes a hand-sized
object of most, it is 2.6 mm: more than the 2 mm that PyBullet's margins take up."""


@dataclass(frozen=True)
class Finish:
    """A material: ``rgb`` and ``alpha`` in 0 to 1, and a texture's name in ``TEXTURES`` or None."""

    rgb: Colour
    alpha: float = 1.0
    texture: str | None = None


@dataclass(frozen=True)
class NamedMesh:
    """One mesh file of a link, named for the part of the object that it is."""

    name: str
    mesh: Mesh
    paint: Finish


@dataclass(frozen=True)
class JointSpec:
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
class Link:
    """One link. ``joint`` is None for the body that stands on the ground; ``kind`` is then free, heavy or static."""

    key: str
    label: str
    pieces: tuple[NamedMesh, ...]
    joint: JointSpec | None = None
    kind: str = "free"


@dataclass(frozen=True)
class Blueprint:
    """One asset. Parts are numbered as links in their order; the last is the body."""

    asset_id: str
    category: str
    prompt: str
    parts: tuple[Link, ...]
    subset: str = "sample"


def pieces(name: str, paint: Finish, meshes: Mesh | Iterable[Mesh]) -> tuple[NamedMesh, ...]:
    """One piece for each mesh, all of one name and paint."""
    listed = [meshes] if isinstance(meshes, Mesh) else list(meshes)
    return tuple(NamedMesh(name, textured(mesh) if paint.texture else mesh, paint) for mesh in listed)


def hinge(
    parent: str, point: Point, axis: Point, upper: float, *, lower: float = 0.0, authored: float = 0.0
) -> JointSpec:
    """A revolute joint."""
    return JointSpec(parent, "revolute", point, axis, lower, upper, authored)


def turntable(parent: str, point: Point, axis: Point) -> JointSpec:
    """A continuous joint: a knob, a tray."""
    return JointSpec(parent, "continuous", point, axis)


def slider(parent: str, axis: Point, upper: float) -> JointSpec:
    """A prismatic joint, its origin at the body's as the real data has it."""
    return JointSpec(parent, "prismatic", (0.0, 0.0, 0.0), axis, 0.0, upper, kind="slider")


Palette = tuple[tuple[int, int, int], ...]
SIZE = 48
"""Edge of every picture, pixels."""


def png(pixel: Callable[[int, int], int], palette: Palette) -> bytes:
    """An indexed PNG of ``SIZE`` by ``SIZE``; ``pixel(x, y)`` returns an index into ``palette``. The rows are stored,
    not deflated: a compressor's output changes between builds of zlib."""
    rows = b"".join(b"\x00" + bytes(pixel(x, y) for x in range(SIZE)) for y in range(SIZE))
    # One stored block: final-block flag, length and its complement, then the bytes (RFC 1951, 3.2.4).
    stored = b"\x78\x01\x01" + struct.pack("<HH", len(rows), len(rows) ^ 0xFFFF) + rows
    stored += struct.pack(">I", zlib.adler32(rows))
    header = struct.pack(">IIBBBBB", SIZE, SIZE, 8, 3, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"PLTE", bytes(value for rgb in palette for value in rgb)), (b"IDAT", stored)]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*chunk) for chunk in [*chunks, (b"IEND", b"")])


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _wood(x: int, y: int) -> int:
    # Boards of 12 pixels with a dark joint, and a grain that wanders by whole pixels along each board.
    if y % 12 == 0:
        return 3
    return (0, 1, 0, 2, 1)[(y * 3 + (x * (2 + y // 12) // 11) + (x * x // 97)) % 5]


def _canvas(x: int, y: int) -> int:
    if x % 24 in (0, 1) or y % 24 in (0, 1):
        return 2
    return (x + y) % 2


TEXTURES: dict[str, bytes] = {
    "wood": png(_wood, ((176, 124, 72), (164, 112, 62), (150, 100, 54), (92, 58, 30))),
    "canvas": png(_canvas, ((74, 92, 122), (84, 102, 132), (196, 170, 120))),
}
"""A texture's name → its PNG file."""
