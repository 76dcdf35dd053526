"""Formats written beside the URDF that keep its dynamics; what writes USD is imported where ``usd-core`` is there."""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from asset2sim.assets.exports.mjcf import export_mjcf
from asset2sim.assets.exports.sdf import export_sdf
from schemas.errors import UsageError
from schemas.finding import Finding
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import Export, Severity, Stage


def has_usd() -> bool:
    """Whether ``usd-core`` is installed."""
    return find_spec("pxr") is not None


def require_exports(exports: Sequence[Export]) -> None:
    """Raise UsageError where an export needs a package that is not installed; others need none."""
    if Export.USD in exports and not has_usd():
        raise UsageError("export 'usd' needs usd-core, which is not installed; pip install 'asset2sim[usd]'")


def write_exports(
    folder: Path, overlay: PhysicsOverlay, exports: Sequence[Export], timestep_s: float
) -> tuple[Finding, ...]:
    """Write these formats into a refined folder, with the checks' time step; findings of what differs in them. The
    folder's URDF must be the one that the overlay describes. Raises UsageError as ``require_exports`` does, and
    AssetError where the folder's URDF or meshes cannot be read."""
    require_exports(exports)
    if Export.MJCF in exports:
        export_mjcf(folder, overlay, timestep_s)
    if Export.SDF in exports:
        export_sdf(folder, overlay)
    return usd_findings(folder, overlay, timestep_s) if Export.USD in exports else ()


def usd_findings(folder: Path, overlay: PhysicsOverlay, timestep_s: float) -> tuple[Finding, ...]:
    """Write USD; a finding where collision hulls were made smaller for PhysX: how many, and by how much at most."""
    from asset2sim.assets.exports.usd import export_usd
    from asset2sim.assets.exports.usd_hulls import POLYGON_LIMIT, VERTEX_LIMIT

    export = export_usd(folder, overlay, timestep_s)
    if not export.limited:
        return ()
    finding = Finding(
        stage=Stage.PUBLISH,
        severity=Severity.INFO,
        code="usd_hulls_limited",
        message=f"{export.path.name}: {len(export.limited)} collision hulls are cut down to {VERTEX_LIMIT} vertices "
        f"and {POLYGON_LIMIT} faces, the most that PhysX takes to a GPU; they lie inside the given ones, at most "
        f"{1e3 * export.distance_m:.3g} mm from them, with at least {100.0 * export.volume_ratio:.1f} % of the volume. "
        "URDF and MJCF keep the given ones",
        value=export.distance_m,
    )
    return (finding,)
