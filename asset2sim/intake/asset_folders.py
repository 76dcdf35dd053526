"""The assets of a dataset without a manifest: its folders, those that cannot be read among them."""

import hashlib
import os
import posixpath
from collections import Counter
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from asset2sim.assets.companions import COMPANIONS
from asset2sim.intake.formats import FORMATS, NOT_MODELS, PREFERRED
from asset2sim.intake.formats.format import HEAD_BYTES
from asset2sim.intake.locate import FURTHER, TELLING
from asset2sim.storage.regular_files import path_problem, printable
from asset2sim.storage.tree import Tree
from schemas.asset import AssetRef
from schemas.errors import UsageError

MANIFEST = "manifest.csv"
MAX_ID_LENGTH = 200
"""Bytes of an asset's id: it names a folder, and file systems stop at 255 bytes."""


def find_assets(tree: Tree) -> list[AssetRef]:
    """The asset folders at, one below or two below a folder, by name; a folder two below has its parent as category.

    A folder that cannot be listed, a link that leads nowhere, and a folder whose name cannot be an id are assets with a
    ``fault``, and one that has lost its URDF is an asset: what was there yesterday must not vanish. Raises UsageError
    where there is no asset, nor anything else than faults.
    """
    if _holds_asset(tree, ""):
        return [_found(tree, "")]
    refs = _assets_below(tree, "")
    if all(ref.fault is not None for ref in refs):
        first = f"; of what is there nothing can be read, as {refs[0].fault}" if refs else ""
        raise UsageError(
            f"{tree.place}: neither {MANIFEST}, nor a URDF, {FURTHER} here or in a folder one or two levels down; "
            f"name a dataset folder or one asset folder{first}"
        )
    refuse_twice((ref.asset_id for ref in refs), str(tree.place))
    return refs


def check_asset_id(asset_id: str, where: str) -> str:
    """The id, if it can name a folder of the output and be named in ``--assets``; else ``UsageError``."""
    problem = id_problem(asset_id)
    if problem is not None:
        shown = f"{asset_id[:20]}…" if len(asset_id) > MAX_ID_LENGTH else asset_id
        raise UsageError(f"{where}: asset_id {shown!r} {problem}")
    return asset_id


def id_problem(asset_id: str) -> str | None:
    """Why a text cannot be an asset's id, in words that follow it, or None."""
    unsafe = [character for character in asset_id if not _is_safe(character)]
    if unsafe:
        why = "which separates the ids of --assets" if unsafe[0] == "," else "and names a folder of the output"
        return f"holds {unsafe[0]!r}, {why}; use letters, digits, '.', '_', '-' and spaces"
    if not asset_id or asset_id != asset_id.strip() or asset_id.startswith("."):
        return "names a folder of the output; it may not be empty or start with '.' or a space, or end with one"
    if asset_id == "null":
        return "means none in --assets; choose another"
    if len(asset_id.encode()) > MAX_ID_LENGTH:
        return f"has over {MAX_ID_LENGTH} bytes; it names a folder"
    return None


def refuse_twice(asset_ids: Iterable[str], where: str) -> None:
    """Raise UsageError for ids that are there more than once."""
    twice = [asset_id for asset_id, count in Counter(asset_ids).items() if count > 1]
    if twice:
        listed = ", ".join(twice[:10])
        raise UsageError(f"{where}: asset_id {listed} more than once; each names one folder of the output")


def _is_safe(character: str) -> bool:
    return character not in ',/\\:*?"<>|' and character.isprintable()


def _assets_below(tree: Tree, parent: str) -> list[AssetRef]:
    """The assets in the folders and behind the links of a folder. Raises OSError where it cannot be listed."""
    broken = tree.broken(parent)
    refs: list[AssetRef] = []
    for name in sorted({*tree.folders(parent), *broken}):
        place = f"{parent}/{name}" if parent else name
        if name in broken:
            refs.append(_found(tree, place, parent or None, broken[name]))
            continue
        try:
            if _holds_asset(tree, place):
                category = None if "meta.json" in tree.files(place) else parent or None
                refs.append(_found(tree, place, category))
            elif inner := _assets_below(tree, place) if not parent else []:
                refs += inner
            elif any(name in COMPANIONS for name in tree.files(place)):
                refs.append(_found(tree, place, parent or None))
        except OSError as error:
            refs.append(_found(tree, place, parent or None, path_problem(Path(tree.at(place)), error)))
    return refs


def _found(tree: Tree, folder: str, category: str | None = None, fault: str | None = None) -> AssetRef:
    path = str(tree.at(folder))
    name = posixpath.basename(path)
    problem = id_problem(name)
    if problem is not None:
        name, fault = safe_id(name), f"its folder's name {problem}; rename the folder"
    elif fault is not None:
        fault = f"it {fault}; mend it, or take it out of the dataset"
    # Tables hold text: a path with bytes that are none is written with escapes, and its asset has a fault.
    shown = printable(path)
    said = None if fault is None else f"{shown}: {fault}"
    return AssetRef(asset_id=name, path=shown if fault else path, category=category, fault=said)


def safe_id(name: str) -> str:
    """An id for a folder whose name cannot be one: percent signs and hexadecimal digits in the place of what cannot
    stand in it, cut to its length."""
    safe = "".join(c if _is_safe(c) else "".join(f"%{byte:02X}" for byte in os.fsencode(c)) for c in name)
    safe = f"%20{safe.strip()}" if safe != safe.strip() or safe == "null" else safe
    if len(safe.encode()) <= MAX_ID_LENGTH:
        return safe
    digest = hashlib.sha256(os.fsencode(name)).hexdigest()[:8]
    return f"{safe.encode()[: MAX_ID_LENGTH - 10].decode(errors='ignore')}~{digest}"


def _holds_asset(tree: Tree, folder: str) -> bool:
    """Whether the folder is an asset's: a file that describes it lies in it, or in its ``urdf`` folder, as ROS packages
    have it; or a folder, pipe or link that is named as one. Raises OSError where it cannot be listed."""
    inner = f"{folder}/urdf" if folder else "urdf"
    for place in (folder, inner):
        names = tree.files(place)
        if any(name.lower().endswith(TELLING) for name in names):
            return True
        for name in names:
            form = FORMATS.get(PurePosixPath(name).suffix)
            if form is None or form.recognises is None or name in NOT_MODELS:
                continue
            try:
                if form.recognises(tree.read(f"{place}/{name}" if place else name, HEAD_BYTES)):
                    return True
            except OSError:
                if name in PREFERRED:
                    return True
    return bool(folder) and not {*tree.folders(folder)}.isdisjoint(PREFERRED)
