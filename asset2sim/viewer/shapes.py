"""Shapes of a URDF for the page, in its links' frames: looks and pieces as GLB, centres of mass, boxes."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np
import trimesh
import yourdfpy
from PIL import Image
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from asset2sim.assets.exports.visuals import merged_surface
from asset2sim.assets.surfaces.scene import painted_shapes
from asset2sim.assets.surfaces.surface import Paint, Surface
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.physics.arrays import Array, corners_of_box

Part = TypeVar("Part")

TEXTURE_SIDE = 1024
"""Longer side to which a texture is shrunk, pixels."""
GHOST_ALPHA = 0.15
"""Opacity of looks through which something inside is shown."""
PIECE_ALPHA = 0.7
"""Opacity of a collision piece."""
PIECE_COLORS = ((228, 87, 86), (76, 120, 168), (84, 162, 75), (238, 202, 59), (178, 121, 162), (114, 183, 178),
                (255, 157, 166), (157, 117, 93))  # fmt: skip
"""Colours of collision pieces, in turn."""


@dataclass(frozen=True, eq=False)
class Inertial:
    """A link's mass (kg), (3,) centre of mass, and the box of its mass and inertia: a (4, 4) pose and (3,) edges, m."""

    mass_kg: float
    center: Array
    box_to_link: Array
    edges: Array


@dataclass(frozen=True, eq=False)
class UrdfShapes:
    """By link: surfaces as they are seen, and those of each collision piece; inertials; corners of the box of what is
    seen, (8, 3). A link without one of these is not in it."""

    seen: dict[str, list[Surface]]
    hulls: dict[str, list[list[Surface]]]
    inertials: dict[str, Inertial]
    corners: dict[str, Array]
    links: tuple[str, ...]

    @cached_property
    def looks(self) -> dict[str, bytes]:
        """GLB of what is seen."""
        return _glbs(self.seen, lambda parts: painted_meshes(parts, 1.0))

    @cached_property
    def ghosts(self) -> dict[str, bytes]:
        """The same, see-through."""
        return _glbs(self.seen, lambda parts: painted_meshes(parts, GHOST_ALPHA))

    @cached_property
    def pieces(self) -> dict[str, bytes]:
        """GLB of the collision pieces, in colours."""
        return _glbs(self.hulls, coloured_pieces)


def shapes_of(urdf: Path, scale: float = 1.0) -> UrdfShapes:
    """The shapes of a URDF, ``scale`` times as large, of links' visuals, or collision shapes where none has any,
    without meshes that cannot be read. Raises AssetError for a URDF that cannot be read."""
    robot = read_urdf(urdf)
    names = tuple(str(link.name) for link in robot.links)
    loaded: dict[Path, tuple[Surface, ...]] = {}
    role = "visuals" if any(link.visuals for link in robot.links) else "collisions"
    drawn, hulls = (
        {str(link.name): painted_shapes(robot, link, of, urdf.parent, loaded, scale=scale) for link in robot.links}
        for of in (role, "collisions")
    )
    seen = {name: [surface for shape in shapes for surface in shape] for name, shapes in drawn.items()}
    return UrdfShapes(
        seen=seen,
        hulls=hulls,
        inertials={
            str(link.name): inertial_of(link.inertial, scale)
            for link in robot.links
            if link.inertial is not None and link.inertial.inertia is not None and link.inertial.mass
        },
        corners={
            name: corners_of_box(np.concatenate([part.vertices for part in parts]))
            for name, parts in seen.items()
            if parts
        },
        links=names,
    )


def painted_meshes(parts: list[Surface], opacity: float) -> list[trimesh.Trimesh]:
    """A mesh for every paint of the surfaces, ``opacity`` times as opaque."""
    by_paint: dict[Paint | None, list[Surface]] = {}
    for part in parts:
        by_paint.setdefault(part.paint, []).append(part)
    found = []
    for paint, same in by_paint.items():
        paint = paint or Paint((0.72, 0.72, 0.74, 1.0))
        whole = merged_surface(same, paint)
        if whole is not None:
            found.append(_mesh(whole, paint, opacity))
    return found


def _mesh(surface: Surface, paint: Paint, opacity: float) -> trimesh.Trimesh:
    image = None
    if surface.uv is not None and paint.texture is not None:
        image = readable(paint.texture.image)
    alpha = paint.color[3] * opacity
    clear = alpha < 1.0 or (image is not None and image.mode == "RGBA")
    material = PBRMaterial(
        baseColorFactor=[*paint.color[:3], alpha],
        baseColorTexture=image,
        metallicFactor=0.0,
        roughnessFactor=0.7,
        doubleSided=True,
        alphaMode="BLEND" if clear else "OPAQUE",
    )
    visual = TextureVisuals(uv=surface.uv if image is not None else None, material=material)
    return trimesh.Trimesh(surface.vertices, surface.faces, visual=visual, process=False)


def readable(image: Image.Image) -> Image.Image | None:
    """The picture, decoded and shrunk; None where it cannot be decoded."""
    try:
        whole = image.convert("RGBA" if image.mode in ("RGBA", "LA", "PA") else "RGB")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # what Pillow raises on a bad picture
        return None
    whole.thumbnail((TEXTURE_SIDE, TEXTURE_SIDE))
    if whole.mode == "RGB":
        # trimesh writes a picture as its format says, and PNG takes ten times as long.
        whole.format = "JPEG"
    return whole


def coloured_pieces(shapes: list[list[Surface]]) -> list[trimesh.Trimesh]:
    """A mesh for each of the ``PIECE_COLORS``, of the shapes that have it in turn."""
    found = []
    for number, color in enumerate(PIECE_COLORS):
        parts = [part for shape in shapes[number :: len(PIECE_COLORS)] for part in shape]
        paint = Paint((color[0] / 255, color[1] / 255, color[2] / 255, 1.0))
        whole = merged_surface(parts, paint) if parts else None
        if whole is not None:
            found.append(_mesh(whole, paint, PIECE_ALPHA))
    return found


def _glbs(parts: dict[str, list[Part]], meshes: Callable[[list[Part]], list[trimesh.Trimesh]]) -> dict[str, bytes]:
    made = {name: meshes(some) for name, some in parts.items() if some}
    return {name: _glb(found) for name, found in made.items() if found}


def _glb(meshes: list[trimesh.Trimesh]) -> bytes:
    buffer = io.BytesIO()
    trimesh.Scene(meshes).export(buffer, file_type="glb")
    return buffer.getvalue()


def inertial_of(inertial: yourdfpy.Inertial, scale: float = 1.0) -> Inertial:
    """The mass, and the solid box that has this mass and these principal moments, ``scale`` times as large."""
    pose = np.eye(4) if inertial.origin is None else np.array(inertial.origin, dtype=float)
    pose[:3, 3] *= scale
    moments, axes = np.linalg.eigh(np.asarray(inertial.inertia, dtype=float))
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    edges = scale * np.sqrt(np.maximum(6.0 * (moments.sum() - 2.0 * moments) / inertial.mass, 0.0))
    box = pose.copy()
    box[:3, :3] = pose[:3, :3] @ axes
    return Inertial(float(inertial.mass), pose[:3, 3], box, edges)
