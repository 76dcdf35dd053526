"""An object's visuals as one painted surface per link and paint, in the link's frame at the final scale; for MuJoCo, an
OBJ file for each, and textures as PNG."""

import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element
from PIL import Image

from asset2sim.assets.exports.refined_object import ExportObject
from asset2sim.assets.surfaces.scene import painted_shapes
from asset2sim.assets.surfaces.surface import PLAIN, Paint, Surface, Texture

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
    """Surfaces of one paint as one, without degenerate triangles, unused vertices and normals, which readers make anew;
    None where nothing is left. Texture coordinates are kept only for a paint with a texture."""
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


FOLDER = "mjcf"
"""Where the files lie, beside the MJCF."""
TEXTURE_SIDE = 512
"""Textures are shrunk to this many pixels on their longer side: PNG holds a photograph in ten times a JPEG's bytes."""


def write_looks(looks: Sequence[Look], folder: Path, assets: Element) -> dict[str, list[dict[str, str]]]:
    """Write the files of these looks under ``mjcf/``, replacing what was there, and name them in ``assets``. Link → the
    attributes (``mesh`` and ``material``) of its visual geoms, whose frames are the link's. A texture that cannot be
    decoded is left out: its surface keeps its colour."""
    shutil.rmtree(folder / FOLDER, ignore_errors=True)
    if not looks:
        return {}
    (folder / FOLDER).mkdir()
    textures: dict[Texture, str | None] = {}
    materials: dict[Paint, str] = {}
    geoms: dict[str, list[dict[str, str]]] = {}
    for number, look in enumerate(looks):
        if look.paint not in materials:
            materials[look.paint] = write_material(look.paint, len(materials), folder, assets, textures)
        stem = f"{re.sub(r'[^A-Za-z0-9_-]', '_', look.link)[:60]}_{number}"
        file = f"{FOLDER}/{stem}.obj"
        (folder / file).write_text(obj_text(look.surface), encoding="ascii")
        name = f"look_{number}"
        # A shell: visuals are sheets as often as not, and a sheet has no volume for MuJoCo to compute.
        etree.SubElement(assets, "mesh", name=name, file=file, inertia="shell")
        geoms.setdefault(look.link, []).append({"mesh": name, "material": materials[look.paint]})
    return geoms


def write_material(
    paint: Paint, number: int, folder: Path, assets: Element, textures: dict[Texture, str | None]
) -> str:
    """Add one paint to ``assets`` as a material; its name."""
    name = f"paint_{number}"
    attributes = {"name": name, "rgba": " ".join(f"{value:.4g}" for value in paint.color)}
    if paint.texture is not None:
        if paint.texture not in textures:
            textures[paint.texture] = write_texture(paint.texture, len(textures), folder, assets)
        texture = textures[paint.texture]
        if texture is not None:
            attributes["texture"] = texture
    etree.SubElement(assets, "material", attributes)
    return name


def write_texture(texture: Texture, number: int, folder: Path, assets: Element) -> str | None:
    """Write one texture as PNG and add it to ``assets``; its name, or None where it cannot be decoded."""
    try:
        texture.image.draft("RGB", (TEXTURE_SIDE, TEXTURE_SIDE))  # lets a JPEG be decoded at a fraction of its size
        picture = texture.image.convert("RGB")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # what Pillow raises on a bad picture
        return None
    picture.thumbnail((TEXTURE_SIDE, TEXTURE_SIDE), Image.Resampling.BOX)
    file, name = f"{FOLDER}/texture_{number}.png", f"texture_{number}"
    picture.save(folder / file)
    etree.SubElement(assets, "texture", name=name, type="2d", file=file)
    return name


def obj_text(surface: Surface) -> str:
    """A surface as OBJ, with texture coordinates where it has them."""
    lines = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in surface.vertices]
    corners = surface.faces + 1
    if surface.uv is None:
        lines += [f"f {a} {b} {c}" for a, b, c in corners]
    else:
        lines += [f"vt {u:.5g} {v:.5g}" for u, v in surface.uv]
        lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in np.asarray(corners)]
    return "\n".join(lines) + "\n"
