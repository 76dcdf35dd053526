"""Finding the file that describes an asset and the meshes that it refers to, and reading PartNet-Mobility's files."""

import json
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path, PurePath, PurePosixPath

from asset2sim.assets.regular_files import NOT_THERE, file_problem, folder_problem, path_problem, read_regular
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode

SUFFIXES = (".urdf", ".xacro", ".sdf", ".xml")
"""Endings of files that describe an asset, the preferred first; ``.xml`` is MJCF."""
PREFERRED = ("mobility.urdf", "model.sdf", "model.xml")
"""Names that are taken where a folder has several files of their format: PartNet-Mobility's, Gazebo's, and ours."""
KINDS = {".urdf": ("URDF", PREFERRED[0]), ".xacro": ("xacro", ""), ".sdf": ("SDF", PREFERRED[1]),
         ".xml": ("MJCF", PREFERRED[2])}  # fmt: skip
"""Suffix → what the format is called, and the name that chooses a file of it."""
NOT_MODELS = ("package.xml", "manifest.xml", "stack.xml")
"""Files of ROS packages that are no MJCF."""

_REFERENCE = re.compile(r"""(?:\bfile(?:name)?\s*=\s*["']|<uri>\s*)([^"'<]+)""")
_INCLUDED = re.compile(r"""<(?:xacro:)?include\s[^>]*?file(?:name)?\s*=\s*["']([^"']+)""")
_FIND = re.compile(r"\$\(find\s+([^)\s]+)\s*\)")
"""A package's folder as xacro names it."""
MJCF_HEAD = 65_536
"""Bytes at the beginning of an MJCF file that tell its format."""
MOST_DESCRIBED = 64 * 1024 * 1024
"""Bytes of a file that describes an asset in which references are looked for: the largest real one has 2 MB."""
PARENTS_SEARCHED = 2
"""How far above the URDF a package's folder may lie: packages keep ``urdf/`` and ``meshes/`` side by side."""


def candidates(names: Iterable[str]) -> list[str]:
    """Of the names of files below an asset's folder, those that may describe it: of the first suffix that there is, at
    the top, else one folder down. A preferred name stands alone."""
    known = [name for name in names if PurePosixPath(name).name not in NOT_MODELS]
    for suffix in SUFFIXES:
        for depth in (0, 1):
            found = sorted(name for name in known if name.endswith(suffix) and name.count("/") == depth)
            if found:
                return [name for name in found if name in PREFERRED][:1] or found
    return []


def find_source(folder: Path, within: Callable[[Path], bool] = lambda path: True) -> Path:
    """The file that describes an asset: ``mobility.urdf`` or its only URDF, else its xacro, SDF or MJCF file.

    Of several xacro files it is the ``.urdf.xacro``, or the one that no other includes; of several MJCF files the one
    that includes none, since a scene includes its model. Files that are not ``within`` are not looked into; one of
    them is returned where there is no other.
    Raises AssetError (unreadable_asset) if there is none or more than one, or if it is no regular file.
    """
    problem = folder_problem(folder)
    if problem == NOT_THERE:
        raise _unfit(folder, "missing_folder", "no such asset folder; mend the manifest's path")
    if problem is not None:
        raise _unfit(folder, "unreadable_folder", f"the asset's folder {problem}; mend it, or take it out")
    try:
        names = _names_in(folder)
        problems = {name: file_problem(folder / name) for name in names}
        found = candidates(name for name in names if problems[name] is None)
        if not found and (unusable := candidates(names)):
            raise _unfit(folder, "not_a_file", f"{unusable[0]} {problems[unusable[0]]}; put the file itself there")
        inside = [folder / name for name in found if within(folder / name)]
        return folder / found[0] if found and not inside else _single(folder, inside, names)
    except OSError as error:
        raise _unfit(folder, "unreadable_file", f"{error.filename} {path_problem(folder, error)}; mend it") from error


def _single(folder: Path, found: list[Path], names: Iterable[str]) -> Path:
    """The one file of those that may describe an asset. Raises AssetError and OSError."""
    if found and found[0].suffix == ".xml":
        found = [file for file in found if is_mjcf(read_regular(file, MJCF_HEAD))]
    if len(found) > 1 and found[0].suffix in (".xacro", ".xml"):
        included = {file: _included(file) for file in found}
        every = set().union(*included.values())
        xacro = found[0].suffix == ".xacro"
        found = [file for file in found if (file.name not in every if xacro else not included[file])] or found
        found = [file for file in found if file.name.endswith(".urdf.xacro")] or found
    if len(found) == 1:
        return found[0]
    listed = ", ".join(str(path.relative_to(folder)) for path in found[:5])
    if not found:
        problem = "no URDF file, nor a xacro, SDF or MJCF file"
        capitals = [name for name in names if not name.endswith(SUFFIXES) and name.lower().endswith(SUFFIXES[:-1])]
        problem += f"; write the ending of {capitals[0]} in small letters" if capitals else ""
    else:
        kind, name = KINDS[found[0].suffix]
        problem = f"{len(found)} {kind} files ({listed}); keep one" + (f" or name it {name}" if name else "")
    raise _unfit(folder, "no_single_urdf", problem)


def _unfit(folder: Path, code: str, problem: str) -> AssetError:
    return AssetError(FailureMode.UNREADABLE_ASSET, code, f"{folder}: {problem}")


def _names_in(folder: Path) -> list[str]:
    """Names of the files in a folder that may describe an asset by their ending, and in the folders one below it."""
    found: list[str] = []
    folders = [""]
    for below in folders:
        try:
            with os.scandir(folder / below) as entries:
                for entry in entries:
                    name = f"{below}/{entry.name}" if below else entry.name
                    if entry.name.lower().endswith(SUFFIXES):
                        found.append(name)
                    if not below and os.path.isdir(entry.path):
                        folders.append(name)
        except OSError:
            if not below:
                raise
    return sorted(found)


def is_mjcf(content: bytes) -> bool:
    """Whether an XML file's content begins as MuJoCo's format does."""
    return b"<mujoco" in content[:MJCF_HEAD]


def _included(file: Path) -> set[str]:
    """Names of the files that a xacro or MJCF file includes."""
    text = read_regular(file, MOST_DESCRIBED).decode("utf-8", errors="replace")
    return {re.split(r"[/\\]", path)[-1] for path in _INCLUDED.findall(text)}


def find_mesh(reference: str, folder: Path) -> Path | None:
    """The file of a mesh reference, or None. ``package://name/path``, ``model://name/path`` and ``file://`` references,
    and relative paths, are resolved next to the URDF's folder: each suffix of the path is tried there and up to two
    folders above."""
    text = path_in(reference)
    if text.startswith("/") and is_regular(Path(text)):
        return Path(text)
    # Resolving asks the system for every folder on the way; only loose references are looked for above.
    above = folder.resolve().parents[:PARENTS_SEARCHED] if is_loose(reference) else ()
    candidates = map(Path, mesh_candidates(reference, folder, above))
    return next((candidate for candidate in candidates if is_regular(candidate)), None)


def is_regular(path: Path) -> bool:
    """Whether there is a file at a path; False for what cannot be asked, such as a name that is too long."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


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


def is_loose(reference: str) -> bool:
    """Whether a reference names no file by itself, but a package or a scheme."""
    return "://" in reference.replace("\\", "/") or _FIND.search(reference) is not None


def path_in(reference: str) -> str:
    """The path that a reference states, without its scheme, with forward slashes."""
    text = _FIND.sub(r"package://\1", reference.replace("\\", "/").strip())
    _, separator, rest = text.rpartition("://")
    return rest if separator else text


def outer_references(urdf: str) -> list[str]:
    """The references in a URDF's text that may mean a file outside its folder, sorted."""
    return sorted(reference for reference in set(_REFERENCE.findall(urdf)) if not _stays_inside(reference))


def _stays_inside(reference: str) -> bool:
    path = PurePosixPath(reference.replace("\\", "/").strip())
    return not is_loose(reference) and not path.is_absolute() and ".." not in path.parts


def read_semantics(file: Path | None) -> dict[str, tuple[str, str]]:
    """Link name → (joint kind, label) from ``semantics.txt``, where there is one that can be read; lines that do not
    fit are skipped."""
    labels: dict[str, tuple[str, str]] = {}
    try:
        text = "" if file is None else read_regular(file, MOST_DESCRIBED).decode("utf-8", errors="replace")
    except OSError:
        return labels
    for line in text.splitlines():
        words = line.split(maxsplit=2)
        if len(words) >= 2:
            labels[words[0]] = (words[1], words[2].strip() if len(words) > 2 else "")
    return labels


def read_category(file: Path | None) -> str:
    """The category that ``meta.json`` states as ``model_cat``, or an empty string."""
    try:
        meta = None if file is None else json.loads(read_regular(file, MOST_DESCRIBED).decode("utf-8"))
    except (OSError, ValueError, RecursionError):
        return ""
    category = meta.get("model_cat") if isinstance(meta, dict) else None
    return category if isinstance(category, str) else ""
