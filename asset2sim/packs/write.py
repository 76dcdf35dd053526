"""The writer of all packs: objects with their exports, preview, licence, provenance, receipt and checksums."""

import json
import keyword
import re
import shutil
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from asset2sim.assets.authored import read_overlay
from asset2sim.assets.checksums import write_checksums
from asset2sim.assets.exports import require_exports, write_exports
from asset2sim.assets.folder import LOADER_NAME, URDF_NAME
from asset2sim.catalog.index import ASSETS_FOLDER, loader_source, ok_rows
from asset2sim.load import describe
from asset2sim.packs.declared_pack import OBJECTS, Pack, PackedObject
from asset2sim.render import write_views
from schemas.errors import UsageError
from schemas.overlay import PhysicsOverlay
from schemas.recipe import MEASUREMENT_NAME, RECIPE_NAME
from schemas.settings import EngineSettings, ViewSettings

PREVIEW, PROVENANCE, RECEIPT, LICENCE = "preview.png", "provenance.json", "receipt.json", "LICENSE.md"
NOT_STATED = "not stated"
COMMON = "common"
"""The folder of templates that every pack has."""
SHOWN = ("penetration_m", "drift_m", "drift_rad", "peak_speed_m_s")
"""Numbers of an engine's measurement that a receipt has, beside its version."""


def write_pack(
    out: Path, target: Path, pack: Pack, asset_ids: Sequence[str] = (), licence: str = NOT_STATED
) -> list[PackedObject]:
    """Write a consumer's pack of the objects in OUT that passed; the objects. Raises UsageError for an OUT without any,
    a target that is not empty, and an export whose package is not installed."""
    require_exports(pack.exports)
    rows = ok_rows(out, asset_ids)
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise UsageError(f"{target} is there already; name a folder that is empty or not there")
    names = dict(zip(rows, python_names(rows), strict=True))
    packed = [pack_object(out / ASSETS_FOLDER / name, target, names[name], row, pack) for name, row in rows.items()]
    (target / OBJECTS / LOADER_NAME).write_text(loader_source(), encoding="utf-8")
    given = {"pack": pack, "objects": packed, "licence": licence, "version": made_by(packed[0])}
    for source in (f"{COMMON}/pack", f"{pack.name}/pack"):
        render_folder(source, target, given)
    for item in packed:
        for source in (f"{COMMON}/object", f"{pack.name}/object"):
            render_folder(source, item.folder, {**given, "object": item, "receipt": receipt(item.folder)})
    if pack.finish is not None:
        pack.finish(target, packed, given)
    for item in packed:
        write_checksums(item.folder)
    write_checksums(target)
    return packed


def python_names(asset_ids: Sequence[str] | Mapping[str, Any]) -> list[str]:
    """A name for each id that Python, ROS and URIs take: lower case letters, digits and underscores."""
    found: list[str] = []
    for asset_id in asset_ids:
        name = re.sub(r"[^a-z0-9]+", "_", asset_id.lower()).strip("_") or "object"
        name = f"object_{name}" if name[0].isdigit() or keyword.iskeyword(name) else name
        while name in found:
            name += "_"
        found.append(name)
    return found


def pack_object(source: Path, target: Path, name: str, row: Mapping[str, Any], pack: Pack) -> PackedObject:
    """Copy one refined object into the pack, with its exports, preview, provenance and receipt."""
    folder = target / OBJECTS / name
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns("SHA256SUMS", RECIPE_NAME))
    overlay = read_overlay(folder)
    write_exports(folder, overlay, pack.exports, EngineSettings().timestep_s)
    write_preview(folder, overlay)
    recipe = source / RECIPE_NAME
    stated = json.loads(recipe.read_text(encoding="utf-8")) if recipe.is_file() else {}
    made = {"asset_id": row["asset_id"], "run_id": row["run_id"], "scale": overlay.scale,
            "made_with": stated.get("made_with", {}), "originals_sha256": stated.get("originals", {})}  # fmt: skip
    write_json(folder / PROVENANCE, made)
    write_json(folder / RECEIPT, {"status": row["status"], **receipt(folder)})
    return PackedObject(row["asset_id"], name, folder, describe(folder), overlay, row)


def write_preview(folder: Path, overlay: PhysicsOverlay) -> None:
    """Write ``preview.png``: the first of the object's views, which are drawn where the run left them out."""
    views = folder / "views"
    if not any(views.glob("*.png")):
        write_views(folder / URDF_NAME, overlay.initial_positions, views, ViewSettings())
    shutil.copyfile(min(views.glob("*.png")), folder / PREVIEW)


def receipt(folder: Path) -> dict[str, Any]:
    """Of each engine its version, measurements of the object at rest by the names that ``measurement.json`` has, and
    the verdict of every check on every joint, drop and start; none where the run did not keep them."""
    engines = {}
    for report in json.loads((folder / MEASUREMENT_NAME).read_text(encoding="utf-8")):
        measured = report.get("measurement") or {}
        engines[report["engine"]] = {
            "version": report["engine_version"],
            **{key: measured[key] for key in SHOWN if key in measured},
            "checks": verdicts(**report["judged"]) if report.get("judged") else [],
        }
    return {"engines": engines}


def verdicts(checks: Sequence[dict[str, Any]], failures: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The verdict at rest, whose numbers stand beside it, then that of each check on each subject."""
    failed = {failure["mode"] for failure in failures} - {seen["test"] for seen in checks}
    found = [{"check": seen["test"], **{key: seen[key] for key in seen if key != "test"}} for seen in checks]
    return [{"check": "rest", "subject": "object", "passed": not failed}, *found]


def made_by(item: PackedObject) -> str:
    """The version of asset2sim that refined an object; empty where its run did not keep it."""
    stated = json.loads((item.folder / PROVENANCE).read_text(encoding="utf-8"))
    return str(stated["made_with"].get("asset2sim", ""))


def render_folder(source: str, target: Path, given: Mapping[str, Any]) -> None:
    """Render every template below a folder to the same path below ``target``; none where there is no folder."""
    environment = Environment(
        loader=PackageLoader("asset2sim.packs"), undefined=StrictUndefined, keep_trailing_newline=True,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["literal"] = repr
    root = Path(str(files("asset2sim.packs").joinpath("templates", source)))
    for file in sorted(root.rglob("*.jinja")):
        inner = file.relative_to(root)
        place = target / inner.with_suffix("")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(environment.get_template(f"{source}/{inner.as_posix()}").render(given), encoding="utf-8")


def write_json(path: Path, document: object) -> None:
    """Write a JSON file as people read it."""
    path.write_text(f"{json.dumps(document, indent=1, ensure_ascii=False)}\n", encoding="utf-8")
