"""Refined objects without their dataset's geometry: written out of a run's folder, and applied to a copy of it.

An overlay folder holds for each object its recipe, overlay, measurements and checksums (``tasks.remake``). Who has the
dataset makes the refined objects of it again: the same bytes, with no model and no engine.
"""

import json
import shutil
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from asset2sim.assets.authored import REFINED_NAME
from asset2sim.assets.checksums import FILE, changed_files
from asset2sim.assets.extract import INPUTS
from asset2sim.catalog.index import ASSETS_FOLDER, local_files, ok_rows, write_entries
from asset2sim.experiments.isolation import Ending, run_isolated
from asset2sim.experiments.isolation.children import preload
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.scenes import with_parts
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.inputs import InputSettings
from schemas.recipe import MEASUREMENT_NAME, RECIPE_NAME, Recipe, Remade
from schemas.settings import RunSettings

INDEX = "overlays.json"
VERSION = 1
BROUGHT = (RECIPE_NAME, REFINED_NAME, MEASUREMENT_NAME, FILE)
"""Files of a refined folder that hold nothing of the asset's geometry, and from which it is made again."""
READ_ME = """\
# Physics without geometry

{count} refined objects as numbers: masses, inertias, joint terms, start states, collision shapes as planes that cut
the hulls of the original meshes, what the checks measured, and the SHA-256 of every original file. No vertex of an
original is here: bring your own copy of the dataset.

    pip install asset2sim
    asset2sim overlays apply THIS_FOLDER DATASET --out OUT

writes OUT/assets, the same bytes that were verified, in about a second an object; no model is asked and no engine runs.
An object whose files are not the originals is named, and left out.
"""


def export_overlays(out: Path, target: Path, asset_ids: Sequence[str] = ()) -> tuple[list[str], list[str]]:
    """Write an overlay folder of the objects in OUT that passed: their ids, and a line for each that is left out.
    Raises UsageError as ``ok_rows`` does, and for a target that is not empty."""
    rows = ok_rows(out, asset_ids)
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise UsageError(f"{target} is there already; name a folder that is empty or not there")
    written, left_out, entries = list[str](), list[str](), list[dict[str, Any]]()
    for name, row in rows.items():
        folder = out / ASSETS_FOLDER / name
        changed = changed_files(folder)
        if not (folder / RECIPE_NAME).is_file():
            left_out.append(f"{name}: it was refined before recipes were kept; refine it again with --force")
        elif changed or changed is None:
            left_out.append(
                f"{name}: not as it was verified ({', '.join(changed or (f'no {FILE}',))}); refine it again"
            )
        else:
            (target / name).mkdir(parents=True)
            for file in BROUGHT:
                shutil.copyfile(folder / file, target / name / file)
            entries.append({key: value for key, value in row.items() if key != "run_id"})
            written.append(name)
    if written:
        text = json.dumps({"version": VERSION, "assets": entries}, indent=1, ensure_ascii=False)
        (target / INDEX).write_text(f"{text}\n", encoding="utf-8")
        (target / "README.md").write_text(READ_ME.format(count=len(written)), encoding="utf-8")
    return written, left_out


def read_overlays(overlays: Path, asset_ids: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """Asset id → its row in an overlay folder. Raises UsageError for what is none, and for an asset that it lacks."""
    try:
        document = json.loads((overlays / INDEX).read_text(encoding="utf-8"))
        version, rows = document["version"], {str(row["asset_id"]): row for row in document["assets"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UsageError(f"{overlays} is no overlay folder: its {INDEX} cannot be read ({error})") from None
    if version != VERSION:
        raise UsageError(f"{overlays} is of version {version}, and this asset2sim reads {VERSION}; install another")
    unknown = [name for name in asset_ids if name not in rows]
    if unknown:
        raise UsageError(f"{overlays} has no {', '.join(unknown)}; it has {', '.join(sorted(rows)[:30])}")
    return {name: row for name, row in rows.items() if not asset_ids or name in asset_ids}


def apply_overlays(
    overlays: Path,
    data: Path,
    out: Path,
    run: RunSettings,
    remake: str,
    asset_ids: Sequence[str] = (),
    inputs: InputSettings = INPUTS,
) -> list[Remade]:
    """Make OUT/assets of an overlay folder and a copy of its dataset: what became of each object, in order. ``remake``
    names the function that makes one in a killable child. Raises UsageError."""
    rows = read_overlays(overlays, asset_ids)
    refs = {ref.asset_id: ref for ref in load_dataset(data, cut=lambda found: _parts(overlays, rows, found, inputs))}
    preload(remake)

    def one(name: str) -> Remade:
        ref = refs.get(name)
        if ref is None:
            return Remade(asset_id=name, outcome="original", reason=f"{data} has no asset of this id")
        if ref.fault is not None:
            return Remade(asset_id=name, outcome="original", reason=ref.fault)
        ended = run_isolated(
            remake, (ref, overlays / name, out, inputs), time_limit_s=run.asset_time_limit_s,
            memory_limit_mb=run.asset_memory_limit_mb, services={}, log_path=out / "logs" / f"{name}.log",
        )  # fmt: skip
        if ended.ending is Ending.RETURNED and isinstance(ended.value, Remade):
            return ended.value
        return Remade(asset_id=name, outcome="failed", reason=ended.reason, seconds=ended.seconds)

    out.mkdir(parents=True, exist_ok=True)
    with ThreadPoolExecutor(run.workers) as pool:
        made = list(pool.map(one, rows))
    there = [rows[item.asset_id] for item in made if item.written]
    write_entries(out, [(row, local_files(out / ASSETS_FOLDER / row["asset_id"])) for row in there])
    return made


def _parts(overlays: Path, rows: Mapping[str, Any], refs: list[AssetRef], inputs: InputSettings) -> list[AssetRef]:
    """The assets of a dataset; where an overlay is of a part of a scene, the scenes' parts in their place."""
    known = {ref.asset_id for ref in refs}
    recipes = (overlays / name / RECIPE_NAME for name in rows if name not in known)
    parts = (file.is_file() and Recipe.model_validate_json(file.read_bytes()).part for file in recipes)
    return with_parts(refs, inputs) if any(parts) else refs
