"""Pictures for the sample objects, written as PNG files whose bytes depend on nothing but this module."""

import struct
import zlib
from collections.abc import Callable

Palette = tuple[tuple[int, int, int], ...]
SIZE = 48
"""Edge of every picture, pixels."""


def png(pixel: Callable[[int, int], int], palette: Palette) -> bytes:
    """An indexed PNG of ``SIZE`` by ``SIZE``; ``pixel(x, y)`` returns an index into ``palette``.

    The rows are stored, not deflated: a compressor's output changes between builds of zlib.
    """
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
