"""The checks alone, on URDF folders as they are (refined, edited by hand, foreign), as JSON and as SARIF 2.1.0."""

import re
import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any
from urllib.parse import quote

from asset2sim.assets.urdf.base import WORLD
from asset2sim.checks.declared_check import failure_guide
from asset2sim.checks.verdict import failures_of
from asset2sim.engines.registry import require
from asset2sim.experiments.isolation.children import warm_up
from asset2sim.experiments.isolation.supervise import each_in_threads
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.locate import find_source
from asset2sim.runs.asset_attempt import attempt_in_child
from asset2sim.storage.regular_files import read_regular
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError, UsageError
from schemas.interaction import EngineReport
from schemas.location import Location
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import Settings
from schemas.verdict import Guide
from schemas.vocabulary import FailureMode, Method, Severity, Status


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

        warm_up(pipeline)
        return each_in_threads(attempt, refs.values(), place, settings.run.workers)


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


SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
MOST_BYTES = 50_000_000
"""Bytes of a description in which lines are looked for."""
LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning"}


def check_as_sarif(records: Sequence[AssetRecord], root: Path) -> dict[str, Any]:
    """A SARIF log of the assets' failures (level ``error``, a rule a failure mode) and warnings (a rule a finding's
    code), each with the line of the joint or link that it names; files relative to ``root`` where they lie below it."""
    results = [result for record in records for result in results_of(record, root)]
    guides = {mode.value: guide for mode, guide in failure_guide().items()}
    rules = [rule(name, guides.get(name)) for name in dict.fromkeys(item["ruleId"] for item in results)]
    tool = {"name": "asset2sim", "version": version("asset2sim"), "rules": rules}
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [{"tool": {"driver": tool}, "results": results}]}


def rule(name: str, guide: Guide | None) -> dict[str, Any]:
    """A rule of the log, with cause and remedy where it is a failure mode."""
    told: dict[str, Any] = {"id": name, "shortDescription": {"text": guide.cause if guide else name.replace("_", " ")}}
    if guide is not None:
        told |= {"help": {"text": f"Remedy: {guide.remedy}"}}
    return told


def results_of(record: AssetRecord, root: Path) -> list[dict[str, Any]]:
    """One asset's results: what it failed first, then its findings that are warnings or errors of other codes."""
    file, text = source_of(record)
    place = Path(file).resolve()
    uri = (
        quote(place.relative_to(root.resolve()).as_posix()) if place.is_relative_to(root.resolve()) else place.as_uri()
    )

    def result(code: str, level: str, message: str, subject: str | None) -> dict[str, Any]:
        region = {"startLine": line_of(subject, text)}
        return {
            "ruleId": code,
            "level": level,
            "message": {"text": f"{record.ref.asset_id}: {message}"},
            "locations": [{"physicalLocation": {"artifactLocation": {"uri": uri}, "region": region}}],
            "partialFingerprints": {"asset2sim/v1": f"{record.ref.asset_id}/{code}/{subject or ''}"},
        }

    found = []
    named = {item.code: item for item in reversed(record.findings)}
    if record.status is not Status.OK:
        mode, first = record.failure_mode.value, named.get(record.failure_mode.value)
        subject = (first.joint or first.link) if first is not None else None
        mend = remedy_of(record.failure_mode)
        found.append(result(mode, "error", f"{record.reason}{f'. Remedy: {mend}' if mend else ''}", subject))
    for item in record.findings:
        if item.severity in LEVELS and item.code != record.failure_mode.value:
            found.append(result(item.code, LEVELS[item.severity], item.message, item.joint or item.link))
    return found


def source_of(record: AssetRecord) -> tuple[str, str]:
    """The file that describes an asset, and its text; the asset's place and nothing where there is none to be read."""
    try:
        file = find_source(Path(record.ref.path))
        return str(file), read_regular(file, MOST_BYTES).decode("utf-8", "replace")
    except (AssetError, OSError):
        return record.ref.path, ""


def line_of(name: str | None, text: str) -> int:
    """The line, from 1 on, on which an element of this name begins; 1 where there is none, or no name."""
    found = re.search(rf"""name\s*=\s*["']{re.escape(name)}["']""", text) if name else None
    return 1 if found is None else text.count("\n", 0, found.start()) + 1
