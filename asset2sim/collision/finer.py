"""Convex decomposition of the links whose hulls reach deep into others, so that what is hollow is not filled."""

from pathlib import Path

import numpy as np

from asset2sim.arrays import Array
from asset2sim.collision.hulls import outermost, simplified
from asset2sim.extraction import Extraction
from asset2sim.extraction.links import MeshPart
from asset2sim.geometry.decompose import DecomposeSettings, decompose
from asset2sim.geometry.load import load_mesh

SETTINGS = DecomposeSettings(cpu_limit_s=8.0)
"""One mesh may take a fifth of what a whole asset usually may: pieces are wanted only where cutting hulls costs
much."""
SMALL_SHARE = 0.2
"""Longest extent of a mesh, over its link's, below which it is left whole: its hollow matters to nobody."""
MOST_HULLS = 64
"""Hulls of one link beyond which nothing more is decomposed: contacts get slower with each."""


def finer_hulls(extraction: Extraction, link: str, scale: float, cache: Path) -> tuple[Array, ...] | None:
    """The link's hulls with its large concave meshes decomposed, (k, 3) points in its frame at the final scale.

    None where decomposition changes nothing. ``cache`` holds pieces by mesh content.
    """
    geometry = extraction.geometry[link]
    extent = float(np.ptp(geometry.points, axis=0).max())
    pieces: list[Array] = []
    changed = False
    for part in geometry.parts:
        own = list(part.pieces)
        large = len(own) == 1 and float(np.ptp(own[0], axis=0).max()) >= SMALL_SHARE * extent
        if large and len(pieces) < MOST_HULLS:
            found = decomposed(extraction, part, cache)
            if found is not None and len(found) > 1:
                own, changed = list(found), True
        pieces.extend(simplified(piece) * scale for piece in own)
    return outermost(pieces) if changed else None


def decomposed(extraction: Extraction, part: MeshPart, cache: Path) -> tuple[Array, ...] | None:
    """One mesh's convex pieces in the link's frame at the authored scale, or None."""
    file = extraction.mesh_files[part.reference]
    if file is None:
        return None
    mesh = load_mesh(file)
    found = decompose(np.asarray(mesh.vertices) * part.scale, np.asarray(mesh.faces), SETTINGS, cache)
    if found is None:
        return None
    return tuple(piece @ part.rotation.T + part.translation for piece in found)
