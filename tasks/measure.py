"""Writing an overlay that no rule of ours touched, and judging it as written."""

from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import write_folder
from asset2sim.refinement.judge import Judged, judge_as_written
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import CollisionMode


def judge_overlay(extraction: Extraction, overlay: PhysicsOverlay, path: Path, settings: Settings) -> Judged:
    """Write the overlay into ``path`` with collision geometry as authored, and what every engine says of it.

    Nothing is mended, and the state is not searched. References to missing meshes are dropped all the same, since no
    engine loads a file with one. The folder's URDF is ``path / URDF_NAME``. Raises AssetError where the file cannot be
    written.
    """
    folder = write_folder(extraction, overlay, {}, path, settings.physics, CollisionMode.KEEP)
    return judge_as_written(extraction, folder.urdf, overlay, settings)
