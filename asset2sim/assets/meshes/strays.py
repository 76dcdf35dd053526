"""Triangles that a broken export left far away from the rest of a mesh."""

import numpy as np

from asset2sim.physics.arrays import Array, Faces

FAR = 100.0
"""Distance of a few triangles from the rest, over its size, from which they are no part of the object: nothing could
hold parts that lie a hundred of their sizes apart."""
LEAST_M = 1e-9
"""Size, m, below which the rest counts for nothing."""


def without_strays(mesh: tuple[Array, Faces]) -> tuple[tuple[Array, Faces], int]:
    """The (n, 3) vertices and (k, 3) faces of a mesh without triangles that are not joined to the rest, fewer than it
    has, and ``FAR`` from it; and how many there were."""
    vertices, faces = mesh
    count, kept = len(faces), faces
    apart = np.abs(vertices - np.median(vertices, axis=0)).max(axis=1)
    if apart.max() < FAR * np.median(apart):
        return mesh, 0
    while len(kept) > 1:
        # The farthest from the middle of most vertices, and all that is nearly as far.
        apart = np.abs(vertices - np.median(vertices[np.unique(kept)], axis=0)).max(axis=1)
        far = apart[kept] > 0.5 * apart[kept].max()
        stray = far.all(axis=1)
        if np.any(far.any(axis=1) != stray) or not 0 < stray.sum() < 0.5 * len(kept):
            break
        rest, lost = vertices[np.unique(kept[~stray])], vertices[np.unique(kept[stray])]
        size = max(float(np.ptp(rest, axis=0).max()), LEAST_M)
        gap = float(np.maximum(lost - rest.max(axis=0), rest.min(axis=0) - lost).max(axis=1).min())
        if gap < FAR * size:
            break
        kept = kept[~stray]
    if len(kept) == count:
        return mesh, 0
    used, numbers = np.unique(kept, return_inverse=True)
    return (vertices[used], numbers.reshape(kept.shape)), count - len(kept)
