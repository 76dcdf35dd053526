"""Disk cache of an asset's mesh shapes, keyed by file content: an unchanged mesh is not parsed again."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import trimesh

from asset2sim.assets.meshes.array_file import read_clouds, write_clouds
from asset2sim.assets.meshes.volume import Shape, SheetSurface, Solid
from asset2sim.physics.arrays import Array
from schemas.vocabulary import VolumeSource

FORMAT = f"5 trimesh {trimesh.__version__} scipy {scipy.__version__}"
"""Format of the cache file; others are not read. Raise the number when the same mesh gives another shape."""


@dataclass(frozen=True)
class CachedMesh:
    """One mesh file at one scale: its shape, whether it has large holes, and whether it is closed but inside out, and
    how many triangles far away from the others were left out."""

    shape: Shape
    holed: bool
    inside_out: bool
    strays: int = 0


def mesh_key(content: str | None, scale: Array) -> str | None:
    """Cache key of a mesh: its file's ``file_key`` and the (3,) scale; None where ``content`` is None."""
    return None if content is None else f"{content} {scale.tolist()}"


def read_shapes(path: Path) -> dict[str, CachedMesh]:
    """The cached meshes by key; empty where the file is missing or damaged."""
    stored = read_clouds(path)
    if stored is None:
        return {}
    clouds, said = stored
    known: dict[str, CachedMesh] = {}
    try:
        if said["format"] != FORMAT:
            return {}
        for key, item in said["meshes"]:
            own, clouds = clouds[: 1 + item["pieces"]], clouds[1 + item["pieces"] :]
            known[key] = _mesh(own, item)
    except (KeyError, TypeError, ValueError, IndexError):
        return {}
    return known


def write_shapes(path: Path, known: dict[str, CachedMesh]) -> None:
    """Replace the cached meshes by these."""
    clouds = [cloud for mesh in known.values() for cloud in (mesh.shape.points, *mesh.shape.pieces)]
    write_clouds(path, clouds, {"format": FORMAT, "meshes": [[key, _said(mesh)] for key, mesh in known.items()]})


def _said(mesh: CachedMesh) -> dict[str, object]:
    shape = mesh.shape
    return {
        "pieces": len(shape.pieces),
        "volume": shape.solid.volume,
        "center": shape.solid.center.tolist(),
        "inertia": shape.solid.inertia.tolist(),
        "source": shape.source.value,
        "area": shape.area,
        "surface": {
            "area": shape.surface.area,
            "opening": shape.surface.opening,
            "center": shape.surface.center.tolist(),
            "inertia": shape.surface.inertia.tolist(),
        },
        "watertight": shape.watertight,
        "n_faces": shape.n_faces,
        "exact": shape.exact,
        "holed": mesh.holed,
        "inside_out": mesh.inside_out,
        "strays": mesh.strays,
    }


def _mesh(clouds: list[Array], item: dict[str, Any]) -> CachedMesh:
    points, *pieces = clouds
    drawn = item["surface"]
    shape = Shape(
        Solid(float(str(item["volume"])), np.array(item["center"]), np.array(item["inertia"])),
        VolumeSource(str(item["source"])),
        points,
        tuple(pieces),
        float(str(item["area"])),
        SheetSurface(
            float(drawn["area"]), float(drawn["opening"]), np.array(drawn["center"]), np.array(drawn["inertia"])
        ),
        bool(item["watertight"]),
        int(str(item["n_faces"])),
        bool(item["exact"]),
    )
    return CachedMesh(shape, bool(item["holed"]), bool(item["inside_out"]), int(str(item["strays"])))


SHAPE_CACHE = ".cache/shapes"
"""Shapes and triangles of meshes that were parsed before."""
PIECE_CACHE = ".cache/pieces"
"""Convex pieces, shared by all assets and runs."""
