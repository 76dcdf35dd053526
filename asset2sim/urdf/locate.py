"""Finding an asset's URDF file, and the mesh files that it refers to."""

from pathlib import Path, PurePosixPath

from schemas.errors import AssetError
from schemas.vocabulary import FailureMode

PARENTS_SEARCHED = 2
"""How far above the URDF a package's folder may lie: packages keep ``urdf/`` and ``meshes/`` side by side."""


def find_urdf(folder: Path) -> Path:
    """The asset folder's one URDF: ``mobility.urdf`` if there is one, else its only ``*.urdf``.

    Raises AssetError (unreadable_asset) if there is none or more than one.
    """
    preferred = folder / "mobility.urdf"
    if preferred.is_file():
        return preferred
    if not folder.is_dir():
        raise AssetError(
            FailureMode.UNREADABLE_ASSET, "missing_folder", f"{folder}: no such asset folder; mend the manifest's path"
        )
    found = sorted(folder.glob("*.urdf")) or sorted(folder.glob("*/*.urdf"))
    if len(found) == 1:
        return found[0]
    listed = ", ".join(str(path.relative_to(folder)) for path in found[:5])
    problem = f"{len(found)} URDF files ({listed}); keep one or name it mobility.urdf" if found else "no URDF file"
    raise AssetError(FailureMode.UNREADABLE_ASSET, "no_single_urdf", f"{folder}: {problem}")


def find_mesh(reference: str, folder: Path) -> Path | None:
    """The file that a mesh reference means, or None.

    ``package://name/path``, ``model://name/path`` and ``file://`` references, and relative paths, are resolved next
    to the
    URDF's folder: each suffix of the path is tried there and up to two folders above.
    """
    text = reference.replace("\\", "/").strip()
    _, separator, rest = text.partition("://")
    text = rest if separator else text
    if not text:
        return None
    if text.startswith("/") and Path(text).is_file():
        return Path(text)
    parts = [part for part in PurePosixPath(text).parts if part != "/"]
    bases = [folder, *folder.resolve().parents[:PARENTS_SEARCHED]]
    suffixes = [parts[start:] for start in range(len(parts))] if separator or text.startswith("/") else [parts]
    for suffix in suffixes:
        for base in bases if separator else bases[:1]:
            candidate = base.joinpath(*suffix)
            if candidate.is_file():
                return candidate
    return None
