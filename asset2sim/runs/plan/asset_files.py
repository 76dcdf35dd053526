"""The files that an asset consists of."""

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.urdf.mesh_files import material_files
from asset2sim.assets.urdf.references import (
    ANYWHERE,
    MOST_DESCRIBED,
    AllowedFolders,
    check_within,
    find_within,
    outer_references,
)
from asset2sim.intake.locate import find_source
from asset2sim.storage.regular_files import read_regular
from schemas.errors import AssetError

OUTSIDE = -1_000_000
"""In the place of a size: what lies outside and is not followed."""


@dataclass(frozen=True)
class AssetFile:
    """One file: its name within the asset, its path, and the metadata that change with its content. A negative ``size``
    is no file: a folder that cannot be listed, or what lies outside and is not followed, which has no path."""

    name: str
    path: str
    size: int
    mtime_ns: int
    ctime_ns: int
    inode: int


def asset_files(folder: Path, reach: AllowedFolders) -> list[AssetFile]:
    """Every file in the asset's folder but hidden ones, by name, and those elsewhere that its URDF refers to, as far as
    they exist and lie within ``reach``. Empty where there is no such folder.

    A folder is entered once; for what lies outside, and for a folder that cannot be listed, there is an entry in the
    place of the files.
    """
    if not reach.allows(folder):
        return [_refused(str(folder))]
    inner = sorted(_walk(folder, reach), key=lambda file: file.name)
    return inner + _outer(folder, reach, [Path(file.path) for file in inner if file.name.endswith(".xacro")])


def files_below(folder: Path) -> Iterator[AssetFile]:
    """The regular files below a folder but hidden ones; none where there is no such folder."""
    return _walk(folder, ANYWHERE)


def _walk(top: Path, reach: AllowedFolders) -> Iterator[AssetFile]:
    """The regular files below a folder, each folder once."""
    try:
        home = top.resolve()
    except (OSError, RuntimeError):
        return
    seen: set[tuple[int, int]] = set()
    left = [("", str(top))]
    while left:
        prefix, folder = left.pop()
        try:
            entries = _unseen(folder, seen)
        except OSError as error:
            entries = []
            if prefix:
                yield AssetFile(prefix, folder, -(error.errno or 1), 0, 0, 0)
        for entry in entries:
            name = f"{prefix}{entry.name}"
            if entry.name.startswith("."):
                continue
            if entry.is_symlink() and (beyond := _beyond(name, entry.path, home, reach)) is not None:
                yield from beyond
            elif os.path.isdir(entry.path):
                left.append((f"{name}/", entry.path))
            elif (found := _file(name, entry.path)) is not None:
                yield found


def _unseen(folder: str, seen: set[tuple[int, int]]) -> list[os.DirEntry[str]]:
    """The entries of a folder that was not ``seen``; now it is. Raises OSError."""
    status = os.stat(folder)
    if (status.st_dev, status.st_ino) in seen:
        return []
    seen.add((status.st_dev, status.st_ino))
    with os.scandir(folder) as entries:
        return list(entries)


def _beyond(name: str, path: str, home: Path, reach: AllowedFolders) -> list[AssetFile] | None:
    """None for a link that is followed, else what stands for it: nothing where it leads back, to a folder that holds
    the asset's own, and its target where it leads outside."""
    try:
        target = Path(path).resolve()
    except (OSError, RuntimeError):
        return []
    if home.is_relative_to(target):
        return []
    return None if reach.allows(target) else [_refused(f"{name} -> {target}")]


def _outer(folder: Path, reach: AllowedFolders, xacros: list[Path]) -> list[AssetFile]:
    """Meshes that the asset takes from outside the asset's folder, with their materials and textures, by reference;
    ``xacros`` are all such files in its folder."""
    try:
        urdf = check_within(find_source(folder, reach.allows), reach)
    except (AssetError, OSError):
        return []
    found: dict[str, AssetFile] = {}
    # What a xacro includes may lie outside as well, and refer to more.
    unread = [urdf, *(xacros if urdf.suffix == ".xacro" else ())]
    read: set[Path] = set()
    while unread:
        source = unread.pop()
        read.add(source)
        try:
            text = read_regular(source, MOST_DESCRIBED).decode("utf-8", errors="replace")
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


def _with_materials(reference: str, mesh: Path, reach: AllowedFolders) -> dict[str, AssetFile]:
    found = {}
    for path in (mesh, *material_files(mesh, reach.allows)):
        name = f"{reference} {path.name}"
        file = _file(name, str(path)) if reach.allows(path) else _refused(name)
        if file is not None:
            found[name] = file
    return found


def _refused(name: str) -> AssetFile:
    """A link that leads outside: that it is not followed is a part of what the asset is."""
    return AssetFile(name, "", OUTSIDE, 0, 0, 0)


def _file(name: str, path: str) -> AssetFile | None:
    try:
        found = os.stat(path)
    except OSError:
        return None
    # Reading a pipe or a socket would block.
    if not stat.S_ISREG(found.st_mode):
        return None
    return AssetFile(name, path, found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino)
