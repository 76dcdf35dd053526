"""The points of a mesh file, read without all that a mesh is."""

from pathlib import Path

import numpy as np

from asset2sim.geometry.load import load_mesh
from asset2sim.physics.arrays import Array


def mesh_points(file: Path) -> Array:
    """(n, 3) vertices that the file's faces use.

    An OBJ is read here, ten times faster than as a mesh; whatever is unusual in it, and any other format, goes the long
    way. Raises ValueError, naming the file, where it cannot be read or holds no triangle.
    """
    if file.suffix.lower() == ".obj":
        points = obj_points(file.read_bytes())
        if points is not None:
            return points
    return np.asarray(load_mesh(file).vertices, dtype=float)


def obj_points(content: bytes) -> Array | None:
    """The vertices that an OBJ's faces use; None where it has none, or numbers them in another way than from 1 on."""
    vertices: list[list[bytes]] = []
    used: set[bytes] = set()
    for line in content.splitlines():
        words = line.split()
        if not words:
            continue
        if words[0] == b"v":
            vertices.append(words[1:4])
        elif words[0] == b"f":
            used.update(word.split(b"/", 1)[0] for word in words[1:])
    try:
        numbers = np.array(sorted(int(word) for word in used), dtype=int) - 1
        points = np.array(vertices, dtype=float)
    except ValueError:
        return None
    if not len(numbers) or numbers[0] < 0 or numbers[-1] >= len(points) or points.shape[1:] != (3,):
        return None
    kept: Array = points[numbers]
    return kept if np.isfinite(kept).all() else None
