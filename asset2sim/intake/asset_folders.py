"""The assets of a dataset without a manifest: its folders and files, those that cannot be read among them."""

import hashlib
import os
import posixpath
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath

from asset2sim.assets.companions import COMPANIONS
from asset2sim.assets.folder import INDEX_NAME, LOADER_NAME
from asset2sim.intake.formats import FORMATS, PREFERRED
from asset2sim.intake.locate import FURTHER, TELLING, URDF_FOLDER, descriptions, stem
from asset2sim.storage.regular_files import path_problem, printable
from asset2sim.storage.tree import Tree
from schemas.asset import AssetRef
from schemas.errors import Mistakes, UsageError

MANIFEST = "manifest.csv"
RESERVED = {
    "null": "means none in --assets; choose another",
    **dict.fromkeys((INDEX_NAME, LOADER_NAME), "is a file beside the refined folders; choose another"),
}
"""Texts that cannot be an asset's id, whatever their case, and why, in words that follow them."""
MAX_ID_LENGTH = 200
"""Bytes of an asset's id: it names a folder, and file systems stop at 255 bytes."""


def find_assets(tree: Tree) -> list[AssetRef]:
    """The asset folders at, one below or two below a folder, by name; a folder two below has its parent as category.
    In a folder with several files that describe assets each of them is one, called after it, and below the dataset's
    own folder after both.

    A folder that cannot be listed, a link that leads nowhere, and a folder whose name cannot be an id are assets with a
    ``fault``, and one that has lost its URDF is an asset: what was there yesterday must not vanish. Raises UsageError
    where there is no asset, nor anything else than faults.
    """
    refs = with_distinct_ids(_assets_in(tree, "") or _assets_below(tree, ""), tree)
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
    if asset_id.casefold() in RESERVED:
        return RESERVED[asset_id.casefold()]
    if len(asset_id.encode()) > MAX_ID_LENGTH:
        return f"has over {MAX_ID_LENGTH} bytes; it names a folder"
    return None


def refuse_twice(asset_ids: Iterable[str], where: str) -> None:
    """Raise UsageError for ids that are there more than once, be it in another case."""
    first, mistakes = dict[str, str](), Mistakes()
    for asset_id in asset_ids:
        with mistakes:
            if (key := asset_id.casefold()) in first:
                raise UsageError(f"{where}: {same_folder(first[key], asset_id)}")
            first[key] = asset_id
    mistakes.end()


def same_folder(asset_id: str, other: str) -> str:
    """Why two ids that differ in case at most cannot be in one dataset."""
    if asset_id == other:
        return f"asset_id {asset_id} more than once; each names one folder of the output"
    return f"asset_id {asset_id} and {other} name the same folder where a file system ignores case; rename one"


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
            if found := _assets_in(tree, place, parent or None):
                refs += found
            elif inner := _assets_below(tree, place) if not parent else []:
                refs += inner
            elif any(name in COMPANIONS for name in tree.files(place)):
                refs.append(_found(tree, place, parent or None))
        except OSError as error:
            refs.append(_found(tree, place, parent or None, path_problem(Path(tree.at(place)), error)))
    return refs


def _found(tree: Tree, place: str, category: str | None = None, fault: str | None = None, name: str = "") -> AssetRef:
    """The asset of a folder or, where it has a ``name``, of a file."""
    path = str(tree.at(place))
    kind = "file" if name else "folder"
    name = name or posixpath.basename(path)
    problem = id_problem(name)
    if problem is not None:
        name, fault = safe_id(name), f"its {kind}'s name {problem}; rename the {kind}"
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
    safe = f"%20{safe.strip()}" if safe != safe.strip() or safe.casefold() in RESERVED else safe
    return safe if len(safe.encode()) <= MAX_ID_LENGTH else shortened_id(safe, name)


def shortened_id(asset_id: str, of: str) -> str:
    """An id, cut where it is too long, with a digest of another text, which tells it from others that begin alike."""
    digest = hashlib.sha256(os.fsencode(of)).hexdigest()[:8]
    return f"{asset_id.encode()[: MAX_ID_LENGTH - 10].decode(errors='ignore')}~{digest}"


def with_distinct_ids(refs: Sequence[AssetRef], tree: Tree) -> list[AssetRef]:
    """The assets, those of files whose ids differ from another's in case at most with a digest of their path in it."""
    known = Counter(ref.asset_id.casefold() for ref in refs)

    def renamed(ref: AssetRef) -> AssetRef:
        within = ref.path.removeprefix(str(tree.place))
        return ref.model_copy(update={"asset_id": shortened_id(ref.asset_id, within)})

    alike = [known[ref.asset_id.casefold()] > 1 and PurePosixPath(ref.path).suffix in FORMATS for ref in refs]
    return [renamed(ref) if is_alike else ref for ref, is_alike in zip(refs, alike, strict=True)]


def file_asset(tree: Tree, name: str) -> AssetRef:
    """The asset of one file at the top of a tree; one with a name that is the same for all is called as its folder."""
    folder = str(tree.place).rpartition("/")
    own = folder[0].rpartition("/") if folder[2] == URDF_FOLDER else folder
    return _found(tree, name, name=own[2] if name in PREFERRED else stem(name))


def _assets_in(tree: Tree, folder: str, category: str | None = None) -> list[AssetRef]:
    """The assets that are described in a folder, or in its ``urdf`` folder, as ROS packages have it: the folder itself,
    or where there are several files each of them; also a folder, pipe or link that is named as one. Raises OSError
    where it cannot be listed."""
    names = [*tree.files(folder), *(f"{URDF_FOLDER}/{name}" for name in tree.files(_in(folder, URDF_FOLDER)))]
    try:
        above = posixpath.basename(folder or str(tree.place).rstrip("/"))
        found = descriptions(above, names, lambda name, most: tree.read(_in(folder, name), most))
    except OSError:
        # Which file it is decides reading it, where an error is the asset's own.
        found = [name for name in names if name in PREFERRED]
    category = None if "meta.json" in names else category
    if len(found) > 1:
        above = f"{posixpath.basename(folder)}_" if folder else ""
        return [_found(tree, _in(folder, name), category, name=f"{above}{stem(name)}") for name in found]
    named = [name for name in names if name.lower().endswith(TELLING)]
    is_one = found or named or (folder and not {*tree.folders(folder)}.isdisjoint(PREFERRED))
    return [_found(tree, folder, category)] if is_one else []


def _in(folder: str, name: str) -> str:
    return f"{folder}/{name}" if folder else name
