"""A dataset is a list of asset references: from a manifest, a folder of asset folders, or one asset folder."""

import csv
import io
import posixpath
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from asset2sim.assets.urdf.locate import NOT_MODELS, SUFFIXES, is_mjcf
from asset2sim.catalog.storage.tree import Tree, local_tree, remote_tree
from schemas.asset import AssetRef
from schemas.errors import UnknownChoiceError, UsageError
from schemas.location import is_url, nearest_existing
from schemas.support import SupportKind
from schemas.vocabulary import UpAxis

MANIFEST = "manifest.csv"
REQUIRED_COLUMNS = ("asset_id", "path")
COLUMNS = ("asset_id", "category", "path", "subset", "prompt", "support", "up")
MAX_ID_LENGTH = 200
"""Characters of an asset's id: it names a folder, and file systems stop at 255 bytes."""


def load_dataset(
    data: Path | str, subset: str | None = None, asset_ids: Sequence[str] = (), limit: int | None = None
) -> list[AssetRef]:
    """The chosen assets of a dataset, at most ``limit``, in the manifest's order, else by name.

    ``data`` holds a ``manifest.csv``, or asset folders (one or two levels down), or is one asset folder; it is a folder
    or a URL (``schemas.location``). Paths come out absolute. A manifest row whose folder is missing stays: it fails as
    an asset, not as a run. Raises ``UsageError``, naming the valid choices, for a dataset that cannot be read and for a
    subset or an asset that it does not have.
    """
    tree = remote_tree(data) if is_url(data) else _local(Path(data))
    refs = read_manifest(tree) if MANIFEST in tree.files("") else find_assets(tree)
    if subset is not None:
        known = {ref.subset for ref in refs if ref.subset is not None}
        refs = [ref for ref in refs if ref.subset == subset]
        if not refs:
            raise UnknownChoiceError("subset", subset, known)
    refs = [ref.model_copy(update={"root": str(tree.place)}) for ref in refs]
    known = {ref.asset_id for ref in refs}
    for asset_id in asset_ids:
        if asset_id not in known:
            raise UnknownChoiceError("asset", asset_id, known)
    if asset_ids:
        refs = [ref for ref in refs if ref.asset_id in asset_ids]
    if limit is not None and limit < 1:
        raise UsageError(f"--limit {limit}: choose a number from 1 to {len(refs)}")
    return refs[:limit]


def read_manifest(tree: Tree) -> list[AssetRef]:
    """The rows of a dataset's manifest, paths relative to its folder. Raises ``UsageError`` that names the line."""
    manifest = tree.at(MANIFEST)
    try:
        reader = csv.DictReader(io.StringIO(tree.read(MANIFEST).decode("utf-8-sig"), newline=""), skipinitialspace=True)
        columns = [name.strip() for name in reader.fieldnames or ()]
        missing = [name for name in REQUIRED_COLUMNS if name not in columns]
        if missing:
            raise UsageError(
                f"{manifest}: column {_listed(missing)} missing; it has {_listed(columns)}, "
                f"and columns may be {_listed(COLUMNS)}"
            )
        reader.fieldnames = columns
        refs = [_row(tree, f"{manifest}, line {reader.line_num}", row) for row in reader]
    except (UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"{manifest}: not a comma-separated table in UTF-8 ({error})") from error
    except OSError as error:
        raise UsageError(f"{manifest}: {error.strerror}") from error
    if not refs:
        raise UsageError(f"{manifest}: no rows under the heading; add a row per asset")
    _refuse_twice((ref.asset_id for ref in refs), str(manifest))
    return refs


def find_assets(tree: Tree) -> list[AssetRef]:
    """The asset folders at, one below or two below a folder, by name; a folder two below has its parent as category."""
    if _holds_asset(tree, ""):
        return [_found(tree, "")]
    refs: list[AssetRef] = []
    for folder in tree.folders(""):
        if _holds_asset(tree, folder):
            refs.append(_found(tree, folder))
            continue
        for inner in tree.folders(folder):
            name = f"{folder}/{inner}"
            if _holds_asset(tree, name):
                refs.append(_found(tree, name, None if "meta.json" in tree.files(name) else folder))
    if not refs:
        raise UsageError(
            f"{tree.place}: neither {MANIFEST}, nor a URDF, xacro, SDF or MJCF file here or in a folder one or two "
            "levels down; name a dataset folder or one asset folder"
        )
    _refuse_twice((ref.asset_id for ref in refs), str(tree.place))
    return refs


def check_asset_id(asset_id: str, where: str) -> str:
    """The id, if it can name a folder of the output; else ``UsageError``."""
    unsafe = [character for character in asset_id if character in '/\\:*?"<>|' or not character.isprintable()]
    if unsafe:
        raise UsageError(
            f"{where}: asset_id {asset_id!r} holds {unsafe[0]!r}; it names a folder of the output, "
            "so use letters, digits, '.', '_', '-' and spaces"
        )
    if not asset_id or asset_id != asset_id.strip() or asset_id.startswith("."):
        raise UsageError(
            f"{where}: asset_id {asset_id!r} names a folder of the output; it may not be empty or start with '.'"
        )
    if len(asset_id.encode()) > MAX_ID_LENGTH:
        raise UsageError(f"{where}: asset_id '{asset_id[:20]}…' has over {MAX_ID_LENGTH} bytes; it names a folder")
    return asset_id


def _row(tree: Tree, where: str, row: dict[str, str | None]) -> AssetRef:
    if None in row:
        raise UsageError(f"{where}: more cells than columns; put quotes round a text that holds a comma")
    cells = {name: (row.get(name) or "").strip() for name in COLUMNS}
    if not cells["path"]:
        raise UsageError(f"{where}: asset '{cells['asset_id']}' has no path; give its folder, relative to {tree.place}")
    return AssetRef(
        asset_id=check_asset_id(cells["asset_id"], where),
        path=str(_folder_of(tree.place, cells["path"], where)),
        category=cells["category"] or None,
        subset=cells["subset"] or None,
        prompt=cells["prompt"] or None,
        support=_support(cells["support"], where),
        up=_up(cells["up"], where),
    )


def _support(stated: str, where: str) -> SupportKind | None:
    if stated and stated not in list(SupportKind):
        raise UsageError(
            f"{where}: support '{stated}' is none of {_listed(SupportKind)}; leave it empty to have it found"
        )
    return SupportKind(stated) if stated else None


def _up(cell: str, where: str) -> UpAxis | None:
    if cell and cell not in list(UpAxis):
        raise UsageError(f"{where}: up '{cell}' is no axis; choose from: {_listed(UpAxis)}, or leave it empty")
    return UpAxis(cell) if cell else None


def _folder_of(place: Path | str, path: str, where: str) -> Path | str:
    if not is_url(place):
        return (Path(place) / path).resolve()
    scheme, _, key = place.partition("://")
    found = posixpath.normpath(posixpath.join(f"/{key}", path))
    if path.startswith("/") or found.split("/")[1] != key.split("/")[0]:
        raise UsageError(f"{where}: path '{path}' leaves the bucket of {place}; give a folder relative to it")
    return f"{scheme}:/{found}"


def _found(tree: Tree, folder: str, category: str | None = None) -> AssetRef:
    path = str(tree.at(folder))
    asset_id = check_asset_id(posixpath.basename(path), path)
    return AssetRef(asset_id=asset_id, path=path, category=category)


def _refuse_twice(asset_ids: Iterable[str], where: str) -> None:
    twice = [asset_id for asset_id, count in Counter(asset_ids).items() if count > 1]
    if twice:
        raise UsageError(f"{where}: asset_id {_listed(twice[:10])} more than once; each names one folder of the output")


def _holds_asset(tree: Tree, folder: str) -> bool:
    """Whether the folder is an asset's: a file that describes it lies in it, or in its ``urdf`` folder, as ROS packages
    have it."""
    inner = f"{folder}/urdf" if folder else "urdf"
    for place in (folder, inner):
        names = tree.files(place)
        if any(name.endswith(SUFFIXES[:-1]) for name in names):
            return True
        for name in names:
            file = f"{place}/{name}" if place else name
            if name.endswith(SUFFIXES[-1]) and name not in NOT_MODELS and is_mjcf(tree.read(file)):
                return True
    return False


def _local(data: Path) -> Tree:
    if not data.exists():
        raise UsageError(f"no dataset at {data}: {_neighbours(data)}")
    if not data.is_dir():
        raise UsageError(f"{data} is a file; name the folder that holds {MANIFEST}, asset folders, or one asset's URDF")
    return local_tree(data.resolve())


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"


def _neighbours(data: Path) -> str:
    """Text that lists the folders beside a missing one."""
    parent = nearest_existing(data.parent)
    found = local_tree(parent).folders("")[:20]
    return f"{parent} has the folders {_listed(found)}"
