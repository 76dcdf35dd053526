"""Named arrays and a JSON value in one file, without pickling; many processes may share its folder."""

import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asset2sim.physics.arrays import Array
from asset2sim.storage.regular_files import write_whole

TEXT = "text"
"""The name under which the JSON value is kept."""


def read_arrays(path: Path, names: tuple[str, ...]) -> tuple[dict[str, NDArray[Any]], Any] | None:
    """The arrays of these names and the JSON value that were written there, or None where there is nothing sound."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in names}, json.loads(stored[TEXT].tobytes())
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
        return None


def write_arrays(path: Path, arrays: Mapping[str, NDArray[Any]], said: object = None) -> None:
    """Write in one step. OSError is ignored: the files are caches."""
    named: dict[str, Any] = {**arrays, TEXT: np.frombuffer(json.dumps(said).encode(), dtype=np.uint8)}
    stream = io.BytesIO()
    np.savez(stream, **named)
    with suppress(OSError):
        write_whole(path, stream.getvalue())


def read_clouds(path: Path) -> tuple[list[Array], Any] | None:
    """The (n, 3) clouds and the JSON value that were written there, or None where there is nothing sound."""
    stored = read_arrays(path, ("points", "ends"))
    if stored is None:
        return None
    arrays, said = stored
    try:
        points, ends = np.asarray(arrays["points"], dtype=np.float64), arrays["ends"]
        return (np.split(points, ends[:-1]) if len(ends) else []), said
    except (ValueError, TypeError):
        return None


def write_clouds(path: Path, clouds: Sequence[Array], said: object = None) -> None:
    """Write the (n, 3) clouds and the JSON value as ``write_arrays`` does."""
    arrays = {
        "points": np.vstack([np.zeros((0, 3)), *clouds]),
        "ends": np.cumsum([len(cloud) for cloud in clouds], dtype=np.int64),
    }
    write_arrays(path, arrays, said)
