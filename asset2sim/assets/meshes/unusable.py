"""Why a mesh file cannot be used: each cause by name, with what to do about it."""

import json
import re
import struct
from pathlib import Path

import numpy as np

from asset2sim.physics.arrays import Array, Faces

MESHES = (".obj", ".stl", ".dae", ".gltf", ".glb", ".ply", ".off", ".3mf")
"""Formats that are read."""
LARGEST_M = 1e9
"""Largest coordinate of a mesh at its scale, m: an object of a metre written in nanometres."""
LARGEST_SQUARED = 1e100
"""Largest coordinate whose products are finite."""
SMALLEST_M = 1e-9
"""Smallest longest edge of a mesh at its scale, m."""
AGAIN = "export the mesh again"
_BEGINNINGS = (
    (
        b"version https://git-lfs.github.com/spec/",
        "Git LFS pointer, not the mesh: run `git lfs pull` in its repository",
    ),
    (b"/annex/objects/", "git-annex pointer, not the mesh: run `git annex get` in its repository"),
    (b"PK\x03\x04", "zip archive: unpack it"),
    (b"\x1f\x8b", "gzip archive: unpack it"),
    (b"\x89PNG", "PNG picture: name the mesh"),
    (b"\xff\xd8\xff", "JPEG picture: name the mesh"),
    (b"%PDF", "PDF document: name the mesh"),
    (b"<!doctype html", "web page, likely of a download that failed: download the mesh again"),
    (b"<html", "web page, likely of a download that failed: download the mesh again"),
)
_FORMATS = (
    (rb"glTF", (".glb",)), (rb"ply\s", (".ply",)), (rb"[A-Z]*OFF\s", (".off",)), (rb"\s*\{", (".gltf",)),
    (rb"\s*(<\?xml[^>]*>\s*)?(<!--.*?-->\s*)*<COLLADA", (".dae",)), (rb"solid\b[^\n]*\n\s*facet\s", (".stl",)),
    (rb"(\s*(#[^\n]*)?\n)*\s*(mtllib|o|g|v|vn|vt)\s", (".obj",)),
)  # fmt: skip


class UnusableMeshError(ValueError):
    """A mesh that cannot be used: ``problem`` is the cause and the remedy, to follow the mesh's name."""

    def __init__(self, problem: str, file: str = "") -> None:
        super().__init__(f"{file}: {problem}" if file else problem)
        self.problem = problem


def check_mesh_file(path: Path, largest_mb: float) -> None:
    """Refuse a file that is no mesh by its size, its ending or its first bytes. Raises UnusableMeshError."""
    suffix = path.suffix.lower()
    if suffix not in MESHES:
        known = ", ".join(MESHES)
        raise UnusableMeshError(f"has the ending '{path.suffix}', which is no format that is read: use one of {known}")
    size, head = beginning_of(path, largest_mb)
    check_kind(path, suffix, head)
    if suffix == ".stl" and not head.lstrip().startswith(b"solid"):
        check_binary_stl(head, size)
    if suffix == ".glb" and (len(head) < 12 or struct.unpack_from("<I", head, 8)[0] > size):
        raise UnusableMeshError(f"ends before its last byte, by its own header: copy it again, or {AGAIN}")


def beginning_of(path: Path, largest_mb: float) -> tuple[int, bytes]:
    """A file's size and its first bytes. Raises UnusableMeshError where it is empty, too large or cannot be read."""
    try:
        size = path.stat().st_size
        with path.open("rb") as stream:
            head = stream.read(512)
    except OSError as error:
        reason = f"cannot be read ({error.strerror}): give the user that runs this the right to read it"
        raise UnusableMeshError(reason) from error
    if size == 0:
        raise UnusableMeshError("is empty: restore the file")
    if size > largest_mb * 1e6:
        problem = f"has {size / 1e6:.0f} MB, more than the {largest_mb:g} MB that are read: simplify it"
        raise UnusableMeshError(f"{problem}, or raise inputs.max_mesh_mb in a settings file")
    return size, head


def check_kind(path: Path, suffix: str, head: bytes) -> None:
    """Refuse a file whose first bytes are another kind's than its ending says. Raises UnusableMeshError."""
    other = other_kind(head)
    if other is not None and not (suffix == ".3mf" and head.startswith(b"PK")):
        raise UnusableMeshError(f"is a {other}")
    held = next((kinds for pattern, kinds in _FORMATS if re.match(pattern, head, re.DOTALL)), None)
    if held is not None and suffix not in held:
        problem = f"is {held[0][1:].upper()} by its content, and {suffix[1:].upper()} by its ending"
        raise UnusableMeshError(f"{problem}: rename it to '{path.stem}{held[0]}', and in the URDF")
    if suffix in (".obj", ".dae", ".gltf", ".off") and b"\x00" in head:
        raise UnusableMeshError(f"holds binary data, where {suffix[1:].upper()} is text: {AGAIN}")


def other_kind(head: bytes) -> str | None:
    """The kind of a file that is neither a mesh nor a description, by its first bytes, and what to do about it."""
    return next((what for beginning, what in _BEGINNINGS if head.lower().startswith(beginning.lower())), None)


def check_binary_stl(head: bytes, size: int) -> None:
    """Refuse a binary STL that has fewer triangles than its header says. Raises UnusableMeshError."""
    count = struct.unpack_from("<I", head, 80)[0] if len(head) >= 84 else -1
    if count == 0:
        raise UnusableMeshError(f"holds no triangle: {AGAIN}")
    if not 0 < count <= (size - 84) // 50:
        said = "" if count < 0 else f": {max(size - 84, 0) // 50} of {count} triangles are there"
        raise UnusableMeshError(f"is cut off, or no STL{said}: copy it again, or {AGAIN}")


def why_unreadable(path: Path, error: Exception) -> str:
    """Cause and remedy where a format's parser has raised."""
    text = " ".join(str(error).split())
    if "escapes resolver root" in text:
        named = text.split("'")[1] if "'" in text else "a file"
        return f"names '{named}', which lies outside its folder: bring that file beside it"
    broken = isinstance(error, json.JSONDecodeError) or "XMLSyntaxError" in type(error).__name__ or "Pars" in text
    if path.suffix.lower() == ".gltf" and not is_json(path):
        broken, text = True, "it is no JSON"
    if broken:
        return f"is cut off, or no {path.suffix[1:].upper()} ({text[:200]}): {AGAIN}"
    if isinstance(error, FileNotFoundError) or "not found" in text.lower():
        return f"names a file that is not there ({text[:200]}): bring it beside the mesh"
    if isinstance(error, IndexError):
        return f"has faces of vertices that it does not hold: it is cut off, or its numbering is wrong; {AGAIN}"
    kind = type(error).__name__
    return f"cannot be read as a mesh ({kind}: {text[:200]}): {AGAIN}" if text else f"cannot be read ({kind}): {AGAIN}"


def is_json(path: Path) -> bool:
    """Whether a file is JSON throughout."""
    try:
        json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return False
    return True


def check_geometry(vertices: Array, faces: Faces) -> None:
    """Refuse triangles whose vertices are missing or not finite, and none. Raises UnusableMeshError."""
    if len(faces) == 0:
        raise UnusableMeshError(f"holds no triangle: {AGAIN} with its faces")
    low, high = int(faces.min()), int(faces.max())
    if low < 0 or high >= len(vertices):
        wrong = high + 1 if high >= len(vertices) else low + 1
        problem = (
            f"has a face of vertex {wrong}, and {len(vertices)} vertices: it is cut off, or its numbering is wrong"
        )
        raise UnusableMeshError(f"{problem}; {AGAIN}")
    spoilt = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(spoilt):
        problem = f"has vertices that are not finite (NaN or infinite; number {spoilt[0] + 1}"
        raise UnusableMeshError(f"{problem} of {len(vertices)}): {AGAIN}")
    largest = float(np.abs(vertices).max())
    if largest > LARGEST_SQUARED:
        raise UnusableMeshError(f"reaches {largest:.3g} m from its origin: mend its vertices or its scale")


def check_size(vertices: Array, scale: Array) -> None:
    """Refuse a mesh that is of no believable size at its (3,) scale. Raises UnusableMeshError."""
    if not (np.isfinite(scale).all() and np.all(scale)):
        words = " ".join(f"{value + 0.0:g}" for value in scale)
        raise UnusableMeshError(
            f"has the scale '{words}', which leaves nothing of it: state three numbers, none of them 0"
        )
    with np.errstate(over="ignore"):
        largest = float(np.abs(vertices * scale).max())
        edge = float(np.ptp(vertices * scale, axis=0).max())
    if not largest <= LARGEST_M:
        raise UnusableMeshError(f"reaches {largest:.3g} m from its origin: mend its vertices or its scale")
    if edge < SMALLEST_M:
        raise UnusableMeshError(f"is {edge:.3g} m large: mend its vertices or its scale")
