"""A dataset is a list of asset references: from a manifest, a folder of asset folders, or one asset folder."""

import posixpath
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from asset2sim.intake.asset_folders import MANIFEST as MANIFEST
from asset2sim.intake.asset_folders import check_asset_id as check_asset_id
from asset2sim.intake.asset_folders import file_asset, find_assets, same_folder
from asset2sim.intake.formats import FORMATS
from asset2sim.intake.locate import package_of, split_url
from asset2sim.intake.overrides import NUMBERS, PREFIXES, read_overrides, with_overrides
from asset2sim.intake.table_file import MAX_TABLE_BYTES, Columns, read_rows
from asset2sim.storage.regular_files import NOT_THERE, folder_problem, is_file, path_problem, printable
from asset2sim.storage.tree import Tree, local_tree, remote_tree
from schemas.asset import AssetRef
from schemas.authored import keep_words
from schemas.errors import Mistakes, UnknownChoiceError, UsageError
from schemas.location import Location, nearest_existing
from schemas.support import SupportKind
from schemas.vocabulary import UpAxis

REQUIRED_COLUMNS = ("asset_id", "path")
COLUMNS = ("asset_id", "category", "path", "subset", "prompt", "support", "up", "keep")


def load_dataset(
    data: Path | str,
    subset: str | None = None,
    asset_ids: Sequence[str] = (),
    limit: int | None = None,
    cut: Callable[[list[AssetRef]], list[AssetRef]] = list,
) -> list[AssetRef]:
    """The chosen assets of a dataset, at most ``limit``, in the manifest's order, else by name; those that the
    dataset has are ``cut`` before (see ``scenes``).

    ``data`` holds a ``manifest.csv``, or asset folders (one or two levels down), or is one asset's folder or file; it
    is on this machine or a URL (``schemas.location``). Paths come out absolute. A manifest row whose folder is missing
    stays: it fails as an asset, not as a run. Raises ``UsageError``, naming the valid choices, for a dataset that
    cannot be read, all that is wrong with its tables at once, and for a subset or an asset that it does not have.
    """
    mistakes, (place, file) = Mistakes(), _split(Location(data))
    tree = remote_tree(place) if place.is_url else _local(place.folder)
    try:
        has_manifest = MANIFEST in (*tree.files(""), *tree.folders(""))
        if file:
            found = [file_asset(tree, file)]
        else:
            found = read_manifest(tree, mistakes) if has_manifest else find_assets(tree)
        root = tree.place if place.is_url else root_of(tree.place)
        refs = [ref.model_copy(update={"root": str(root)}) for ref in found]
        whole = not mistakes.said
        refs = with_overrides(tree, cut(refs) if whole else refs, mistakes, whole=whole and not file)
        mistakes.end()
    except OSError as error:
        raise UsageError(f"{error.filename or data} {path_problem(Path(data), error)}") from error
    if subset is not None:
        known = {ref.subset for ref in refs if ref.subset is not None}
        refs = [ref for ref in refs if ref.subset == subset]
        if not refs:
            raise UnknownChoiceError("subset", subset, known)
    known = {ref.asset_id for ref in refs}
    for asset_id in asset_ids:
        if asset_id not in known:
            raise UnknownChoiceError("asset", asset_id, known)
    if asset_ids:
        refs = [ref for ref in refs if ref.asset_id in asset_ids]
    if limit is not None and limit < 1:
        raise UsageError(f"--limit {limit}: choose a number from 1 to {len(refs)}")
    return refs[:limit]


def _split(place: Location) -> tuple[Location, str]:
    """The folder of DATA, and the file's name where DATA is a file that may describe an asset."""
    if place.is_url:
        folder, name = split_url(place)
        return Location(folder), name
    path = place.folder
    if path.suffix in FORMATS and is_file(path):
        return Location(path.absolute().parent), path.name
    return place, ""


def root_of(data: Location) -> Path:
    """The folder below which a dataset's files may lie: its own, or that of the package of which it is a part."""
    return package_of(_split(data)[0].folder.resolve())


def read_manifest(tree: Tree, mistakes: Mistakes) -> list[AssetRef]:
    """The rows of a dataset's manifest that are right, paths relative to its folder; ``mistakes`` get what names the
    line of the others. Raises ``UsageError`` for what is no table."""
    manifest = str(tree.at(MANIFEST))
    try:
        content = tree.read(MANIFEST, MAX_TABLE_BYTES + 1)
    except OSError as error:
        raise UsageError(f"{manifest}: it {path_problem(Path(manifest), error)}") from error
    columns = Columns(REQUIRED_COLUMNS, (*COLUMNS, *NUMBERS), PREFIXES, prose=("prompt",))
    refs, first = list[AssetRef](), dict[str, tuple[str, int]]()
    for line, row in read_rows(content, manifest, columns, mistakes):
        where = f"{manifest}, line {line}"
        with mistakes:
            refs.append(_row(tree, where, row))
        with mistakes:
            asset_id = row.get("asset_id", "")
            other, above = first.setdefault(asset_id.casefold(), (asset_id, line))
            if above != line and asset_id:
                raise UsageError(f"{manifest}, lines {above} and {line}: {same_folder(other, asset_id)}")
    if not refs and not mistakes.said:
        raise UsageError(f"{manifest}: no rows under the heading; add a row per asset")
    return refs


def _row(tree: Tree, where: str, row: dict[str, str]) -> AssetRef:
    cells = {name: row.get(name, "") for name in COLUMNS}
    mistakes = Mistakes()
    found: dict[str, object] = {name: cells[name] or None for name in ("category", "subset", "prompt")}
    fields: dict[str, Callable[[], object]] = {
        "asset_id": lambda: check_asset_id(cells["asset_id"], where),
        "support": lambda: _support(cells["support"], where),
        "up": lambda: _up(cells["up"], where),
        "keep": lambda: _keep(cells["keep"], where),
        "overrides": lambda: read_overrides(row, where),
    }
    with mistakes:
        if not cells["path"]:
            known = f"asset '{cells['asset_id']}'"
            raise UsageError(f"{where}: {known} has no path; give its folder or file, relative to {tree.place}")
        path, fault = _folder_of(tree.place, cells["path"], where)
    for name, read in fields.items():
        with mistakes:
            found[name] = read()
    mistakes.end()
    return AssetRef.model_validate({**found, "path": str(path), "fault": fault})


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


def _keep(cell: str, where: str) -> tuple[str, ...] | None:
    try:
        return keep_words(cell) if cell else None
    except ValueError as error:
        raise UsageError(f"{where}: keep '{cell}': {error}, or leave it empty for the run's") from None


def _folder_of(place: Location, path: str, where: str) -> tuple[Path | str, str | None]:
    """The folder of a row, absolute, and why it cannot be found, if so."""
    if not place.is_url:
        whole = place.folder / path
        try:
            return whole.resolve(), None
        except (OSError, RuntimeError) as error:
            return whole, f"{where}: its path '{path}' {path_problem(whole, error)}; mend the path, or the link"
    scheme, _, key = place.partition("://")
    found = posixpath.normpath(posixpath.join(f"/{key}", path))
    if path.startswith("/") or found.split("/")[1] != key.split("/")[0]:
        raise UsageError(f"{where}: path '{path}' leaves the bucket of {place}; give a folder relative to it")
    return f"{scheme}:/{found}", None


def _local(data: Path) -> Tree:
    problem = folder_problem(data)
    if problem == NOT_THERE:
        raise UsageError(f"no dataset at {data}: {_neighbours(data)}")
    if problem is not None:
        what = f"name the folder that holds {MANIFEST}, asset folders, or one asset's URDF"
        raise UsageError(f"{printable(data)} {problem}; {what}")
    return local_tree(data.resolve())


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"


def _neighbours(data: Path) -> str:
    """Text that lists the folders beside a missing one."""
    parent = nearest_existing(data.parent)
    try:
        return f"{parent} has the folders {_listed(local_tree(parent).folders('')[:20])}"
    except OSError as error:
        return f"{parent} {path_problem(parent, error)}"
