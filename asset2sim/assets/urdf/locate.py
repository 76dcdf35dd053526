"""Finding an asset's URDF and the mesh files that it refers to, and reading PartNet-Mobility's files beside it."""

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePath, PurePosixPath

from schemas.errors import AssetError
from schemas.vocabulary import FailureMode

_REFERENCE = re.compile(r"""filename\s*=\s*["']([^"']+)["']""")
PARENTS_SEARCHED = 2
"""How far above the URDF a package's folder may lie: packages keep ``urdf/`` and ``meshes/`` side by side."""


def find_urdf(folder: Path) -> Path:
    """The asset folder's one URDF: ``mobility.urdf`` if there is one, else its only ``*.urdf``. Raises AssetError
    (unreadable_asset) if there is none or more than one."""
    preferred = folder / "mobility.urdf"
    if preferred.is_file():
        return preferred
    if not folder.is_dir():
        message = f"{folder}: no such asset folder; mend the manifest's path"
        raise AssetError(FailureMode.UNREADABLE_ASSET, "missing_folder", message)
    found = sorted(folder.glob("*.urdf")) or sorted(folder.glob("*/*.urdf"))
    if len(found) == 1:
        return found[0]
    listed = ", ".join(str(path.relative_to(folder)) for path in found[:5])
    problem = f"{len(found)} URDF files ({listed}); keep one or name it mobility.urdf" if found else "no URDF file"
    raise AssetError(FailureMode.UNREADABLE_ASSET, "no_single_urdf", f"{folder}: {problem}")


def find_mesh(reference: str, folder: Path) -> Path | None:
    """The file of a mesh reference, or None. ``package://name/path``, ``model://name/path`` and ``file://`` references,
    and relative paths, are resolved next to the URDF's folder: each suffix of the path is tried there and up to two
    folders above."""
    text = _path_in(reference)
    if text.startswith("/") and Path(text).is_file():
        return Path(text)
    # Resolving asks the system for every folder on the way; only loose references are looked for above.
    above = folder.resolve().parents[:PARENTS_SEARCHED] if is_loose(reference) else ()
    candidates = map(Path, mesh_candidates(reference, folder, above))
    return next((candidate for candidate in candidates if candidate.is_file()), None)


def mesh_candidates(reference: str, folder: PurePath, above: Sequence[PurePath]) -> Iterator[PurePath]:
    """Candidate paths of a mesh reference, the likeliest first, in the URDF's ``folder`` and in those ``above`` it."""
    text = _path_in(reference)
    parts = [part for part in PurePosixPath(text).parts if part != "/"]
    if not parts:
        return
    loose = is_loose(reference)
    for start in range(len(parts)) if loose or text.startswith("/") else (0,):
        for base in (folder, *above) if loose else (folder,):
            yield base.joinpath(*parts[start:])


def is_loose(reference: str) -> bool:
    """Whether a reference names no file by itself, but a package or a scheme."""
    return "://" in reference.replace("\\", "/")


def _path_in(reference: str) -> str:
    text = reference.replace("\\", "/").strip()
    _, separator, rest = text.partition("://")
    return rest if separator else text


def outer_references(urdf: str) -> list[str]:
    """The references in a URDF's text that may mean a file outside its folder, sorted."""
    return sorted(reference for reference in set(_REFERENCE.findall(urdf)) if not _stays_inside(reference))


def _stays_inside(reference: str) -> bool:
    path = PurePosixPath(reference.replace("\\", "/").strip())
    return "://" not in reference and not path.is_absolute() and ".." not in path.parts


def read_semantics(folder: Path) -> dict[str, tuple[str, str]]:
    """Link name → (joint kind, label) from ``semantics.txt``, where there is one; lines that do not fit are skipped."""
    file = folder / "semantics.txt"
    if not file.is_file():
        return {}
    labels: dict[str, tuple[str, str]] = {}
    for line in file.read_text(encoding="utf-8", errors="replace").splitlines():
        words = line.split(maxsplit=2)
        if len(words) >= 2:
            labels[words[0]] = (words[1], words[2].strip() if len(words) > 2 else "")
    return labels


def read_category(folder: Path) -> str:
    """The category that ``meta.json`` states as ``model_cat``, or an empty string."""
    file = folder / "meta.json"
    try:
        meta = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ""
    category = meta.get("model_cat") if isinstance(meta, dict) else None
    return category if isinstance(category, str) else ""
