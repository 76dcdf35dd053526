"""Write a baseline's overlay unchanged, and verify it in every engine."""

from pathlib import Path

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import write_folder
from asset2sim.refinement.judge import Verified, verify_as_written
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import CollisionMode


def judge_overlay(extraction: Extraction, overlay: PhysicsOverlay, path: Path, settings: Settings) -> Verified:
    """Reports and verdict of the overlay written into ``path`` with the authored collision geometry.

    No mending, no state search. References to missing meshes are still dropped, since no engine loads a file with one.
    The folder's URDF is ``path / URDF_NAME``. Raises AssetError where the file cannot be written.
    """
    folder = write_folder(extraction, overlay, {}, path, settings.physics, CollisionMode.KEEP)
    return verify_as_written(extraction, folder.urdf, overlay, settings)
