"""Point clouds and what is said of them in one file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from asset2sim.geometry.array_file import read_arrays, write_arrays
from asset2sim.physics.arrays import Array


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
    """Keep the (n, 3) clouds as ``write_arrays`` does."""
    arrays = {
        "points": np.vstack([np.zeros((0, 3)), *clouds]),
        "ends": np.cumsum([len(cloud) for cloud in clouds], dtype=np.int64),
    }
    write_arrays(path, arrays, said)
