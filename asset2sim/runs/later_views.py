"""Views that a run left out: drawn for every refined asset that has none, each in a killable child process."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from asset2sim.assets.authored import read_overlay
from asset2sim.assets.folder import URDF_NAME
from asset2sim.catalog.switch import find_catalog, no_catalog_error
from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work, in_child
from asset2sim.models.gateway.questions import LOG_FOLDER
from asset2sim.render import write_views
from asset2sim.storage.lock import lock_output
from schemas.errors import UsageError
from schemas.location import Location
from schemas.settings import Settings, ViewSettings


def write_missing_views(out: Path | str, settings: Settings) -> dict[str, str]:
    """Draw the refined assets in the folder ``out`` that have no views, ``settings.run.workers`` at once; asset id →
    what went wrong, empty where nothing did. The pictures are those that the run would have written.

    Raises UsageError for a URL, a folder that no run wrote to, and one that a run is writing to.
    """
    if Location(out).is_url:
        raise UsageError(f"--out {out}: views are drawn in a folder; copy the assets here first")
    out = Path(out)
    if find_catalog(out) is None:
        raise no_catalog_error(out)
    with lock_output(out), ThreadPoolExecutor(settings.run.workers) as pool:
        folders = {folder.name: folder for folder in sorted((out / "assets").iterdir()) if lacks_views(folder)}
        return dict(zip(folders, pool.map(partial(draw, out, settings), folders.values()), strict=True))


def lacks_views(folder: Path) -> bool:
    """Whether a folder is a refined asset's, and has no views."""
    return (folder / "overlay.json").is_file() and not (folder / "views").is_dir()


def draw(out: Path, settings: Settings, folder: Path) -> str:
    """Draw one asset in a child process, under the limits of an asset; what went wrong, or an empty text."""
    limits = settings.run.asset_time_limit_s, settings.run.asset_memory_limit_mb
    work = Work(write_views_of, (folder, settings.views), *limits)
    outcome = in_child(work, log_path=out / LOG_FOLDER / f"{folder.name}.views.log")
    return "" if outcome.ending is Ending.RETURNED else outcome.reason


def write_views_of(folder: Path, settings: ViewSettings) -> None:
    """Write the views of one refined asset's initial state into its folder. Raises AssetError as ``write_views``."""
    overlay = read_overlay(folder)
    write_views(folder / URDF_NAME, overlay.initial_positions, folder / "views", settings)
