"""Verifying the same files twice is verifying them once: an engine gives the same report on the same input."""

import hashlib
from collections.abc import Sequence

from asset2sim.assets.folder import Folder
from asset2sim.interaction.sweep import Cause
from asset2sim.verification import verify_in
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Engine, FailureMode

Known = dict[tuple[str, Engine, FailureMode | None], EngineReport]
"""Reports of one asset by what was written, where it was judged, and by which test (None: by all)."""


def verify_once(
    known: Known,
    engines: Sequence[Engine],
    folder: Folder,
    overlay: PhysicsOverlay,
    cause: Cause,
    settings: Settings,
    only: FailureMode | None = None,
) -> tuple[EngineReport, ...]:
    """As ``verification.verify``, but what is in ``known`` is taken from there, and what is new is added to it.

    Shapes and states are tried and taken back, so that the same files come up again and again. An engine that died is
    asked again: the machine may have been at fault.
    """
    written = digest(folder, overlay)
    reports = []
    for engine in engines:
        report = known.get((written, engine, only))
        if report is None:
            report = verify_in(engine, folder.urdf, overlay, cause, settings, only)
            if report.problem is None:
                known[written, engine, only] = report
        reports.append(report)
    return tuple(reports)


def digest(folder: Folder, overlay: PhysicsOverlay) -> str:
    """SHA-256 over what an engine is given: the URDF, the collision meshes made for it, and the overlay."""
    whole = hashlib.sha256(overlay.model_dump_json().encode())
    whole.update(folder.urdf.read_bytes())
    for files in folder.collision.values():
        for file in files:
            whole.update(hashlib.sha256((folder.path / file).read_bytes()).digest())
    return whole.hexdigest()
