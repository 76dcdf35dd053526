"""Checked assets as SARIF 2.1.0, which GitHub shows beside the lines of the files."""

import re
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any
from urllib.parse import quote

from asset2sim.checks.known_checks import failure_guide
from asset2sim.intake.locate import find_source
from asset2sim.runs.check_folders import remedy_of
from asset2sim.storage.regular_files import read_regular
from schemas.asset import AssetRecord
from schemas.errors import AssetError
from schemas.failure_guide import Guide
from schemas.vocabulary import Severity, Status

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
