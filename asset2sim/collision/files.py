"""Writing collision hulls as OBJ files beside the URDF."""

import re
import shutil
from pathlib import Path

import numpy as np

from asset2sim.collision.hulls import Hulls
from asset2sim.geometry.hull import hull_of

FOLDER = "collision"

CollisionFiles = dict[str, tuple[str, ...]]
"""Link → paths of its hulls' files, relative to the asset's folder."""


def write_hulls(hulls: Hulls, target: Path) -> CollisionFiles:
    """Write one OBJ a hull under ``collision/``, replacing what was there; link → relative paths.

    Hulls without volume, which no engine takes, are left out.
    """
    folder = target / FOLDER
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    files: CollisionFiles = {}
    for number, (link, pieces) in enumerate(hulls.items()):
        # The number keeps names apart that differ only in characters that file names cannot hold.
        stem = f"{re.sub(r'[^A-Za-z0-9_-]', '_', link)[:60]}_{number}"
        names = []
        for index, points in enumerate(pieces):
            text = obj_text(points)
            if text is not None:
                name = f"{FOLDER}/{stem}_{index}.obj"
                (target / name).write_text(text, encoding="ascii")
                names.append(name)
        files[link] = tuple(names)
    return files


def obj_text(points: np.ndarray) -> str | None:
    """The OBJ of the hull of (n, 3) points with outward triangles, or None where it has no volume."""
    hull = hull_of(points)
    if hull is None:
        return None
    vertices, inverse = np.unique(hull.triangles.reshape(-1, 3), axis=0, return_inverse=True)
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in inverse.reshape(-1, 3)]
    return "\n".join(lines) + "\n"
