"""Publish: write the files beside a refined URDF; bake the state into it, and hang it from a world, if requested."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter

from asset2sim.assets.authored import REFINED_NAME
from asset2sim.assets.checksums import write_checksums
from asset2sim.assets.exports import write_exports
from asset2sim.assets.exports.refined_object import read_object
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.bake import bake_file, baked
from asset2sim.assets.urdf.base import hung_from_world
from asset2sim.engines.contacts import penetration
from asset2sim.engines.static_object import contacts_at
from schemas.finding import Finding, warning
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.recipe import MEASUREMENT_NAME, RECIPE_NAME, Recipe
from schemas.settings import Settings
from schemas.vocabulary import BaseMode, Stage, StateMode
from tasks.known_views import VIEW_CACHE, write_known_views
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
