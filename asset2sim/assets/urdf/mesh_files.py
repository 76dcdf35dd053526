"""Bringing an asset's mesh files, with their materials and textures, into a self-contained folder."""

import json
import re
import shutil
import struct
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from asset2sim.storage.regular_files import file_problem, is_file

OUTSIDE = "outside"
"""Folder for meshes that lie outside the asset's own folder."""
COPIED = (".obj", ".stl")
"""Formats that PyBullet, MuJoCo and PhysX all read; anything else is converted to OBJ."""

STL_HEADER, STL_FACE = 84, 50
"""Bytes of a binary STL file before its triangles, the last four their number, and of each triangle."""

PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".gif", ".webp")
"""Formats of the textures that a URDF's materials name."""

MATERIAL_LINE = re.compile(r"mtllib[^\S\n]+(.+?)\s*$", re.MULTILINE)
"""The statement of a library. It begins with its word, for which a search skips from place to place."""
TEXTURE_LINE = re.compile(r"^\s*(?:map_\w+|bump|disp|decal|norm)\s+(.+?)\s*$", re.MULTILINE | re.IGNORECASE)
MAX_LIBRARY_BYTES = 16 * 1024**2
"""A larger material library is none: real ones have kilobytes, and engines read them whole."""
COLLADA_PICTURE = re.compile(rb"<(?:init_from|ref)>\s*([^<]+?)\s*<")


def copy_meshes(references: Mapping[str, Path | None], source: Path, target: Path) -> dict[str, str]:
    """Copy the existing files into ``target``; reference → its new path relative to ``target``, forward slashes. Files
    under ``source`` keep their place; others go to ``outside/``, each to a folder of its own. COLLADA and glTF become
    OBJ, which every engine reads, and STL in text becomes binary. Nothing under ``source`` is written to."""
    source, target = source.resolve(), target.resolve()
    placed: dict[str, str] = {}
    taken: dict[Path, str] = {}
    for reference, file in references.items():
        if file is None:
            continue
        if file not in taken:
            place = path_in_target(file, source, len(taken))
            if file.suffix.lower() == ".stl" and is_text_stl(file):
                write_binary_stl(file, target / place)
            elif file.suffix.lower() in (*COPIED, *PICTURES):
                copy_file(file, target / place)
                if file.suffix.lower() == ".obj":
                    copy_materials(file, (target / place).parent, target)
            else:
                place = convert_to_obj(file, target, place)
            taken[file] = place
        placed[reference] = taken[file]
    return placed


def path_in_target(file: Path, source: Path, number: int) -> str:
    """A path inside the target for one file: where it lies under ``source`` (resolved), else a numbered folder of its
    own. A folder of its own keeps apart files from elsewhere that are named alike, and their material libraries."""
    try:
        return file.resolve().relative_to(source).as_posix()
    except ValueError:
        return f"{OUTSIDE}/{number}/{file.name}"


def copy_file(file: Path, place: Path) -> None:
    """Copy one file's bytes, making its folder."""
    place.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(file, place)


def copy_materials(obj: Path, folder: Path, target: Path) -> None:
    """Copy the material libraries that an OBJ names and the textures that those name, at the same relative paths. A
    relative path that would leave the target is skipped: the mesh stays, without that texture."""
    for library in libraries_of(obj):
        file, place = obj.parent / library, path_inside(folder / library, target)
        if place is None or place.is_file():
            continue
        if library_problem(file) is not None:
            continue
        copy_file(file, place)
        for name in textures_of(file):
            texture_place = path_inside(place.parent / name, target)
            if texture_place is not None and not texture_place.is_file():
                copy_file(file.parent / name, texture_place)


PathTest = Callable[[Path], bool]
"""Whether a path counts as a file that is there."""


def material_files(file: Path, within: PathTest = lambda path: True, counts: PathTest = is_file) -> list[Path]:
    """The material libraries and pictures of a mesh that are there and that ``counts`` is true of. A library of which
    ``within`` is false, or that ``library_problem`` refuses, is listed and not read."""
    with suppress(OSError):
        kind = file.suffix.lower()
        if kind == ".obj":
            libraries = [file.parent / name for name in libraries_of(file, counts)]
            read = [library for library in libraries if within(library) and library_problem(library) is None]
            return libraries + [library.parent / name for library in read for name in textures_of(library, counts)]
        names = gltf_names(file) if kind in (".gltf", ".glb") else []
        if kind == ".dae":
            names = [name.decode(errors="replace") for name in COLLADA_PICTURE.findall(file.read_bytes())]
        texts = (unquote(name.strip().replace("\\", "/").removeprefix("file://")) for name in names)
        return [path for text in texts if counts(path := file.parent / text)]
    return []


def is_there(path: Path) -> bool:
    """Whether anything but a folder is at a path, links followed: a file, or a pipe, a socket or a device."""
    try:
        return path.exists() and not path.is_dir()
    except (OSError, ValueError):
        return False


def library_problem(path: Path) -> str | None:
    """Why a path is no material library that can be read, in words that follow its name; None where it is one."""
    if (problem := file_problem(path)) is not None:
        return problem
    return None if path.stat().st_size <= MAX_LIBRARY_BYTES else f"has over {MAX_LIBRARY_BYTES >> 20} MiB"


def gltf_names(file: Path) -> list[str]:
    """Names of the buffers and pictures of a glTF file, without those that it holds; none where it is broken."""
    content = file.read_bytes()
    if content[:4] == b"glTF":
        content = content[20 : 20 + int.from_bytes(content[12:16], "little")]
    try:
        tree = json.loads(content)
        parts = [part for kind in ("buffers", "images") for part in tree.get(kind, ())]
        return [str(part["uri"]) for part in parts if "uri" in part and not str(part["uri"]).startswith("data:")]
    except (ValueError, AttributeError, TypeError, RecursionError):
        return []


def without_materials(obj: bytes) -> bytes:
    """An OBJ without the lines that name material libraries."""
    return re.sub(rb"^[ \t]*mtllib\b[^\n]*$", b"", obj, flags=re.MULTILINE)


def libraries_of(obj: Path, counts: PathTest = is_file) -> list[str]:
    """Names of an OBJ's material libraries that exist, as the OBJ writes them."""
    head = read_head(obj)
    stated = [found for found in MATERIAL_LINE.finditer(head) if begins_line(head, found.start())]
    return [found[1] for found in stated if counts(obj.parent / found[1])]


def begins_line(text: str, place: int) -> bool:
    """Whether only blanks stand before a place in its line."""
    return not text[text.rfind("\n", 0, place) + 1 : place].strip()


def textures_of(library: Path, counts: PathTest = is_file) -> list[str]:
    """Names of a material library's textures that exist, as it writes them, without the options before the name."""
    names = []
    for line in TEXTURE_LINE.findall(library.read_text(encoding="utf-8", errors="replace")):
        name = line if counts(library.parent / line) else line.split()[-1]
        if counts(library.parent / name):
            names.append(name)
    return names


def read_head(obj: Path) -> str:
    """The beginning of an OBJ file, where ``mtllib`` stands by convention."""
    with obj.open("rb") as stream:
        return stream.read(65_536).decode("utf-8", errors="replace")


def path_inside(path: Path, folder: Path) -> Path | None:
    """The normalised path if it lies inside the folder, which is resolved, else None."""
    resolved = path.resolve()
    return resolved if resolved.is_relative_to(folder) else None


def is_text_stl(file: Path) -> bool:
    """Whether an STL file is in text, which PyBullet shows nothing of and MuJoCo refuses."""
    with file.open("rb") as stream:
        head = stream.read(STL_HEADER)
    faces = struct.unpack_from("<I", head, STL_HEADER - 4)[0] if len(head) == STL_HEADER else 0
    # Headers of binary files may begin with this word, too: their size tells.
    return head.lstrip().startswith(b"solid") and file.stat().st_size != STL_HEADER + STL_FACE * faces


def write_binary_stl(file: Path, place: Path) -> None:
    """Write the triangles of an STL file in binary, making its folder."""
    import trimesh  # late: not needed to list an asset's files

    from asset2sim.assets.meshes.load import load_scene

    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_bytes(trimesh.exchange.stl.export_stl(load_scene(file).to_mesh()))


def convert_to_obj(file: Path, target: Path, place: str) -> str:
    """Write a COLLADA or glTF file as OBJ with its materials beside it; the new path relative to the target."""
    path = PurePosixPath(place)
    # One folder a file: exporters name their material and texture files alike.
    folder = target / path.parent / path.name.replace(".", "_")
    folder.mkdir(parents=True, exist_ok=True)
    import trimesh  # late: not needed to list an asset's files

    from asset2sim.assets.meshes.load import load_scene

    mesh = load_scene(file).to_mesh()
    paint = getattr(mesh.visual, "material", None)
    if isinstance(paint, trimesh.visual.material.PBRMaterial) and paint.baseColorTexture and not paint.baseColorFactor:
        paint.baseColorFactor = (255, 255, 255, 255)  # else trimesh writes a grey that darkens the picture
    text, extras = trimesh.exchange.obj.export_obj(mesh, mtl_name=f"{path.stem}.mtl", return_texture=True)
    (folder / f"{path.stem}.obj").write_text(text, encoding="utf-8")
    for name, data in extras.items():
        (folder / name).write_bytes(data if isinstance(data, bytes) else str(data).encode())
    return (folder / f"{path.stem}.obj").relative_to(target).as_posix()
