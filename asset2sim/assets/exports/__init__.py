"""Formats written beside the URDF that keep its dynamics."""

from collections.abc import Sequence
from pathlib import Path

from asset2sim.assets.exports.mjcf import export_mjcf
from asset2sim.assets.exports.usd import export_usd, require_usd
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import Export

__all__ = ["export_mjcf", "export_usd", "require_exports", "write_exports"]


def require_exports(exports: Sequence[Export]) -> None:
    """Raise UsageError where an export needs a package that is not installed; MJCF needs none."""
    if Export.USD in exports:
        require_usd()


def write_exports(folder: Path, overlay: PhysicsOverlay, exports: Sequence[Export], timestep_s: float) -> None:
    """Write these formats into a refined folder, with the checks' time step. The folder's URDF must be the one that the
    overlay describes. Raises UsageError as ``require_exports`` does, and AssetError where the folder's URDF or meshes
    cannot be read."""
    if Export.MJCF in exports:
        export_mjcf(folder, overlay, timestep_s)
    if Export.USD in exports:
        export_usd(folder, overlay)
