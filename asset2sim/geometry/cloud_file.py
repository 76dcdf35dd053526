"""Point clouds and what is said of them in one file, without pickling; many processes may share its folder."""

import json
import os
import tempfile
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from asset2sim.arrays import Array


def read_clouds(path: Path) -> tuple[list[Array], Any] | None:
    """The (n, 3) clouds and the JSON value that were written there, or None where there is nothing sound."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            points, ends, text = stored["points"], stored["ends"], stored["text"].tobytes()
        said = json.loads(text)
        return (np.split(np.asarray(points, dtype=np.float64), ends[:-1]) if len(ends) else []), said
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        return None


def write_clouds(path: Path, clouds: Sequence[Array], said: object = None) -> None:
    """Write beside the file and rename: readers see all of it or nothing. A cache that cannot be written is no loss."""
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
