"""The file that each of an asset's references means, within the folders from which its files may be read."""

import os
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath, PurePosixPath

from asset2sim.storage.regular_files import is_file
from schemas.asset import AssetRef
from schemas.errors import AssetError
from schemas.inputs import InputSettings
from schemas.location import Location
from schemas.vocabulary import FailureMode

_REFERENCE = re.compile(r"""(?:\bfile\w*\s*=\s*["']|<uri>\s*|@(?=[^@\n]+@))([^"'<@]+)""")
"""A file that a URDF, a format like it or a USD in text names."""
_FOLDER = re.compile(r"""\b(?:mesh|texture|asset)dir\s*=\s*["']([^"']+)""")
_FIND = re.compile(r"\$\(find\s+([^)\s]+)\s*\)")
"""A package's folder as xacro names it."""
MOST_DESCRIBED = 64 * 1024 * 1024
"""Bytes of a file that describes an asset in which references are looked for: the largest real one has 2 MB."""
PARENTS_SEARCHED = 2
"""How far above the URDF a package's folder may lie: packages keep ``urdf/`` and ``meshes/`` side by side."""
MODEL_FILE = "model.config"
"""The file that Gazebo's models have at their top."""
WEB = ("http", "https", "ftp", "s3", "gs")
OUTSIDE_REMEDY = "bring it into the dataset, name its folder by --package NAME=PATH, or allow it by --allow-outside"


@dataclass(frozen=True)
class AllowedFolders:
    """The folders (links followed) below which an asset's files may lie, and those of named packages; ``anywhere``
    stands for all folders. ``work``: a temporary folder of ours, which no message names. ``macro``: the one that is
    read of a xacro file that only defines macros."""

    roots: tuple[Path, ...] = ()
    packages: Mapping[str, Path] = field(default_factory=dict)
    anywhere: bool = False
    work: tuple[Path, ...] = ()
    macro: str = ""

    def allows(self, path: Path) -> bool:
        """Whether a path, links followed, lies below one of the folders."""
        if self.anywhere:
            return True
        try:
            real = path.resolve()
        except (OSError, RuntimeError, ValueError):  # a loop of links, a name that no file can have
            return False
        return any(real.is_relative_to(folder) for folder in (*self.roots, *self.packages.values(), *self.work))


ANYWHERE = AllowedFolders(anywhere=True)


def allowed_folders(ref: AssetRef, inputs: InputSettings) -> AllowedFolders:
    """Where the files of an asset may lie: below its dataset's folder, or its own where it comes from none, in named
    packages, and in Gazebo's models beside a dataset that is one itself."""
    root = Location(ref.root or ref.path).folder.resolve()
    root = root if ref.root or not is_file(root) else root.parent
    folders = {name: Path(place).resolve() for name, place in inputs.package_folders.items()}
    return AllowedFolders((root,), _models_beside(root) | folders, inputs.allow_outside, macro=inputs.macro)


def _models_beside(folder: Path) -> dict[str, Path]:
    """Name → folder of the other models of Gazebo in the folder that holds this one, if this is such a model."""
    if not is_file(folder / MODEL_FILE):
        return {}
    return {other.parent.name: other.parent for other in folder.parent.glob(f"*/{MODEL_FILE}")}


@dataclass(frozen=True)
class Refused:
    """A reference that is not read: as its file has it, and why, with a remedy."""

    reference: str
    problem: str


def find_within(reference: str, folder: Path, reach: AllowedFolders) -> tuple[Path | None, Path | None]:
    """The file that a reference in ``folder`` means, as ``find_mesh`` has it but within ``reach``, with a named
    package's file first; None where there is none, and then the file outside that it would be, if that is there."""
    outside, candidates = None, [*_candidates(reference, folder, reach)]
    for candidate in candidates:
        if not is_file(candidate):
            continue
        if reach.allows(candidate):
            return candidate, None
        outside = outside or candidate
    if outside is None:
        spelt = (_spelt_otherwise(candidate, reach) for candidate in candidates)
        return next((path for path in spelt if path is not None and is_file(path)), None), None
    return None, outside


def _candidates(reference: str, folder: Path, reach: AllowedFolders) -> Iterator[Path]:
    text = path_in(reference)
    parts = [part for part in PurePosixPath(text).parts if part != "/"]
    if is_loose(reference) and parts and parts[0] in reach.packages:
        yield reach.packages[parts[0]].joinpath(*parts[1:])
    if text.startswith("/"):
        yield Path(text)
    # Resolving asks the system for every folder on the way; only loose references are looked for above.
    above = folder.resolve().parents[:PARENTS_SEARCHED] if is_loose(reference) else ()
    yield from map(Path, mesh_candidates(reference, folder, above))


def lies_outside(path: Path, reach: AllowedFolders) -> str:
    """Why a file is not read that lies elsewhere, with the remedies."""
    real = path.resolve()
    through = f", a link to {real}," if path.is_symlink() else ""
    roots = ", ".join(map(str, reach.roots))
    return f"is {path}{through} and lies outside the dataset {roots}: {OUTSIDE_REMEDY}"


def check_within(path: Path, reach: AllowedFolders) -> Path:
    """The path. Raises AssetError (unreadable_asset) where it lies outside the dataset."""
    if reach.allows(path):
        return path
    message = f"'{path.name}' {lies_outside(path, reach)}"
    raise AssetError(FailureMode.UNREADABLE_ASSET, "outside_dataset", message)


def why_missing(reference: str, folder: Path, reach: AllowedFolders) -> str:
    """Why a reference that ``find_within`` does not find means no file, in words, with what to do about it."""
    text, (scheme, separator, _) = path_in(reference), reference.strip().partition("://")
    if separator and scheme.lower() in WEB:
        return "is a web address, and none is fetched: download the file and name it by its path beside the URDF"
    if not text.strip("/. "):
        return "names no file: state its path, relative to the URDF"
    for candidate in _candidates(reference, folder, reach):
        if (problem := _problem_of(candidate)) is not None:
            return problem
    if not is_loose(reference) and not reach.allows(plain := folder / text):
        return f"means {plain}, which lies outside the dataset: {OUTSIDE_REMEDY}"
    package = text.split("/")[0]
    if is_loose(reference) and separator and scheme.lower() in ("package", "model") and package not in reach.packages:
        return f"is not there: restore the file, or say where its package lies by --package {package}=PATH"
    return "is not there: restore the file"


def _problem_of(path: Path) -> str | None:
    """The reason why one candidate is not a file that can be read; None where there is nothing of its name."""
    try:
        mode = os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        if path.is_symlink():
            return f"is a link to {os.readlink(path)}, which is not there: restore that file, or replace the link by it"
        return None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        return f"cannot be opened ({reason}): rename it, or give the user that runs this the right to read it"
    if stat.S_ISDIR(mode):
        return "is a folder: name a file in it"
    if not stat.S_ISREG(mode):
        return "is a pipe, a socket or a device: replace it by a file"
    return None


def _spelt_otherwise(path: Path, reach: AllowedFolders) -> Path | None:
    """The file within reach where a path would, if letters were small and large alike, as on other systems; None where
    nothing does, or several things."""
    try:
        if path.exists() or path.parent == path:
            return path if reach.allows(path) else None
        folder = _spelt_otherwise(path.parent, reach)
        names = [] if folder is None else os.listdir(folder)
    except OSError:
        return None
    alike = [name for name in names if name.casefold() == path.name.casefold()]
    return None if folder is None or len(alike) != 1 or not reach.allows(folder / alike[0]) else folder / alike[0]


def find_mesh(reference: str, folder: Path) -> Path | None:
    """The file of a mesh reference, or None. ``package://``, ``model://`` and ``file://`` references and relative paths
    are sought beside the URDF: each suffix there and up to two folders above."""
    return next((candidate for candidate in _candidates(reference, folder, ANYWHERE) if is_file(candidate)), None)


def mesh_candidates(reference: str, folder: PurePath, above: Sequence[PurePath]) -> Iterator[PurePath]:
    """Candidate paths of a mesh reference, the likeliest first, in the URDF's ``folder`` and in those ``above`` it."""
    text = path_in(reference)
    parts = [part for part in PurePosixPath(text).parts if part != "/"]
    if not parts:
        return
    loose = is_loose(reference)
    for start in range(len(parts)) if loose or text.startswith("/") else (0,):
        for base in (folder, *above) if loose else (folder,):
            yield base.joinpath(*parts[start:])
    # Programs that name a folder in which engines search have paths from there: "door/leaf.obj" of "door/door.urdf".
    for count in range(1, len(parts)):
        if tuple(parts[:count]) == folder.parts[-count:]:
            yield folder.joinpath(*parts[count:])


def is_loose(reference: str) -> bool:
    """Whether a reference names no file by itself, but a package or a scheme."""
    return "://" in reference.replace("\\", "/") or _FIND.search(reference) is not None


def path_in(reference: str) -> str:
    """The path that a reference states, without its scheme, with forward slashes."""
    text = _FIND.sub(r"package://\1", reference.replace("\\", "/").strip())
    _, separator, rest = text.rpartition("://")
    return rest if separator else text


def all_references(text: str) -> list[str]:
    """The references in a description's text, sorted."""
    return sorted(set(_REFERENCE.findall(text)))


def mesh_folders(text: str) -> list[str]:
    """The folders that an MJCF file states for its meshes and textures, sorted."""
    return sorted(set(_FOLDER.findall(text)))


def outer_references(text: str) -> list[str]:
    """Those references that may mean a file outside the description's folder, sorted."""
    return [reference for reference in all_references(text) if not _stays_inside(reference)]


def _stays_inside(reference: str) -> bool:
    path = PurePosixPath(reference.replace("\\", "/").strip())
    return not is_loose(reference) and not path.is_absolute() and ".." not in path.parts
