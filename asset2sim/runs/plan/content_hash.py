"""The version of the code that makes an asset's result: our sources, and the packages that they compute with."""

import functools
import hashlib
import json
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

from asset2sim.checks.alignment.reference import Reference
from asset2sim.engines.registry import installed
from schemas.asset import AssetRef
from schemas.settings import EngineSettings, Settings
from schemas.vocabulary import Engine

IRRELEVANT_SOURCES = (
    # The command line, the spreading of work, and reports.
    "asset2sim/cli",
    "asset2sim/runs/spread/harvest.py",
    "asset2sim/runs/spread/cluster.py",
    "asset2sim/runs/spread/job.py",
    "asset2sim/runs/spread/existing_cluster.py",
    "asset2sim/runs/spread/harvest.py",
    "asset2sim/runs/interrupt.py",
    "asset2sim/runs/spread/job.py",
    "asset2sim/runs/spread/worker.py",
    "asset2sim/runs/spread/job.py",
    "asset2sim/runs/spread/refine_all.py",
    "asset2sim/runs/spread/progress.py",
    "asset2sim/runs/spread/refine_all.py",
    "asset2sim/runs/spread/spread.py",
    "asset2sim/incremental",
    "asset2sim/runs/plan/url_files.py",
    "asset2sim/catalog/storage/listing.py",
    "asset2sim/catalog/storage/lock_url.py",
    "asset2sim/catalog/read_remote.py",
    "asset2sim/runs/remote/output.py",
    "asset2sim/catalog/read_remote.py",
    "asset2sim/runs/remote/output.py",
    "asset2sim/catalog/storage/tree.py",
    "asset2sim/reports",
    "asset2sim/runs/check_request.py",
    "asset2sim/runs/dataset.py",
    "asset2sim/runs/doctor.py",
    "asset2sim/programs.py",
    "asset2sim/studies/readme/summary.py",
    "asset2sim/runs/result.py",
    "asset2sim/studies/readme/picture.py",
    "asset2sim/catalog/storage/tree.py",
    "asset2sim/ui.py",
    # Studies: comparisons, the independent checker, timings, planted defects.
    "asset2sim/bench",
    "asset2sim/compare",
    "asset2sim/studies/rules.py",
    "asset2sim/defects",
    "asset2sim/studies/simcheck/run.py",
    "asset2sim/studies/simcheck/report.py",
    "asset2sim/samples",
    "schemas/tables_compare.py",
    "schemas/tables.py",
)
"""Sources that no asset's result depends on. All others count, so a new source causes too much to be refined again,
never too little."""
ROWS = ("rows.py", "engine_rows.py", "alignment_rows.py")
"""The only catalog sources that count: those that make an asset's rows."""
PACKAGES = ("coacd", "lxml", "numpy", "pillow", "pycollada", "python-fcl", "scipy", "trimesh", "usd-core")
"""Packages, beside the engines, whose version may change a number."""


def counts(source: str) -> bool:
    """Whether the source at this path, relative to the checkout, may change an asset's result or its rows."""
    if source.startswith("asset2sim/catalog/"):
        return source.rpartition("/")[2] in ROWS
    return not any(source == place or source.startswith(f"{place}/") for place in IRRELEVANT_SOURCES)


@functools.cache
def source_version() -> str:
    """SHA-256 over the names and contents of all sources that count; computed once a process."""
    root = Path(__file__).resolve().parents[3]
    digest = hashlib.sha256()
    for package in ("schemas", "asset2sim"):
        for path in sorted((root / package).rglob("*.py")):
            name = path.relative_to(root).as_posix()
            if counts(name):
                digest.update(f"{name}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()


def package_versions(settings: EngineSettings) -> dict[str, str]:
    """Package → installed version: ``PACKAGES``, PyBullet, which refines, and the engines that verify."""
    engines = settings.verify if settings.verify is not None else installed()
    found = {}
    for name in (*PACKAGES, *sorted({Engine.PYBULLET.value, *(engine.value for engine in engines)})):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


IRRELEVANT_SETTINGS: Mapping[str, set[str] | bool] = {
    "run": True,
    # Picture size counts, since a model sees them; whether they are written is read from the folder.
    "views": {"write"},
    "model": {
        "timeout_s",
        "max_attempts",
        "cache",
        "requests_per_minute",
        "concurrent_requests",
        "run_calls",
        "run_tokens",
        "run_usd",
    },
}
"""Settings that affect a run, not an asset's result. Assets that fail because of them are tried again anyway."""


def shared_hash(settings: Settings, pipeline: str) -> str:
    """SHA-256 over what all assets of a run depend on: settings, sources, packages and the pipeline's name."""
    material = [
        pipeline,
        settings.model_dump_json(exclude=IRRELEVANT_SETTINGS),
        source_version(),
        package_versions(settings.engine),
    ]
    return hashlib.sha256(json.dumps(material, sort_keys=True).encode()).hexdigest()


def content_hash(ref: AssetRef, files: str, shared: str, reference: Reference | None) -> str:
    """SHA-256 over an asset's row of the manifest, the digest of its files, what the run's assets share, and the
    expert's choice that its alignment is held against; 64 hex digits."""
    material = [ref.model_dump(mode="json", exclude={"path"}), files, shared, repr(reference)]
    return hashlib.sha256(json.dumps(material, sort_keys=True).encode()).hexdigest()
