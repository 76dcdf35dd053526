"""Collision pieces kept on disk by what they were made from; many processes may share the folder."""

import hashlib
import json
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import scipy

from asset2sim.collision.hulls import Hulls
from asset2sim.extraction import Extraction
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
    try:
        with np.load(path, allow_pickle=False) as stored:
            points, ends, text = stored["points"], stored["ends"], stored["text"].tobytes()
        said = json.loads(text)
        clouds = np.split(np.asarray(points, dtype=np.float64), ends[:-1]) if len(ends) else []
        hulls: Hulls = {}
        for link, count in said["links"]:
            hulls[link], clouds = tuple(clouds[:count]), clouds[count:]
        return hulls, tuple(Finding.model_validate(finding) for finding in said["findings"])
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        return None


def write(path: Path, hulls: Hulls, findings: tuple[Finding, ...]) -> None:
    """Write beside the file and rename: readers see all of it or nothing. A cache that cannot be written is no loss."""
    clouds = [piece for pieces in hulls.values() for piece in pieces]
    said = {
        "links": [[link, len(pieces)] for link, pieces in hulls.items()],
        "findings": [finding.model_dump(mode="json") for finding in findings],
    }
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, suffix=".part")
    except OSError:
        return
    try:
        with os.fdopen(handle, "wb") as stream:
            np.savez(
                stream,
                points=np.vstack([np.zeros((0, 3)), *clouds]),
                ends=np.cumsum([len(cloud) for cloud in clouds], dtype=np.int64),
                text=np.frombuffer(json.dumps(said).encode(), dtype=np.uint8),
            )
        os.replace(name, path)
    except OSError:
        Path(name).unlink(missing_ok=True)
