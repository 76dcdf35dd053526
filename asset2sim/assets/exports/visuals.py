"""An object's visuals as one painted surface per link and paint, in the link's frame at the final scale."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asset2sim.assets.exports.refined_object import ExportObject
from asset2sim.assets.surfaces.scene import painted_shapes
from asset2sim.assets.surfaces.surface import PLAIN, Paint, Surface

LEAST_AREA_M2 = 1e-12
"""Area below which a surface is left out, m²: engines refuse meshes without an area."""

LEAST_VERTICES = 4
"""MuJoCo refuses meshes with fewer."""


@dataclass(frozen=True, eq=False)
class Look:
    """A link's triangles of one paint, in the link's frame, m."""

    link: str
    surface: Surface
    paint: Paint


def looks_of(item: ExportObject) -> tuple[Look, ...]:
    """The looks of every link, from its URDF's visuals. Meshes that are missing or unreadable are left out."""
    loaded: dict[Path, tuple[Surface, ...]] = {}
    looks: list[Look] = []
    for link in item.robot.links:
        by_paint: dict[Paint, list[Surface]] = {}
        for shape in painted_shapes(item.robot, link, "visuals", item.folder, loaded):
            for surface in shape:
                by_paint.setdefault(surface.paint or Paint(PLAIN), []).append(surface)
        for paint, parts in by_paint.items():
            whole = merged_surface(parts, paint)
            if whole is not None:
                looks.append(Look(str(link.name), whole, paint))
    return tuple(looks)


def merged_surface(parts: list[Surface], paint: Paint) -> Surface | None:
    """Surfaces of one paint as one, degenerate triangles and unused vertices dropped; None where nothing is left.
    Texture coordinates are kept only for a paint with a texture; normals are dropped, since what reads the export makes
    its own."""
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    vertices = np.concatenate([part.vertices for part in parts])
    faces = np.concatenate([part.faces + offset for part, offset in zip(parts, offsets, strict=True)])
    uvs = [part.uv for part in parts if part.uv is not None]
    uv = np.concatenate(uvs) if paint.texture is not None and len(uvs) == len(parts) else None
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    if area.sum() / 2.0 < LEAST_AREA_M2:
        return None
    faces = faces[area > 0.0]
    used, renumbered = np.unique(faces, return_inverse=True)
    surface = Surface(vertices[used], renumbered.reshape(-1, 3), None, None if uv is None else uv[used], paint)
    return surface if len(used) >= LEAST_VERTICES else split_triangle(surface)


def split_triangle(surface: Surface) -> Surface:
    """A single triangle as three that meet in its middle."""
    vertices = np.vstack([surface.vertices, surface.vertices.mean(axis=0)])
    uv = None if surface.uv is None else np.vstack([surface.uv, surface.uv.mean(axis=0)])
    faces = np.vstack(
        [np.column_stack([surface.faces[:, [i, (i + 1) % 3]], np.full(len(surface.faces), 3)]) for i in range(3)]
    )
    return Surface(vertices, faces, surface.normals, uv, surface.paint)
