"""Publish: write the files beside a refined URDF; bake the state into it, and hang it from a world, if requested."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

import asset2sim.render
from asset2sim.assets.authored import REFINED_NAME
from asset2sim.assets.checksums import file_digest, write_checksums
from asset2sim.assets.exports import write_exports
from asset2sim.assets.exports.refined_object import read_object
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.meshes.array_file import read_arrays, write_arrays
from asset2sim.assets.urdf.bake import bake_file, baked
from asset2sim.assets.urdf.base import hung_from_world
from asset2sim.checks.known_reports import sources
from asset2sim.engines.contacts import penetration
from asset2sim.engines.registry import versions_of
from asset2sim.engines.static_object import contacts_at
from asset2sim.render import VIEW_NAMES, write_views
from asset2sim.storage.regular_files import write_whole
from schemas.finding import Finding, warning
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.recipe import MEASUREMENT_NAME, RECIPE_NAME, Recipe
from schemas.settings import Settings, ViewSettings
from schemas.source_code import code_digest
from schemas.vocabulary import BaseMode, Stage, StateMode
from tasks.progress import AssetJob, StageResult

REPORTS = TypeAdapter(list[EngineReport])
SAME_PHI_M = 1e-4
"""Largest difference of Φ between a state and the baked URDF that counts as rounding, m."""


@dataclass(frozen=True, kw_only=True)
class Published(StageResult):
    """The overlay as it lies beside the URDF; None where nothing was written."""


def publish_folder(
    job: AssetJob,
    folder: Path | None,
    overlay: PhysicsOverlay,
    reports: Sequence[EngineReport],
    recipe: Recipe | None = None,
) -> Published:
    """Write the overlay, the measurements, the recipe, exports and views into the asset's folder, if there is one.

    A baked state is measured again: the baked URDF's zero must be the state that was verified.
    """
    if folder is None:
        return Published()
    settings, findings = job.settings, tuple[Finding, ...]()
    if settings.state is StateMode.BAKE:
        overlay, findings = bake(folder / URDF_NAME, overlay, settings)
    # Without the wall time: the same input gives the same bytes.
    written = REPORTS.dump_json(list(reports), indent=1, exclude={"__all__": {"seconds"}})
    (folder / MEASUREMENT_NAME).write_bytes(written)
    if recipe is not None:
        (folder / RECIPE_NAME).write_text(recipe.model_dump_json(indent=1), encoding="utf-8")
    views = job.out / VIEW_CACHE / f"{job.ref.asset_id}.npz"
    return Published(overlay=overlay, findings=(*findings, *finish_folder(folder, overlay, settings, views)))


def finish_folder(
    folder: Path, overlay: PhysicsOverlay, settings: Settings, views: Path | None = None
) -> tuple[Finding, ...]:
    """Write the overlay, exports, views and checksums beside the URDF that it describes; findings of the exports. The
    file ``views`` keeps the views from run to run."""
    urdf = folder / URDF_NAME
    (folder / REFINED_NAME).write_text(overlay.model_dump_json(indent=2), encoding="utf-8")
    findings = write_exports(folder, overlay, settings.exports, settings.engine.timestep_s)
    if settings.base is BaseMode.WORLD and overlay.support.fixed:
        height = read_object(folder, overlay).height_to_stand(overlay.initial_positions)
        urdf.write_bytes(hung_from_world(urdf.read_bytes(), height))
    if settings.views.write:
        write_known_views(folder, overlay.initial_positions, settings.views, views)
    write_checksums(folder)
    return findings


def bake(urdf: Path, overlay: PhysicsOverlay, settings: Settings) -> tuple[PhysicsOverlay, tuple[Finding, ...]]:
    """Replace the URDF by one whose zero is the initial state; returns the matching overlay and findings."""
    before = penetration(contacts_at(urdf, overlay.initial_positions, settings.engine))
    bake_file(urdf, overlay.initial_positions, urdf)
    after = penetration(contacts_at(urdf, {}, settings.engine))
    if abs(after - before) <= SAME_PHI_M:
        return baked(overlay), ()
    message = (
        f"links overlap by {1e3 * after:.3g} mm at the zero of the baked URDF and by {1e3 * before:.3g} mm in the "
        "state that it holds"
    )
    return baked(overlay), (warning(Stage.PUBLISH, "bake_differs", message, value=after, limit=before),)


VIEW_CACHE = ".cache/views"
"""The views of an earlier run, a file of 80 kB an asset."""
VIEWS = "views"


def write_known_views(folder: Path, positions: Mapping[str, float], settings: ViewSettings, kept: Path | None) -> None:
    """Write the views of a refined folder as ``write_views`` does; those that the file ``kept`` holds of the same are
    taken from there, others are kept there."""
    key = "" if kept is None else digest(folder, positions, settings)
    stored = None if kept is None else read_arrays(kept, VIEW_NAMES)
    if stored is not None and stored[1] == key:
        (folder / VIEWS).mkdir(exist_ok=True)
        for name, picture in stored[0].items():
            write_whole(folder / VIEWS / f"{name}.png", picture.tobytes())
        return
    written = write_views(folder / URDF_NAME, positions, folder / VIEWS, settings)
    if kept is not None:
        write_arrays(kept, {file.stem: np.fromfile(file, dtype=np.uint8) for file in written}, key)


def digest(folder: Path, positions: Mapping[str, float], settings: ViewSettings) -> str:
    """SHA-256 over what decides the views: the URDF, the overlay, which says where the object faces, the files in the
    folders beside them, the state, the size, and the code."""
    whole = hashlib.sha256(f"{drawing()} {settings.width} {settings.height} {json.dumps(dict(positions))}".encode())
    beside = (file for place in folder.iterdir() if place.is_dir() and place.name != VIEWS for file in place.rglob("*"))
    for file in (folder / URDF_NAME, folder / REFINED_NAME, *sorted(file for file in beside if file.is_file())):
        name = file.relative_to(folder).as_posix()
        whole.update(f"{name} {file_digest(file)}\n".encode(errors="surrogateescape"))
    return whole.hexdigest()


@cache
def drawing() -> str:
    """Hash of the sources that read and draw objects, and versions of the packages that do."""
    room = Path(asset2sim.render.__file__).parent
    files = {file.name: file for file in room.glob("*.py")}
    return json.dumps(versions_of(("embreex",))) + sources() + code_digest(files, prose=True)
