"""OBJ files as exporters write them, triangles from 1 on, to painted surfaces: in a third of the time of trimesh, which
reads whatever else there is."""

import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from trimesh.exchange.obj import parse_mtl
from trimesh.resolvers import Resolver
from trimesh.visual.material import SimpleMaterial

from asset2sim.assets.surfaces.surface import Floats, Ints

RUNS = re.compile(rb"((?:v [^\n]*\n)+)|((?:vn [^\n]*\n)+)|((?:vt [^\n]*\n)+)|((?:f [^\n]*\n)+)|[^\n]*\n")
"""What follows each other: lines of vertices, of normals, of texture coordinates, of faces, or any other line."""
COLUMNS = (3, 3, 2)
"""Numbers of a line of each of the first three."""
WITHOUT_EFFECT = (b"", b"o", b"g", b"s")
BLANK = bytes.maketrans(b"vntf/", b"     ")


@dataclass(frozen=True, eq=False)
class MaterialMesh:
    """Triangles of one material: (n, 3) ``vertices``, m, (m, 3) ``faces``, (n, 3) ``normals`` and (n, 2) ``uv`` where
    the file has them, and the ``material``, None where it names none that is known."""

    vertices: Floats
    faces: Ints
    normals: Floats | None
    uv: Floats | None
    material: SimpleMaterial | None


@dataclass(frozen=True, eq=False)
class ObjContent:
    """Content of an OBJ: its ``tables`` of vertices, normals and texture coordinates, material → runs of (m, 3, k)
    corners and the table of each of the k, and the file of the materials, which may be empty."""

    tables: tuple[list[Floats], ...]
    faces: dict[bytes, list[tuple[Ints, tuple[int, ...]]]]
    library: bytes


def plain_obj(path: Path, resolver: Resolver) -> list[MaterialMesh] | None:
    """An OBJ's triangles as ``trimesh`` groups them; None where it is to be read by that: what has polygons, relative
    numbers, colours of vertices, or is broken. Materials come through the ``resolver``. Raises OSError."""
    content = content_of(path.read_bytes().replace(b"\r\n", b"\n") + b"\n")
    if content is None:
        return None
    whole = [np.concatenate(table) if table else np.zeros((0, 1)) for table in content.tables]
    materials = materials_of(content.library, resolver)
    found = []
    for name, runs in reversed(content.faces.items()):
        corners, tables = None, runs[0][1]
        if all(of == tables for _, of in runs):
            corners = np.concatenate([run for run, _ in runs])
        part = None if corners is None else part_of(corners, tables, whole)
        if part is None:
            return None
        found.append(MaterialMesh(*part, materials.get(name.decode(errors="replace"))))
    return found or None


def content_of(text: bytes) -> ObjContent | None:
    """An OBJ's numbers; None where there is anything that is not known here."""
    content, material, library = ObjContent(([], [], []), {}, b""), b"", b""
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
    return ObjContent(content.tables, content.faces, library)


def add_run(content: ObjContent, kind: int, lines: bytes, material: bytes) -> bool:
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
    """Lines of triangles as (m, 3, k) numbers from 0 on, and of which of the three tables each of the k is; None for
    other polygons and mixed ones."""
    lines, slashes, doubled = text.count(b"\n"), text.count(b"/"), text.count(b"//")
    tables = {
        (0, 0): (0,), (3 * lines, 0): (0, 2), (6 * lines, 0): (0, 2, 1), (6 * lines, 3 * lines): (0, 1),
    }.get((slashes, doubled))  # fmt: skip
    numbers = numbers_of(text, np.int64)
    if tables is None or numbers is None or numbers.size != 3 * lines * len(tables):
        return None
    return numbers.reshape(-1, 3, len(tables)) - 1, tables


def part_of(
    corners: Ints, tables: tuple[int, ...], whole: list[Floats]
) -> tuple[Floats, Ints, Floats | None, Floats | None] | None:
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


def materials_of(library: bytes, resolver: Resolver) -> dict[str, SimpleMaterial]:
    """The materials of a library by name; none where it cannot be read."""
    if not library:
        return {}
    try:
        found = parse_mtl(resolver[library.decode(errors="replace")], resolver=resolver)
        return {name: SimpleMaterial(**values) for name, values in found.items()}
    except Exception:  # a file that is missing or broken costs its colours
        return {}
