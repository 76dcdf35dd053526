"""Collision pieces kept on disk by what they were made from; many processes may share the folder."""

import hashlib
from pathlib import Path

import scipy

from asset2sim.assets.extract import Extraction
from asset2sim.assets.hulls import Hulls
from asset2sim.assets.meshes.array_file import read_clouds, write_clouds
from schemas.finding import Finding
from schemas.settings import CollisionSettings

FORMAT = "1"
"""Part of every cache key: raise it when the same input gives other pieces."""


def content_key(extraction: Extraction, scale: float, settings: CollisionSettings) -> str:
    """A hash of everything that decides the pieces: files, scale, settings and the hull library's version."""
    digest = hashlib.sha256()
    for part in (FORMAT, scipy.__version__, extraction.features.content_hash, repr(scale), settings.model_dump_json()):
        digest.update(part.encode() + b"\0")
    return digest.hexdigest()[:40]


def read(path: Path) -> tuple[Hulls, tuple[Finding, ...]] | None:
    """What was written there, or None where there is nothing sound."""
    stored = read_clouds(path)
    if stored is None:
        return None
    clouds, said = stored
    hulls: Hulls = {}
    try:
        for link, count in said["links"]:
            hulls[link], clouds = tuple(clouds[:count]), clouds[count:]
        return hulls, tuple(Finding.model_validate(finding) for finding in said["findings"])
    except (ValueError, KeyError, TypeError):
        return None


def write(path: Path, hulls: Hulls, findings: tuple[Finding, ...]) -> None:
    """Keep the pieces; see ``write_clouds``."""
    said = {
        "links": [[link, len(pieces)] for link, pieces in hulls.items()],
        "findings": [finding.model_dump(mode="json") for finding in findings],
    }
    write_clouds(path, [piece for pieces in hulls.values() for piece in pieces], said)
