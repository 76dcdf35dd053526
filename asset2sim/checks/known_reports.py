"""Engines' reports on one asset by all that they depend on: what is as before is not simulated again.

Within a run, shapes and states are tried and reverted, so the same files come up repeatedly. From run to run, reports
are kept beside the caches of meshes, so that an object of which a new release changes nothing costs its hash.
"""

import hashlib
import json
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from pydantic import ValidationError

import asset2sim.checks
from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import Folder
from asset2sim.assets.meshes.array_file import read_arrays, write_arrays
from asset2sim.checks.declared_check import known_checks
from asset2sim.checks.verify import cause_for, verify
from asset2sim.engines.registry import OWN, engine_version, versions_of
from schemas.interaction import EngineReport
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.source_code import code_digest
from schemas.vocabulary import DECIDING_PACKAGES, Engine, FailureMode

REPORT_CACHE = ".cache/reports"
"""The reports of an earlier run, a file an asset."""
ROOMS = ("asset2sim/assets", "asset2sim/checks", "asset2sim/engines", "asset2sim/physics", "schemas")
"""Rooms whose sources decide what an engine reports of a written folder."""


@dataclass
class KnownReports:
    """Reports of one asset, with an earlier run's in ``file``; the wall time that engines took for new ones, s."""

    file: Path | None = None
    reports: dict[str, EngineReport] = field(default_factory=dict)
    seconds: float = 0.0
    earlier: dict[str, object] | None = None

    def get(self, key: str) -> EngineReport | None:
        """The report of this key, from this run or an earlier one."""
        if key not in self.reports and (kept := self._earlier().get(key)) is not None:
            try:
                self.reports[key] = EngineReport.model_validate(kept)
            except ValidationError:
                return None
        return self.reports.get(key)

    def _earlier(self) -> dict[str, object]:
        if self.earlier is None:
            stored = None if self.file is None or not comparable() else read_arrays(self.file, ("reports",))
            self.earlier = {} if stored is None else json.loads(zlib.decompress(stored[0]["reports"].tobytes()))
        return self.earlier

    def keep(self) -> None:
        """Write the reports of this run in the place of those of an earlier one."""
        if self.file is None or not comparable() or self.reports.keys() == self._earlier().keys():
            return
        said = json.dumps({key: report.model_dump(mode="json") for key, report in self.reports.items()})
        write_arrays(self.file, {"reports": np.frombuffer(zlib.compress(said.encode()), dtype=np.uint8)})


def verify_known(
    known: KnownReports,
    engines: Sequence[Engine],
    folder: Folder,
    overlay: PhysicsOverlay,
    extraction: Extraction,
    settings: Settings,
    only: FailureMode | None = None,
) -> tuple[EngineReport, ...]:
    """As ``verify``, but reports that are in ``known`` are taken from there, and new ones are added to it. An engine
    with a problem is run again: the machine may have been at fault."""
    whole = digest(folder, overlay, extraction, settings)
    keys = {engine: f"{engine.value} {engine_version(engine)} {only or 'all'} {whole}" for engine in engines}
    found = {engine: report for engine, key in keys.items() if (report := known.get(key)) is not None}
    left, cause = [engine for engine in engines if engine not in found], cause_for(extraction, overlay)
    for report in verify(left, folder.urdf, overlay, cause, settings, only):
        found[report.engine] = report
        known.seconds += report.seconds
        if report.problem is None:
            known.reports[keys[report.engine]] = report
    return tuple(found[engine] for engine in engines)


def digest(folder: Folder, overlay: PhysicsOverlay, extraction: Extraction, settings: Settings) -> str:
    """SHA-256 over what decides a report beside the engine: the URDF, the collision meshes made for it, the overlay,
    the authored files (an overlap of which may be theirs), the settings, and the code."""
    whole = hashlib.sha256(overlay.model_dump_json().encode())
    whole.update(folder.urdf.read_bytes())
    for files in folder.collision.values():
        for file in (item for item in files if isinstance(item, str)):
            whole.update(hashlib.sha256((folder.path / file).read_bytes()).digest())
    stated = settings.engine.model_dump_json(exclude={"verify", "decide", "time_limit_s"})
    for text in (extraction.features.content_hash, stated, settings.thresholds.model_dump_json(), sources()):
        whole.update(text.encode() + b"\0")
    return whole.hexdigest()


@cache
def sources() -> str:
    """Hash of the sources of ``ROOMS``, and versions of the packages that decide numbers; once a process, 10 ms."""
    root = Path(asset2sim.checks.__file__).parents[2]
    files = {file.relative_to(root).as_posix(): file for room in ROOMS for file in (root / room).rglob("*.py")}
    return json.dumps(versions_of(DECIDING_PACKAGES)) + code_digest(files, prose=True)


@cache
def comparable() -> bool:
    """Whether all checks and engines are of this package: the code of others is not in the key."""
    functions = (function for check in known_checks() for function in (check.measure, check.judge) if function)
    return set(Engine) <= set(OWN) and all(item.__module__.startswith("asset2sim.") for item in functions)
