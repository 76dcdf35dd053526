"""Content of OBJ files as exporters write them, triangles from 1 on, in a third of the time of trimesh, which reads all
others. Each content is parsed once in a process, for extraction, views and engines."""

import hashlib
import re
import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from asset2sim.physics.arrays import Array

Ints = NDArray[np.int64]

RUNS = re.compile(rb"((?:v [^\n]*\n)+)|((?:vn [^\n]*\n)+)|((?:vt [^\n]*\n)+)|((?:f [^\n]*\n)+)|[^\n]*\n")
"""What follows each other: lines of vertices, of normals, of texture coordinates, of faces, or any other line."""
COLUMNS = (3, 3, 2)
"""Numbers of a line of each of the first three."""
WITHOUT_EFFECT = (b"", b"o", b"g", b"s")
BLANK = bytes.maketrans(b"vntf/", b"     ")
KNOWN: dict[bytes, "ObjFile | None"] = {}
"""Digest of a content → what it holds."""
MOST_KNOWN, MOST_KNOWN_BYTES = 2048, 2_000_000
"""Contents that are kept, eight times what most assets have, and the largest of them, bytes: all but scans."""


@dataclass(frozen=True, eq=False)
class ObjPart:
    """Triangles of one material: (n, 3) ``vertices``, m, (m, 3) ``faces``, (n, 3) ``normals`` and (n, 2) ``uv`` where
    the file has them, all read-only, and the name of the ``material``, empty where there is none."""

    vertices: Array
    faces: Ints
    normals: Array | None
    uv: Array | None
    material: str


@dataclass(frozen=True, eq=False)
class ObjFile:
    """An OBJ's parts as trimesh groups and orders them, the file of their materials, which may be empty, and the (n, 3)
    vertices that faces use, each once, in the file's order."""

    parts: tuple[ObjPart, ...]
    library: str
    points: Array

    @cached_property
    def mesh(self) -> tuple[Array, Ints]:
        """(n, 3) vertices and (m, 3) faces of all parts."""
        starts = np.cumsum([0, *(len(part.vertices) for part in self.parts[:-1])])
        faces = [part.faces + start for part, start in zip(self.parts, starts, strict=True)]
        return np.vstack([part.vertices for part in self.parts]), np.vstack(faces)


def read_obj(content: bytes) -> ObjFile | None:
    """Content of an OBJ; None where trimesh reads it: polygons, relative numbers, coloured vertices, broken files."""
    if len(content) > MOST_KNOWN_BYTES:
        return parse_obj(content)
    key = hashlib.sha256(content).digest()
    if key not in KNOWN:
        if len(KNOWN) >= MOST_KNOWN:
            KNOWN.clear()
        KNOWN[key] = parse_obj(content)
    return KNOWN[key]


@dataclass(frozen=True, eq=False)
class _Content:
    """The ``tables`` of vertices, normals and texture coordinates, material → runs of (m, 3, k) corners and the table
    of each of the k, and the file of the materials."""

    tables: tuple[list[Array], ...]
    faces: dict[bytes, list[tuple[Ints, tuple[int, ...]]]]
    library: bytes


def parse_obj(text: bytes) -> ObjFile | None:
    """``read_obj``, parsed now."""
    content = _content_of(text.replace(b"\r\n", b"\n") + b"\n")
    if content is None or not content.faces:
        return None
    whole = [np.concatenate(table) if table else np.zeros((0, 1)) for table in content.tables]
    found, used = [], np.zeros(len(whole[0]), dtype=bool)
    for name, runs in reversed(content.faces.items()):
        corners, tables = None, runs[0][1]
        if all(of == tables for _, of in runs):
            corners = np.concatenate([run for run, _ in runs])
        part = None if corners is None else part_of(corners, tables, whole)
        if corners is None or part is None:
            return None
        used[corners[..., 0]] = True
        found.append(ObjPart(*part, name.decode(errors="replace")))
    read = ObjFile(tuple(found), content.library.decode(errors="replace"), whole[0][used])
    for array in (
        read.points,
        *(value for part in found for value in (part.vertices, part.faces, part.normals, part.uv)),
    ):
        if array is not None:
            array.flags.writeable = False
    return read


def _content_of(text: bytes) -> _Content | None:
    """An OBJ's numbers; None where there is anything that is not known here."""
    content, material, library = _Content(([], [], []), {}, b""), b"", b""
    for run in RUNS.finditer(text):
        kind, lines = run.lastindex, run[0]
        if kind is None:
            word, _, rest = lines.strip().partition(b" ")
            if word == b"usemtl":
                material = rest.strip()
            elif word == b"mtllib":
                library = library or rest.strip()
            elif word not in WITHOUT_EFFECT and not word.startswith(b"#"):
                return None
        elif not add_run(content, kind - 1, lines, material):
            return None
    return _Content(content.tables, content.faces, library)


def add_run(content: _Content, kind: int, lines: bytes, material: bytes) -> bool:
    """Add the numbers of a run of lines; returns whether they are as expected."""
    if kind == len(COLUMNS):
        corners = corners_of(lines)
        if corners is not None:
            content.faces.setdefault(material, []).append(corners)
        return corners is not None
    numbers = numbers_of(lines, np.float64)
    if numbers is None or numbers.size != COLUMNS[kind] * lines.count(b"\n"):
        return False
    content.tables[kind].append(numbers.reshape(-1, COLUMNS[kind]))
    return True


def numbers_of(text: bytes, kind: type) -> np.ndarray | None:
    """The numbers of lines, flat; None where anything else is among them."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text.translate(BLANK), dtype=kind, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


def corners_of(text: bytes) -> tuple[Ints, tuple[int, ...]] | None:
    """Triangles as (m, 3, k) numbers from 0 on, and of which table each of the k is; None for other polygons."""
    lines, slashes, doubled = text.count(b"\n"), text.count(b"/"), text.count(b"//")
    tables = {
        (0, 0): (0,), (3 * lines, 0): (0, 2), (6 * lines, 0): (0, 2, 1), (6 * lines, 3 * lines): (0, 1),
    }.get((slashes, doubled))  # fmt: skip
    numbers = numbers_of(text, np.int64)
    if tables is None or numbers is None or numbers.size != 3 * lines * len(tables):
        return None
    return numbers.reshape(-1, 3, len(tables)) - 1, tables


def part_of(
    corners: Ints, tables: tuple[int, ...], whole: list[Array]
) -> tuple[Array, Ints, Array | None, Array | None] | None:
    """Vertices, faces, normals and texture coordinates of (m, 3, k) corners; None where a number is out of range."""
    key = np.zeros(corners.shape[:2], dtype=np.int64)
    for column, table in enumerate(tables):
        count, numbers = len(whole[table]), corners[..., column]
        if numbers.min() < 0 or numbers.max() >= count:
            return None
        key = key * count + numbers
    _, first, inverse = np.unique(key.ravel(), return_index=True, return_inverse=True)
    rows = corners.reshape(-1, len(tables))[first]
    values = {table: whole[table][rows[:, column]] for column, table in enumerate(tables)}
    normals = values.get(1)
    return values[0], inverse.reshape(-1, 3), None if normals is None else np.nan_to_num(normals), values.get(2)
