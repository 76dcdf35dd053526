"""``OUT/assets/index.json``, what is there to load, and ``load.py`` beside it, a loader that needs nothing of us."""

import json
import re
import tempfile
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from asset2sim.assets.authored import REFINED_NAME
from asset2sim.assets.exports.refined_object import MJCF_NAME, SDF_NAME, USD_NAME
from asset2sim.assets.folder import INDEX_NAME, LOADER_NAME, URDF_NAME
from asset2sim.catalog.stored_tables import stored_columns
from asset2sim.catalog.switch import replace_file
from asset2sim.storage.objects import list_objects, send_objects
from schemas.errors import UsageError
from schemas.location import Location
from schemas.tables import TABLES
from schemas.vocabulary import Status

ASSETS_FOLDER = "assets"
_IMPORT = re.compile(r"^from asset2sim\.load\.(\w+) import (?:\([^)]*\)|[^(\n]*)\n", re.MULTILINE)
VERSION = 1
"""Of the index's layout."""
COLUMNS = (
    *("asset_id", "run_id", "category", "status", "failure_mode", "reason", "support", "mass_kg", "n_joints"),
    *(f"size_{axis}_m" for axis in "xyz"),
)
"""Of the table of assets, what the index has."""
FORMATS = {"urdf": URDF_NAME, "mjcf": MJCF_NAME, "usd": USD_NAME, "sdf": SDF_NAME}


def write_index(out: Path, url: str | None = None) -> None:
    """Write the index of every asset in OUT's tables, and the loader, each file in one step: into OUT, or to ``url``,
    the store that OUT mirrors, where its folders are. The caller holds OUT's lock and has written its tables."""
    folder = out / ASSETS_FOLDER
    there = stored_files(url) if url is not None else None
    rows = latest_by_asset(stored_columns(out, TABLES["assets"], COLUMNS).to_pylist())
    entries = []
    for asset_id, row in sorted(rows.items()):
        names = there.get(asset_id, ()) if there is not None else local_files(folder / asset_id)
        entries.append((row, names))
    write_entries(out, entries, url)


def write_entries(out: Path, rows: Sequence[tuple[Mapping[str, Any], Collection[str]]], url: str | None = None) -> None:
    """Write the index of these rows with the files of each, and the loader; see ``write_index``."""
    folder = out / ASSETS_FOLDER
    entries = [entry(row, names, folder / row["asset_id"]) for row, names in rows]
    document = {"version": VERSION, "loader": LOADER_NAME, "assets": entries}
    texts = {INDEX_NAME: json.dumps(document, indent=1, ensure_ascii=False) + "\n", LOADER_NAME: loader_source()}
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".index-", dir=out) as place:
        staged = {name: Path(place, name) for name in texts}
        for name, text in texts.items():
            staged[name].write_text(text, encoding="utf-8")
        if url is not None:
            send_objects({f"{url}/{ASSETS_FOLDER}/{name}": path for name, path in staged.items()})
            return
        folder.mkdir(exist_ok=True)
        for name, path in staged.items():
            replace_file(path, folder / name)


def loader_source() -> str:
    """``asset2sim.load`` as one file: its modules, each before those that import it, without those imports."""
    package, parts = files("asset2sim").joinpath("load"), dict[str, str]()

    def add(name: str) -> None:
        if name in parts:
            return
        parts[name] = ""
        text = package.joinpath(f"{name}.py").read_text(encoding="utf-8")
        for module in _IMPORT.findall(text):
            add(module)
        # The package's own comes last.
        del parts[name]
        parts[name] = _IMPORT.sub("", text).strip("\n") + "\n"

    add("__init__")
    own = parts.pop("__init__")
    documentation = own.index('"""', 3) + len('"""\n')
    return "\n\n".join((own[:documentation], *parts.values(), own[documentation:].lstrip("\n")))


def latest_by_asset(rows: Collection[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Asset id → the row of the latest run, whose folder it is. A run's id begins with its start."""
    found: dict[str, dict[str, Any]] = {}
    for row in rows:
        kept = found.get(row["asset_id"])
        if kept is None or row["run_id"] > kept["run_id"]:
            found[row["asset_id"]] = row
    return found


def ok_rows(out: Path, asset_ids: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """Asset id → its row of OUT's tables, of those that passed and are there. Raises UsageError for an OUT without any,
    and for an asset that is not among them."""
    if Location(out).is_url:
        raise UsageError(f"{out}: copy the run's folder here first")
    rows = latest_by_asset(stored_columns(out, TABLES["assets"], COLUMNS).to_pylist())
    found = {name: row for name, row in sorted(rows.items()) if row["status"] == Status.OK.value}
    for name in asset_ids:
        if name not in found:
            reason = rows[name]["reason"] if name in rows else "no run has refined it"
            raise UsageError(f"asset '{name}' of {out} did not pass: {reason}")
    if not found:
        raise UsageError(f"{out} has no object that passed; refine one: asset2sim refine DATA --out {out}")
    return {name: row for name, row in found.items() if not asset_ids or name in asset_ids}


def entry(row: Mapping[str, Any], names: Collection[str], folder: Path) -> dict[str, Any]:
    """One asset of the index. ``path`` and ``formats`` are relative to the index; ``path`` is None where nothing was
    written that could be loaded. Mass in kg, size in m, along the root link's axes at rest."""
    asset_id = row["asset_id"]
    loadable = URDF_NAME in names and REFINED_NAME in names
    sizes = [row[f"size_{axis}_m"] for axis in "xyz"]
    return {
        "asset_id": asset_id,
        "category": row["category"],
        "status": row["status"],
        "failure_mode": row["failure_mode"],
        "reason": row["reason"],
        "support": row.get("support") or support_of(folder) if loadable else None,
        "mass_kg": row["mass_kg"],
        "size_m": None if None in sizes else sizes,
        "joints": row["n_joints"],
        "formats": {kind: f"{asset_id}/{name}" for kind, name in FORMATS.items() if name in names},
        "path": asset_id if loadable else None,
    }


def support_of(folder: Path) -> str | None:
    """The support of a refined object, by its overlay: freestanding, fixed or handheld; None without one here."""
    try:
        overlay = json.loads((folder / REFINED_NAME).read_text(encoding="utf-8"))
    except OSError:
        return None
    return str(overlay.get("support", {}).get("kind", "freestanding"))


def local_files(folder: Path) -> tuple[str, ...]:
    """Those of the files that the index names which a refined folder has."""
    return tuple(name for name in (*FORMATS.values(), REFINED_NAME) if (folder / name).is_file())


def stored_files(url: str) -> dict[str, set[str]]:
    """Asset id → the names of the files at the top of its folder below OUT's URL."""
    found: dict[str, set[str]] = defaultdict(set)
    for name in list_objects(f"{url}/{ASSETS_FOLDER}"):
        asset_id, _, inner = name.partition("/")
        if inner and "/" not in inner:
            found[asset_id].add(inner)
    return found
