"""The files that an asset consists of."""

import os
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.regular import read_regular
from asset2sim.assets.urdf.locate import MOST_DESCRIBED, find_mesh, find_source, outer_references
from asset2sim.assets.urdf.mesh_files import material_files
from schemas.errors import AssetError

OUTSIDE = -1_000_000
"""In the place of a size: a link that leads outside and is not followed."""


@dataclass(frozen=True)
class AssetFile:
    """One file: its name within the asset, its path, and the metadata that change with its content. A negative ``size``
    is no file: a folder that cannot be listed, or a link that is not followed."""

    name: str
    path: str
    size: int
    mtime_ns: int
    ctime_ns: int
    inode: int


Allows = Callable[[Path], bool]


def anywhere(path: Path) -> bool:
    """That a link may lead to any path."""
    return True


def below(*folders: Path) -> Allows:
    """Whether a resolved path is one of these folders, or lies in one."""
    roots = [folder.resolve() for folder in folders]
    return lambda path: any(path.is_relative_to(root) for root in roots)


def asset_files(folder: Path, allows: Allows = anywhere) -> list[AssetFile]:
    """Every file in the asset's folder but hidden ones, by name, and those elsewhere that its URDF refers to, as far as
    they exist. Empty where there is no such folder.

    A folder is entered once, and a link is followed only where its target, resolved, is one that ``allows``; for one
    that is not, and for a folder that cannot be listed, there is an entry in the place of the files.
    """
    inner = sorted(_walk(folder, allows), key=lambda file: file.name)
    return inner + _outer(folder)


def files_below(folder: Path) -> Iterator[AssetFile]:
    """The regular files below a folder but hidden ones; none where there is no such folder."""
    return _walk(folder, anywhere)


def _walk(top: Path, allows: Allows) -> Iterator[AssetFile]:
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
            if entry.is_symlink() and (beyond := _beyond(name, entry.path, home, allows)) is not None:
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


def _beyond(name: str, path: str, home: Path, allows: Allows) -> list[AssetFile] | None:
    """None for a link that is followed, else what stands for it: nothing where it leads back, to a folder that holds
    the asset's own, and its target where it leads outside."""
    try:
        target = Path(path).resolve()
    except (OSError, RuntimeError):
        return []
    if home.is_relative_to(target):
        return []
    if allows(target):
        return None
    return [AssetFile(f"{name} -> {target}", path, OUTSIDE, 0, 0, 0)]


def _outer(folder: Path) -> list[AssetFile]:
    """Meshes that the asset takes from outside the asset's folder, with their materials and textures, by reference."""
    try:
        urdf = find_source(folder)
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
            text = read_regular(source, MOST_DESCRIBED).decode("utf-8", errors="replace")
        except OSError:
            continue
        for reference in outer_references(text):
            mesh = find_mesh(reference, source.parent)
            if mesh is None or mesh.resolve().is_relative_to(folder.resolve()):
                continue
            if mesh.suffix == ".xacro" and mesh not in read:
                unread.append(mesh)
            for path in (mesh, *material_files(mesh)):
                name = f"{reference} {path.name}"
                if (file := _file(name, str(path))) is not None:
                    found[name] = file
    return list(found.values())


def _file(name: str, path: str) -> AssetFile | None:
    try:
        found = os.stat(path)
    except OSError:
        return None
    # Reading a pipe or a socket would block.
    if not stat.S_ISREG(found.st_mode):
        return None
    return AssetFile(name, path, found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino)
