"""The files that an asset consists of."""

import os
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.companions import COMPANIONS
from asset2sim.assets.urdf.mesh_files import material_files
from asset2sim.assets.urdf.references import (
    ANYWHERE,
    MOST_DESCRIBED,
    AllowedFolders,
    all_references,
    check_within,
    find_within,
    mesh_folders,
    outer_references,
)
from asset2sim.intake.formats import FORMATS
from asset2sim.intake.locate import find_source
from asset2sim.storage.regular_files import is_file, read_regular
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


def asset_files(asset: Path, reach: AllowedFolders) -> list[AssetFile]:
    """Every file in the asset's folder but hidden ones, by name, and those elsewhere that its URDF refers to, as far as
    they exist and lie within ``reach``; of an asset that is one file, that file, all that it refers to and what says
    more of it. Empty where there is no such folder.

    A folder is entered once; for what lies outside, and for a folder that cannot be listed, there is an entry in the
    place of the files.
    """
    if not reach.allows(asset):
        return [_refused(str(asset))]
    if is_file(asset):
        beside = [asset, *(asset.parent / name for name in COMPANIONS)]
        own = [file for path in beside if reach.allows(path) and (file := _file(path.name, str(path))) is not None]
        return own + _referred([asset], None, reach)
    inner = sorted(_walk(asset, reach), key=lambda file: file.name)
    try:
        source = check_within(find_source(asset, reach.allows), reach)
    except (AssetError, OSError):
        return inner
    # What a xacro includes may lie outside as well, and refer to more.
    xacros = [Path(file.path) for file in inner if file.name.endswith(".xacro")] if source.suffix == ".xacro" else []
    return inner + _referred([source, *xacros], asset, reach)


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


def _referred(sources: list[Path], home: Path | None, reach: AllowedFolders) -> list[AssetFile]:
    """Files that descriptions and includes refer to, with materials and textures, but not below ``home``."""
    found: dict[str, AssetFile] = {}
    inside = None if home is None else home.resolve()
    texts, folders = _included(sources, reach), dict[Path, None]()
    for source, text in texts.items():
        folders |= dict.fromkeys(source.parent / folder for folder in mesh_folders(text))
    inner = inside is not None and all(folder.resolve().is_relative_to(inside) for folder in folders)
    for source, text in texts.items():
        for reference in outer_references(text) if inner else all_references(text):
            means = [find_within(reference, folder, reach) for folder in (source.parent, *folders)]
            file = next((file for file, _ in means if file is not None), None)
            if any(outside is not None for _, outside in means):
                found[reference] = _refused(reference)
            if file is not None and not (inside is not None and file.resolve().is_relative_to(inside)):
                found |= _with_materials(reference, file, reach)
    return list(found.values())


def _included(sources: list[Path], reach: AllowedFolders) -> dict[Path, str]:
    """The texts of descriptions and of the descriptions that they refer to."""
    texts, unread = dict[Path, str](), list(sources)
    while unread:
        source = unread.pop()
        try:
            texts[source] = text = read_regular(source, MOST_DESCRIBED).decode("utf-8", errors="replace")
        except OSError:
            continue
        named = [name for name in all_references(text) if name.strip().endswith((*FORMATS,))]
        files = [find_within(name, source.parent, reach)[0] for name in named]
        unread += [file for file in files if file is not None and file not in texts]
    return texts


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
