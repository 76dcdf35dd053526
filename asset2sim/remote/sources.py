"""The objects that an asset behind a URL consists of: those in its folder, and meshes elsewhere that its URDF names."""

import posixpath
from collections.abc import Callable, Mapping
from pathlib import PurePosixPath

from asset2sim.assets.urdf.locate import PARENTS_SEARCHED, mesh_candidates
from asset2sim.catalog.storage.objects import Stored

LOOKS = (".mtl", ".bmp", ".gif", ".jpeg", ".jpg", ".png", ".tga", ".tif", ".tiff")
"""Endings of what an OBJ's looks consist of: taken along from its own folder, which is where exporters put it."""

Find = Callable[[str], Stored | None]
List = Callable[[str], Mapping[str, Stored]]


def visible(objects: Mapping[str, Stored]) -> dict[str, Stored]:
    """The objects of an asset's folder that count: none whose name, or a folder of whose, is hidden."""
    return {name: stored for name, stored in objects.items() if not any(p.startswith(".") for p in name.split("/"))}


def urdf_among(names: Mapping[str, Stored]) -> str | None:
    """The URDF among an asset's objects, as ``find_urdf`` chooses; None where that would fail."""
    if "mobility.urdf" in names:
        return "mobility.urdf"
    for depth in (0, 1):
        found = [name for name in names if name.endswith(".urdf") and name.count("/") == depth]
        if found:
            return found[0] if len(found) == 1 else None
    return None


def outer_objects(
    folder: str, inner: Mapping[str, Stored], urdf: str, references: list[str], find: Find, below: List
) -> dict[str, Stored]:
    """URL → object of what the references mean outside the asset's folder, within its bucket.

    ``urdf`` is among the names in ``inner``; ``find`` looks an object up by its URL, ``below`` lists a folder's.
    """
    scheme, _, key = folder.partition("://")
    base = PurePosixPath("/", key, urdf).parent
    above = list(base.parents)[:PARENTS_SEARCHED]
    found: dict[str, Stored] = {}
    for reference in references:
        for candidate in mesh_candidates(reference, base, above):
            path = posixpath.normpath(str(candidate))
            if path.split("/")[1] != key.split("/")[0] or path.count("/") < 2:
                continue
            if path.startswith(f"/{key}/"):
                if path.removeprefix(f"/{key}/") in inner:
                    break
                continue
            url = f"{scheme}:/{path}"
            stored = find(url)
            if stored is not None:
                found[url] = stored
                found |= _looks(url, below)
                break
    return found


def _looks(mesh: str, below: List) -> dict[str, Stored]:
    if not mesh.lower().endswith(".obj"):
        return {}
    folder = mesh.rpartition("/")[0]
    return {
        f"{folder}/{name}": stored
        for name, stored in below(folder).items()
        if "/" not in name and name.lower().endswith(LOOKS)
    }
