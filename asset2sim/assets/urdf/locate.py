"""Finding the file that describes an asset and the meshes that it refers to, and reading PartNet-Mobility's files."""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path, PurePath, PurePosixPath

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
    Raises AssetError (unreadable_asset) if there is none or more than one.
    """
    if not folder.is_dir():
        message = f"{folder}: no such asset folder; mend the manifest's path"
        raise AssetError(FailureMode.UNREADABLE_ASSET, "missing_folder", message)
    if is_regular(folder / PREFERRED[0]):
        return folder / PREFERRED[0]
    patterns = [f"{below}*{suffix}" for suffix in SUFFIXES for below in ("", "*/")]
    paths = (path for pattern in patterns for path in folder.glob(pattern) if is_regular(path))
    names = [path.relative_to(folder).as_posix() for path in paths]
    found = [folder / name for name in candidates(names)]
    inside = [file for file in found if within(file)]
    if found and not inside:
        return found[0]
    found = inside
    if found and found[0].suffix == ".xml":
        found = [file for file in found if is_mjcf(file.read_bytes())]
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
    else:
        kind, name = KINDS[found[0].suffix]
        problem = f"{len(found)} {kind} files ({listed}); keep one" + (f" or name it {name}" if name else "")
    raise AssetError(FailureMode.UNREADABLE_ASSET, "no_single_urdf", f"{folder}: {problem}")


def is_mjcf(content: bytes) -> bool:
    """Whether an XML file's content begins as MuJoCo's format does."""
    return b"<mujoco" in content[:65_536]


def _included(file: Path) -> set[str]:
    """Names of the files that a xacro or MJCF file includes."""
    return {re.split(r"[/\\]", path)[-1] for path in _INCLUDED.findall(file.read_text("utf-8", errors="replace"))}


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
        text = "" if file is None else file.read_text(encoding="utf-8", errors="replace")
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
        meta = None if file is None else json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return ""
    category = meta.get("model_cat") if isinstance(meta, dict) else None
    return category if isinstance(category, str) else ""
