"""The content hash: one value for everything that an asset's result depends on."""

import hashlib
import json
from collections.abc import Mapping

from asset2sim.checks.alignment.reference import Reference
from asset2sim.incremental.code import package_versions, source_version
from schemas.asset import AssetRef
from schemas.settings import Settings

IRRELEVANT: Mapping[str, set[str] | bool] = {
    "run": True,
    # The pictures that a model sees depend on their size; those beside the asset are looked for.
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
"""Settings that steer how a run goes, not what comes of an asset. What they made fail is tried again in any case."""


def shared_hash(settings: Settings, pipeline: str) -> str:
    """SHA-256 over what all assets of a run depend on: settings, sources, packages and the pipeline's name."""
    material = [
        pipeline,
        settings.model_dump_json(exclude=IRRELEVANT),
        source_version(),
        package_versions(settings.engine),
    ]
    return hashlib.sha256(json.dumps(material, sort_keys=True).encode()).hexdigest()


def content_hash(ref: AssetRef, files: str, shared: str, reference: Reference | None) -> str:
    """SHA-256 over an asset's row of the manifest, the digest of its files, what the run's assets share, and the
    expert's choice that its alignment is held against; 64 hex digits."""
    material = [ref.model_dump(mode="json", exclude={"path"}), files, shared, repr(reference)]
    return hashlib.sha256(json.dumps(material, sort_keys=True).encode()).hexdigest()
