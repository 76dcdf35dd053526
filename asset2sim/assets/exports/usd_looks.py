"""USD prim paths, and visuals in USD: a mesh per link and paint, and preview materials with textures beside them."""

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade, Vt

from asset2sim.assets.exports.refined_object import ExportObject
from asset2sim.assets.exports.visuals import Look
from asset2sim.assets.surfaces.surface import Paint, Texture

READABLE = (".png", ".jpg", ".jpeg")
"""Image formats that every USD renderer reads."""
ROUGHNESS = 0.6
"""Roughness of every surface, 0 to 1: between satin and matt, since the datasets' shininess values mean little."""


class PrimPaths:
    """Prim paths: ``top`` of the object, ``links`` and ``joints`` by URDF name, and the ``base`` joint."""

    def __init__(self, item: ExportObject) -> None:
        self.top = f"/{identifier(item.name)}"
        self.links = unique_paths(f"{self.top}", item.bodies, taken=("joints", "looks", "contact"))
        self.joints = unique_paths(f"{self.top}/joints", (joint.name for joint in item.joints), taken=("base",))
        self.base = f"{self.top}/joints/base"


def unique_paths(parent: str, names: Iterable[str], taken: Iterable[str] = ()) -> dict[str, str]:
    """Name → a path under ``parent``, no path twice."""
    used, found = set(taken), dict[str, str]()
    for name in names:
        base = word = identifier(name)
        number = 1
        while word in used:
            word, number = f"{base}_{number}", number + 1
        used.add(word)
        found[name] = f"{parent}/{word}"
    return found


def identifier(name: str) -> str:
    """The name with the characters replaced that a USD prim's name may not hold."""
    word = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return word if word and not word[0].isdigit() else f"_{word}"


def write_looks(stage: Usd.Stage, looks: Sequence[Look], folder: Path, names: PrimPaths) -> None:
    """Define every look under its link, in the link's frame, bound to a material under ``looks``."""
    if not looks:
        return
    UsdGeom.Scope.Define(stage, f"{names.top}/looks")
    materials: dict[Paint, UsdShade.Material] = {}
    counts: dict[str, int] = {}
    for look in looks:
        if look.paint not in materials:
            path = f"{names.top}/looks/paint_{len(materials)}"
            materials[look.paint] = write_material(stage, look.paint, path, folder)
        number = counts[look.link] = counts.get(look.link, -1) + 1
        mesh = UsdGeom.Mesh.Define(stage, f"{names.links[look.link]}/visual_{number}")
        surface = look.surface
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(surface.vertices.astype(np.float32)))
        mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(surface.faces), 3, dtype=np.int32)))
        mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(surface.faces.astype(np.int32).ravel()))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateDoubleSidedAttr(True)
        red, green, blue, alpha = look.paint.color
        mesh.CreateDisplayColorAttr([(red, green, blue)])
        mesh.CreateDisplayOpacityAttr([alpha])
        if surface.uv is not None:
            primvars = UsdGeom.PrimvarsAPI(mesh)
            uv = primvars.CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex)
            uv.Set(Vt.Vec2fArray.FromNumpy(surface.uv.astype(np.float32)))
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(materials[look.paint])


def write_material(stage: Usd.Stage, paint: Paint, path: str, folder: Path) -> UsdShade.Material:
    """A preview material of the paint's colour, or of its texture where that is a picture inside the folder."""
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    red, green, blue, alpha = paint.color
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(ROUGHNESS)
    shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(alpha)
    color = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    file = None if paint.texture is None else texture_path(paint.texture, folder)
    if file is None:
        color.Set((red, green, blue))
    else:
        reader = UsdShade.Shader.Define(stage, f"{path}/st")
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        texture = UsdShade.Shader.Define(stage, f"{path}/texture")
        texture.CreateIdAttr("UsdUVTexture")
        texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(f"./{file}")
        texture.CreateInput("wrapS", Sdf.ValueTypeNames.Token).Set("repeat")
        texture.CreateInput("wrapT", Sdf.ValueTypeNames.Token).Set("repeat")
        texture.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set((red, green, blue, 1.0))
        uv = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(uv)
        color.ConnectToSource(texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    return material


def texture_path(texture: Texture, folder: Path) -> str | None:
    """The texture's file relative to the folder, forward slashes; None where it is missing, unreadable or outside."""
    path = Path(texture.key)
    if path.suffix.lower() not in READABLE or not path.is_file():
        return None
    relative = os.path.relpath(path.resolve(), folder.resolve())
    return None if relative.startswith("..") else Path(relative).as_posix()
