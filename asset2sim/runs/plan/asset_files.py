"""The files that an asset consists of."""

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.urdf.locate import find_source, outer_references
from asset2sim.assets.urdf.mesh_files import material_files
from asset2sim.assets.urdf.reach import Reach, check_within, find_within
from schemas.errors import AssetError


@dataclass(frozen=True)
class AssetFile:
    """One file: its name within the asset, its path, and the metadata that change with its content. A link that is not
    followed, since it leads outside, has no path."""

    name: str
    path: str
    size: int
    mtime_ns: int
    ctime_ns: int
    inode: int


def asset_files(folder: Path, reach: Reach) -> list[AssetFile]:
    """Every file in the asset's folder but hidden ones, by name, and those elsewhere that its URDF refers to, as far as
    they exist and lie within ``reach``; what lies outside is listed without a path. Empty where there is no such
    folder."""
    if not reach.allows(folder):
        return [_refused(str(folder))]
    inner = sorted(_walk(str(folder), "", set(), reach), key=lambda file: file.name)
    return inner + _outer(folder, reach)


def _walk(folder: str, prefix: str, seen: set[tuple[int, int]], reach: Reach) -> Iterator[AssetFile]:
    """The regular files below a folder, links followed, each folder once."""
    try:
        status = os.stat(folder)
        entries = list(os.scandir(folder))
    except OSError:
        return
    if (status.st_dev, status.st_ino) in seen:
        return
    seen.add((status.st_dev, status.st_ino))
    for entry in entries:
        if entry.name.startswith("."):
            continue
        if entry.is_symlink() and not reach.allows(Path(entry.path)):
            yield _refused(f"{prefix}{entry.name}")
        elif entry.is_dir():
            yield from _walk(entry.path, f"{prefix}{entry.name}/", seen, reach)
        elif (found := _file(f"{prefix}{entry.name}", entry.path)) is not None:
            yield found


def _outer(folder: Path, reach: Reach) -> list[AssetFile]:
    """Meshes that the asset takes from outside the asset's folder, with their materials and textures, by reference."""
    try:
        urdf = check_within(find_source(folder, reach.allows), reach)
    except (AssetError, OSError):
        return []
    found: dict[str, AssetFile] = {}
    # What a xacro includes may lie outside as well, and refer to more.
    unread = [urdf, *(folder.rglob("*.xacro") if urdf.suffix == ".xacro" else ())]
    read: set[Path] = set()
    while unread:
        source = unread.pop()
        read.add(source)
        try:
            text = source.read_text(encoding="utf-8", errors="replace")
        except OSError:
            continue
        for reference in outer_references(text):
            mesh, outside = find_within(reference, source.parent, reach)
            if outside is not None:
                found[reference] = _refused(reference)
            if mesh is None or mesh.resolve().is_relative_to(folder.resolve()):
                continue
            if mesh.suffix == ".xacro" and mesh not in read:
                unread.append(mesh)
            found |= _with_materials(reference, mesh, reach)
    return list(found.values())


def _with_materials(reference: str, mesh: Path, reach: Reach) -> dict[str, AssetFile]:
    found = {}
    for path in (mesh, *material_files(mesh, reach.allows)):
        name = f"{reference} {path.name}"
        file = _file(name, str(path)) if reach.allows(path) else _refused(name)
        if file is not None:
            found[name] = file
    return found


def _refused(name: str) -> AssetFile:
    """A link that leads outside: that it is not followed is a part of what the asset is."""
    return AssetFile(name, "", 0, 0, 0, 0)


def _file(name: str, path: str) -> AssetFile | None:
    try:
        found = os.stat(path)
    except OSError:
        return None
    # Reading a pipe or a socket would block.
    if not stat.S_ISREG(found.st_mode):
        return None
    return AssetFile(name, path, found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino)
