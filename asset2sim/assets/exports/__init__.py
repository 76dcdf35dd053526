"""Formats written beside the URDF that keep its dynamics; what writes USD is imported where ``usd-core`` is there."""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from asset2sim.assets.exports.mjcf import export_mjcf
from asset2sim.assets.exports.sdf import export_sdf
from schemas.errors import UsageError
from schemas.finding import Finding, remark
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import Export, Stage


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
    lacking = tuple(finding for export in exports for finding in left_out(overlay, export))
    return (*lacking, *(usd_findings(folder, overlay, timestep_s) if Export.USD in exports else ()))


def left_out(overlay: PhysicsOverlay, export: Export) -> tuple[Finding, ...]:
    """A finding of what a format has no words for; none where it holds all of the object."""
    biases = {joint.name: joint.bias for joint in overlay.joints if joint.bias is not None}
    clicks = [name for name, bias in biases.items() if bias.period > 0.0]
    others = [f"{name} ({bias.kind})" for name, bias in biases.items() if name not in clicks]
    rolls = overlay.rolling_friction_m > 0.0
    found = []
    if clicks and export is not Export.MJCF:
        found.append(f"the clicks of {', '.join(clicks)}: friction alone keeps {'them' if clicks[1:] else 'it'}")
    if export is Export.USD and others:
        found.append(f"for PhysX, what {', '.join(others)} exerts: stated as asset2sim:bias_…, for a user to apply")
    if export is Export.USD and rolls:
        found.append("for PhysX, friction against rolling: a round object rolls on")
    if export is Export.SDF and others:
        found.append(f"what {', '.join(others)} exerts")
    if export is Export.SDF and rolls:
        found.append("except for Bullet, friction against rolling")
    message = f"{export.value} leaves out {'; '.join(found)}"
    return (remark(Stage.PUBLISH, "export_leaves_out", message),) if found else ()


def usd_findings(folder: Path, overlay: PhysicsOverlay, timestep_s: float) -> tuple[Finding, ...]:
    """Write USD; a finding where collision hulls were made smaller for PhysX: how many, and by how much at most."""
    from asset2sim.assets.exports.usd import export_usd
    from asset2sim.assets.exports.usd_collision import POLYGON_LIMIT, VERTEX_LIMIT

    export = export_usd(folder, overlay, timestep_s)
    if not export.limited:
        return ()
    message = (
        f"{export.path.name}: {len(export.limited)} collision hulls are cut down to {VERTEX_LIMIT} vertices "
        f"and {POLYGON_LIMIT} faces, the most that PhysX takes to a GPU; they lie inside the given ones, at most "
        f"{1e3 * export.distance_m:.3g} mm from them, with at least {100.0 * export.volume_ratio:.1f} % of the volume. "
        "URDF and MJCF keep the given ones"
    )
    return (remark(Stage.PUBLISH, "usd_hulls_limited", message, value=export.distance_m),)
