"""Mesh files to painted surfaces: OBJ with MTL, COLLADA, glTF and STL through trimesh, one surface per material."""

import os
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image
from trimesh.exchange.obj import parse_mtl
from trimesh.resolvers import FilePathResolver
from trimesh.visual.color import ColorVisuals
from trimesh.visual.material import PBRMaterial, SimpleMaterial
from trimesh.visual.texture import TextureVisuals

from asset2sim.assets.meshes.load import load_scene
from asset2sim.assets.meshes.obj_file import ObjPart, read_obj
from asset2sim.assets.surfaces.surface import Color, Floats, Paint, Surface, Texture

COLOR_LEVELS = 16
"""Levels a channel that vertex colours are rounded to, so that a painted scan is a few surfaces and not thousands."""

PARENTS_ALLOWED = 2
"""How far above a mesh's folder its materials and textures may lie: PartNet-Mobility's are in ``../images``."""


class NearbyFiles(FilePathResolver):
    """Finds what a mesh refers to beside it or up to PARENTS_ALLOWED folders above, never elsewhere on the disk."""

    def absolute(self, name: str) -> Path:
        """The absolute path that ``name`` means; ValueError if it leads too far away."""
        # By words: pathlib takes three times as long, a fifth of what a small mesh takes.
        root = folder = os.path.realpath(self.parent)
        path = os.path.realpath(os.path.join(folder, name.strip().replace("\\", "/")))
        for _ in range(PARENTS_ALLOWED):
            root = os.path.dirname(root)
        if os.path.commonpath((root, path)) != root:
            raise ValueError(f"'{name}' is too far from {folder}")
        return Path(path)


def load_surfaces(path: Path) -> tuple[Surface, ...]:
    """A mesh file's surfaces in its own frame; () if it is unreadable or has no triangle, for a view may be partial."""
    try:
        known = read_obj(path.read_bytes()) if path.suffix.lower() == ".obj" else None
        if known is not None:
            materials = materials_of(known.library, NearbyFiles(str(path)))
            parts = [part for part in known.parts if np.isfinite(part.vertices).all()]
            return tuple(surface_of(part, materials.get(part.material), path) for part in parts)
        scene = load_scene(path, process=False, resolver=NearbyFiles(str(path)))
    except Exception:  # a loader raises whatever its format's parser raises; extraction reports the file
        return ()
    surfaces: list[Surface] = []
    for node in scene.graph.nodes_geometry:
        node_to_mesh, name = scene.graph[node]
        mesh = scene.geometry[name]
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
            surfaces.extend(split_by_paint(mesh, np.asarray(node_to_mesh, dtype=float), path))
    return tuple(surfaces)


def materials_of(library: str, resolver: NearbyFiles) -> dict[str, SimpleMaterial]:
    """The materials of an OBJ's library by name; none where it cannot be read."""
    if not library:
        return {}
    try:
        found = parse_mtl(resolver[library], resolver=resolver)
        return {name: SimpleMaterial(**values) for name, values in found.items()}
    except Exception:  # a file that is missing or broken costs its colours
        return {}


def surface_of(part: ObjPart, material: SimpleMaterial | None, path: Path) -> Surface:
    """The painted surface of a part of an OBJ."""
    uv = None if part.uv is None or not np.isfinite(part.uv).all() else part.uv
    paint = None if material is None else paint_of(material, uv is not None, path)
    return Surface(part.vertices, part.faces, part.normals, uv, paint)


def from_mesh(mesh: trimesh.Trimesh) -> Surface:
    """An unpainted surface of a generated mesh, such as a primitive."""
    return Surface(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64), None, None, None)


def split_by_paint(mesh: trimesh.Trimesh, node_to_mesh: Floats, path: Path) -> list[Surface]:
    """One surface per material, or per rounded colour where faces or vertices have their own."""
    vertices = np.asarray(mesh.vertices, dtype=float) @ node_to_mesh[:3, :3].T + node_to_mesh[:3, 3]
    if not np.isfinite(vertices).all():
        return []
    faces = np.asarray(mesh.faces, dtype=np.int64)
    normals = authored_normals(mesh, node_to_mesh)
    visual = mesh.visual
    if isinstance(visual, TextureVisuals):
        uv = None if visual.uv is None else np.asarray(visual.uv, dtype=float)
        if uv is not None and (uv.shape != (len(vertices), 2) or not np.isfinite(uv).all()):
            uv = None
        return [Surface(vertices, faces, normals, uv, paint_of(visual.material, uv is not None, path))]
    if isinstance(visual, ColorVisuals) and visual.kind is not None:
        step = 255.0 / (COLOR_LEVELS - 1)
        levels = np.rint(np.asarray(visual.face_colors, dtype=float) / step).astype(np.int64)
        colors, groups = np.unique(levels, axis=0, return_inverse=True)
        return [
            Surface(vertices, faces[groups.ravel() == index], normals, None, Paint(rgba(color * step)))
            for index, color in enumerate(colors)
        ]
    return [Surface(vertices, faces, normals, None, None)]


def authored_normals(mesh: trimesh.Trimesh, node_to_mesh: Floats) -> Floats | None:
    """(n, 3) the file's own vertex normals, or None: trimesh's computed ones would round off the corners of a box."""
    if "vertex_normals" not in mesh._cache:
        return None
    normals = np.asarray(mesh.vertex_normals, dtype=float) @ np.linalg.pinv(node_to_mesh[:3, :3])
    return np.asarray(np.nan_to_num(normals))


def paint_of(material: object, has_uv: bool, path: Path) -> Paint | None:
    """A trimesh material as paint; None where it says nothing."""
    if isinstance(material, SimpleMaterial):
        if is_made_up(material):
            return None
        red, green, blue, alpha = rgba(np.asarray(material.diffuse, dtype=float))
        image, name, alpha = material.image, str(material.name), min(alpha, opacity(material))
    elif isinstance(material, PBRMaterial):
        factor = material.baseColorFactor
        red, green, blue, alpha = (1.0,) * 4 if factor is None else rgba(np.asarray(factor, dtype=float))
        image, name = material.baseColorTexture, str(material.name)
        if material.alphaMode == "OPAQUE":
            alpha, image = 1.0, opaque(image)
        if factor is None and image is None:
            return None
    else:
        return None
    if not isinstance(image, Image.Image) or not has_uv:
        return Paint((red, green, blue, alpha))
    reference = image.info.get("file_path")
    key = str((path.parent / str(reference)).resolve()) if reference else f"{path}#{name}"
    return Paint((red, green, blue, alpha), Texture(key, image))


def is_made_up(material: SimpleMaterial) -> bool:
    """Whether trimesh made the material up, for a mesh with texture coordinates and no material: it states nothing, and
    its picture, if it has one, comes from no file."""
    if material.kwargs:
        return False
    image = material.image
    return material.name is None if image is None else image.format is None and not image.info


def opaque(image: object) -> object:
    """The picture without its opacity, which an opaque glTF material ignores."""
    return image.convert("RGB") if isinstance(image, Image.Image) and image.mode != "RGB" else image


def opacity(material: SimpleMaterial) -> float:
    """An MTL's opacity, ``d`` or 1 - ``Tr``, 0 to 1; 1 where neither is a number."""
    for name, turn in (("d", False), ("tr", True)):
        words = material.kwargs.get(name)
        try:
            number = float(words[-1] if isinstance(words, list | tuple) else str(words))
        except (ValueError, IndexError):
            continue
        return float(np.clip(1.0 - number if turn else number, 0.0, 1.0))
    return 1.0


def rgba(levels: Floats) -> Color:
    """(3,) or (4,) levels of 0 to 255 as a colour of 0 to 1."""
    values = [float(v) / 255.0 for v in np.clip(levels, 0.0, 255.0)]
    return (values[0], values[1], values[2], values[3] if len(values) > 3 else 1.0)
