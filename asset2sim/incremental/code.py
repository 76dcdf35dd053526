"""The version of the code that makes an asset's result: our sources, and the packages that they compute with."""

import functools
import hashlib
from importlib import metadata
from pathlib import Path

from asset2sim.engines.registry import installed
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

NOT_RUN = (
    # Who asks, what spreads the work, and what tells of it.
    "asset2sim/cli",
    "asset2sim/fanout/again.py",
    "asset2sim/fanout/cluster.py",
    "asset2sim/fanout/done.py",
    "asset2sim/fanout/existing.py",
    "asset2sim/fanout/harvest.py",
    "asset2sim/fanout/interrupt.py",
    "asset2sim/fanout/job.py",
    "asset2sim/fanout/on_worker.py",
    "asset2sim/fanout/order.py",
    "asset2sim/fanout/planned.py",
    "asset2sim/fanout/progress.py",
    "asset2sim/fanout/refine.py",
    "asset2sim/fanout/spread.py",
    "asset2sim/incremental",
    "asset2sim/remote/contents.py",
    "asset2sim/catalog/storage/listing.py",
    "asset2sim/catalog/storage/lock_url.py",
    "asset2sim/catalog/read_remote.py",
    "asset2sim/remote/output.py",
    "asset2sim/catalog/read_remote.py",
    "asset2sim/remote/records.py",
    "asset2sim/catalog/storage/tree.py",
    "asset2sim/reports",
    "asset2sim/check_request.py",
    "asset2sim/dataset.py",
    "asset2sim/doctor.py",
    "asset2sim/programs.py",
    "asset2sim/readme.py",
    "asset2sim/run_result.py",
    "asset2sim/showcase.py",
    "asset2sim/catalog/storage/tree.py",
    "asset2sim/ui.py",
    # What compares, judges, times and plants.
    "asset2sim/bench",
    "asset2sim/compare",
    "asset2sim/compare_rules.py",
    "asset2sim/defects",
    "asset2sim/judge.py",
    "asset2sim/judge_report.py",
    "asset2sim/samples",
    "schemas/tables_compare.py",
    "schemas/tables.py",
)
"""Sources that no asset's result depends on. What is not listed counts, whatever is added later: too much is refined
again then, never too little."""
ROWS = ("rows.py", "engine_rows.py", "alignment_rows.py")
"""Of the catalog, only what makes an asset's rows counts."""
PACKAGES = ("coacd", "lxml", "numpy", "pillow", "pycollada", "python-fcl", "scipy", "trimesh", "usd-core")
"""Packages, beside the engines, whose version may change a number."""


def counts(source: str) -> bool:
    """Whether the source at this path, relative to the checkout, may change an asset's result or its rows."""
    if source.startswith("asset2sim/catalog/"):
        return source.rpartition("/")[2] in ROWS
    return not any(source == place or source.startswith(f"{place}/") for place in NOT_RUN)


@functools.cache
def source_version() -> str:
    """SHA-256 over the names and contents of all sources that count; computed once a process."""
    root = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for package in ("schemas", "asset2sim"):
        for path in sorted((root / package).rglob("*.py")):
            name = path.relative_to(root).as_posix()
            if counts(name):
                digest.update(f"{name}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()


def package_versions(settings: EngineSettings) -> dict[str, str]:
    """Package → version of what computes: PyBullet refines, and the engines that judge are those that are asked for."""
    engines = settings.verify if settings.verify is not None else installed()
    found = {}
    for name in (*PACKAGES, *sorted({Engine.PYBULLET.value, *(engine.value for engine in engines)})):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found
