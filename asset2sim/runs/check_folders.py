"""The checks alone, on URDF folders as they are: refined, edited by hand, or foreign."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from asset2sim.assets.urdf.base import WORLD
from asset2sim.checks.known_checks import failure_guide
from asset2sim.checks.verdict import failures_of
from asset2sim.engines.registry import require
from asset2sim.intake.dataset import load_dataset
from asset2sim.runs.asset_attempt import attempt_in_child
from asset2sim.runs.here import each_here
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import UsageError
from schemas.interaction import EngineReport
from schemas.location import Location
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Method, Severity


def check_settings(settings: Settings) -> Settings:
    """The settings under which folders are checked: nothing is proposed and no picture drawn."""
    views = settings.views.model_copy(update={"write": False})
    return settings.model_copy(update={"method": Method.RAW, "views": views})


def check_folders(folders: Sequence[Path | str], settings: Settings, pipeline: str) -> list[AssetRecord]:
    """A record of each asset in the folders (asset folders, or folders of those), in their order, each from a killable
    child that runs ``pipeline`` (``module:function``). Raises UsageError for a folder without assets, a URL, and an
    engine that is not installed."""
    for engine in settings.engine.verify or ():
        require(engine)
    refs: dict[str, AssetRef] = {}
    for folder in folders:
        if Location(folder).is_url:
            raise UsageError(f"{folder}: folders are checked here; copy it first")
        refs |= {ref.path: ref for ref in load_dataset(folder)}
    with tempfile.TemporaryDirectory(prefix="asset2sim-check-") as place:
        # Two folders may hold assets of one name.
        places = {path: Path(place, str(number)) for number, path in enumerate(refs)}
        own = check_settings(settings)

        def attempt(ref: AssetRef) -> AssetRecord:
            places[ref.path].mkdir()
            return attempt_in_child(pipeline, ref, places[ref.path], own, _never, owner=place).record

        return each_here(attempt, list(refs.values()), place, pipeline, settings.run.workers)


def check_as_json(record: AssetRecord, settings: Settings) -> dict[str, Any]:
    """One asset's record as JSON values: verdict, state, what each engine failed, and warnings and errors."""
    overlay = record.overlay
    return {
        "asset_id": record.ref.asset_id,
        "path": record.ref.path,
        "status": record.status.value,
        "failure_mode": record.failure_mode.value,
        "reason": record.reason,
        "remedy": remedy_of(record.failure_mode),
        # The link that stands for the world weighs nothing, whatever engines invent for it.
        "mass_kg": overlay and sum(link.mass_kg for link in overlay.links if link.name != WORLD),
        "support": overlay and overlay.support.kind.value,
        "initial_positions": overlay and overlay.initial_positions,
        "engines": {report.engine.value: _engine(record, report, settings) for report in record.reports},
        "findings": [
            item.model_dump(mode="json", exclude_none=True)
            for item in record.findings
            if item.severity is not Severity.INFO
        ],
    }


def remedy_of(mode: FailureMode) -> str | None:
    """The remedy of a failure, in words; None where nothing failed."""
    guide = failure_guide().get(mode)
    return None if guide is None else guide.remedy


def engine_verdict(record: AssetRecord, report: EngineReport, settings: Settings) -> str:
    """The first failure in one engine, or ok."""
    assert record.overlay is not None, "what was measured has an overlay"
    found = failures_of(report, record.overlay, settings.thresholds)
    return found[0].mode.value if found else "ok"


def _engine(record: AssetRecord, report: EngineReport, settings: Settings) -> dict[str, Any]:
    assert record.overlay is not None, "what was measured has an overlay"
    failed = failures_of(report, record.overlay, settings.thresholds)
    return {
        "version": report.engine_version,
        "passed": not failed,
        "failures": [
            {"check": item.mode.value, "subject": item.subject, "reason": item.reason,
             "remedy": remedy_of(item.mode), "value": item.value, "limit": item.limit}
            for item in failed
        ],
    }  # fmt: skip


def _never(request: ModelRequest) -> ModelAnswer:
    return ModelAnswer(content=None, error="checks ask no model", calls=())
