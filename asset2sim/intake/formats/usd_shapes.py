"""Geometry of a USD stage as URDF has it: primitives where they stay what they are, else meshes, with their paint."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh

from asset2sim.assets.urdf.numbers import LARGEST
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.intake.formats.usd_stage import UsdStage
from asset2sim.physics.arrays import Array, Faces
from asset2sim.physics.kinematics import apply

if TYPE_CHECKING:
    from pxr import Usd

MOST_FACES = 2_000_000
"""Triangles of one mesh: as an OBJ, a hundred megabytes."""
SKEW = 1e-6
"""Cosine between the axes of a transform, and relative difference of their scales, up to which they count as right
angles and as one scale."""
TO_AXIS = {
    "X": np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]),
    "Y": np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]),
    "Z": np.eye(4),
}
"""Axis of a cylinder, capsule or cone → the rotation that brings z there."""


@dataclass(frozen=True, eq=False)
class Form:
    """One piece of geometry: the (4, 4) pose of a primitive of this ``kind`` (a URDF's tag), its ``size`` by a URDF's
    attributes, m; or (n, 3) vertices, (m, 3) faces and (m, 3, 2) texture coordinates of a mesh."""

    kind: str
    pose: Array
    size: Mapping[str, tuple[float, ...]]
    vertices: Array
    faces: Faces
    uv: Array | None = None
    polygons: Faces | None = None
    """(m,) the polygon of the file of which each face is a part."""


@dataclass(frozen=True)
class UsdPaint:
    """A colour (red, green, blue, opacity; 0 to 1), and the path of a picture in its place, empty without."""

    color: tuple[float, ...]
    picture: str = ""


BOUNDS = {"boundingCube": "Cube", "boundingSphere": "Sphere"}
"""Approximations of a mesh as which it collides otherwise than as its hull or its triangles."""
SHAPES = ("Mesh", "Cube", "Sphere", "Cylinder", "Capsule", "Cone")
"""Geometry that is read."""


def is_shown(stage: UsdStage, prim: "Usd.Prim") -> bool:
    """Whether a prim is drawn in a finished picture."""
    from pxr import UsdGeom

    item = UsdGeom.Imageable(prim)
    hidden = item.ComputeVisibility(stage.time) == UsdGeom.Tokens.invisible
    return not hidden and item.ComputePurpose() in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)


def collision(stage: UsdStage, prim: "Usd.Prim") -> "Usd.Prim | None":
    """The prim that makes a piece of geometry collide: itself, or a group of it in the same body; None for none."""
    from pxr import UsdGeom, UsdPhysics

    at = prim
    while at and not at.IsPseudoRoot():
        if at.HasAPI(UsdPhysics.CollisionAPI) and (at == prim or not at.IsA(UsdGeom.Gprim)):
            enabled = UsdPhysics.CollisionAPI(at).GetCollisionEnabledAttr().Get(stage.time) is not False
            return at if enabled else None
        if at.HasAPI(UsdPhysics.RigidBodyAPI):
            return None
        at = at.GetParent()
    return None


def read_form(stage: UsdStage, prim: "Usd.Prim", to_frame: Array) -> Form | None:
    """The geometry of a prim, ``to_frame`` being the (4, 4) transform of its own coordinates, with any scale; None for
    a mesh without faces. Raises AssetError for a mesh that cannot be used."""
    kind = str(prim.GetTypeName())
    if kind == "Mesh":
        return mesh_form(stage, prim, to_frame)
    radius, height, edge = (float(prim.GetAttribute(name).Get(stage.time) or 0.0) if prim.HasAttribute(name) else 0.0
                            for name in ("radius", "height", "size"))  # fmt: skip
    if not max(abs(radius), abs(height), abs(edge)) * np.abs(to_frame[:3, :3]).max() < LARGEST:
        raise stage.refused("usd_number", f"{prim.GetPath()} is over {LARGEST:g} m large: mend its size or scale")
    axis = TO_AXIS[stage.axis(prim, "axis", "Z")]
    return primitive(kind, (edge,) * 3 if kind == "Cube" else (radius, height), to_frame @ axis)


def primitive(kind: str, size: tuple[float, ...], to_frame: Array) -> Form:
    """A box of three edges, or a round shape of radius and height along z, under a transform that may scale it: itself
    where that leaves it what it is, else a mesh."""
    scales = np.linalg.norm(to_frame[:3, :3], axis=0)
    turn = to_frame[:3, :3] / np.where(scales > 0.0, scales, 1.0)
    square = bool(np.abs(turn.T @ turn - np.eye(3)).max() < SKEW)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, to_frame[:3, 3]
    pose[:3, 0] *= np.sign(np.linalg.det(turn))  # each of them is its own mirror image
    around = square and abs(scales[0] - scales[1]) < SKEW * scales[0]
    alike = around and abs(scales[0] - scales[2]) < SKEW * scales[0]
    nothing, none = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    if kind == "Cube" and square:
        return Form("box", pose, {"size": tuple(float(v) for v in scales * size)}, nothing, none)
    if kind == "Sphere" and alike:
        return Form("sphere", pose, {"radius": (float(size[0] * scales[0]),)}, nothing, none)
    if (kind == "Cylinder" and around) or (kind == "Capsule" and alike):
        sizes = {"radius": (float(size[0] * scales[0]),), "length": (float(size[1] * scales[2]),)}
        return Form(kind.lower(), pose, sizes, nothing, none)
    creation = trimesh.creation
    if kind == "Cube":
        made = creation.box(size)
    elif kind == "Sphere":
        made = creation.icosphere(3, size[0])
    elif kind == "Cone":
        made = creation.cone(size[0], size[1]).apply_translation((0.0, 0.0, -size[1] / 2.0))
    else:
        made = (creation.cylinder if kind == "Cylinder" else creation.capsule)(radius=size[0], height=size[1])
    return placed(np.asarray(made.vertices), np.asarray(made.faces), to_frame)


def bounds(form: Form, to_frame: Array, kind: str) -> Form:
    """The box or ball around a piece of geometry, in the axes of its own prim, ``to_frame`` being its transform."""
    points = apply(np.asarray(np.linalg.pinv(to_frame), dtype=float), form.vertices)
    if form.kind != "mesh" or len(points) == 0:
        return form
    low, high = points.min(axis=0), points.max(axis=0)
    center = np.eye(4)
    center[:3, 3] = (low + high) / 2.0
    radius = float(np.linalg.norm(points - center[:3, 3], axis=1).max())
    shape, size = BOUNDS[kind], (tuple(high - low) if kind == "boundingCube" else (radius, 0.0))
    return primitive(shape, size, to_frame @ center)


def placed(vertices: Array, faces: Faces, to_frame: Array, **more: Any) -> Form:
    """A mesh whose (n, 3) vertices are brought into the frame; a mirror image is wound the other way."""
    mirrored = np.linalg.det(to_frame[:3, :3]) < 0.0
    if mirrored and more.get("uv") is not None:
        more["uv"] = more["uv"][:, ::-1]
    return Form("mesh", np.eye(4), {}, apply(to_frame, vertices), faces[:, ::-1] if mirrored else faces, **more)


def mesh_form(stage: UsdStage, prim: "Usd.Prim", to_frame: Array) -> Form | None:
    """The cage of a mesh, its polygons as fans of triangles, as USD's own renderers cut them, without its holes."""
    from pxr import UsdGeom

    mesh = UsdGeom.Mesh(prim)
    points = np.array(mesh.GetPointsAttr().Get(stage.time) or [], dtype=float)
    counts, corners = (np.array(attribute.Get(stage.time) or [], dtype=np.int64)
                       for attribute in (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()))  # fmt: skip
    where = f"mesh {prim.GetPath()}"
    if len(points) == 0 or counts.max(initial=0) < 3:
        stage.notes.append(f"{where} is left out: it has no faces")
        return None
    if counts.min() < 0 or counts.sum() != len(corners) or corners.min() < 0 or corners.max() >= len(points):
        raise stage.refused("usd_mesh", f"{where} has faces of vertices that it does not hold: export it again")
    if (count := int(np.maximum(counts - 2, 0).sum())) > MOST_FACES:
        raise stage.refused(
            "usd_mesh", f"{where} has {count} triangles, more than the {MOST_FACES} that are read: simplify it"
        )
    if not np.isfinite(points[corners]).all():
        raise stage.refused("usd_mesh", f"{where} has vertices that are not finite: export it again")
    kept = counts >= 3
    kept[[hole for hole in mesh.GetHoleIndicesAttr().Get(stage.time) or () if 0 <= hole < len(counts)]] = False
    starts = np.cumsum(counts) - counts
    polygons = np.repeat(np.arange(len(counts)), np.where(kept, counts - 2, 0))
    nth = np.arange(len(polygons)) - np.searchsorted(polygons, polygons)
    fans = starts[polygons][:, None] + np.stack([np.zeros_like(nth), nth + 1, nth + 2], axis=1)
    if mesh.GetOrientationAttr().Get(stage.time) == UsdGeom.Tokens.leftHanded:
        fans = fans[:, ::-1]
    found = uv_of(stage, prim, corners)
    return placed(points, corners[fans], to_frame, uv=None if found is None else found[fans], polygons=polygons)


def uv_of(stage: UsdStage, prim: "Usd.Prim", corners: Faces) -> Array | None:
    """(n, 2) texture coordinates of each corner of a mesh's faces; None where it has none that fit."""
    from pxr import UsdGeom

    primvars = UsdGeom.PrimvarsAPI(prim)
    for name in ("st", "UVMap", "st0", "uv"):
        primvar = primvars.FindPrimvarWithInheritance(name)
        given = primvar.ComputeFlattened(stage.time) if primvar and primvar.HasValue() else None
        values: Array = np.array(given or [], dtype=float)
        if values.ndim > 1 and values.shape[1:] == (2,) and np.isfinite(values).all():
            if len(values) == len(corners):
                return values
            if len(values) > corners.max():
                return np.asarray(values[corners])
    return None


def painted(stage: UsdStage, prim: "Usd.Prim", form: Form) -> Iterator[tuple[Form, UsdPaint | None]]:
    """The parts of a piece of geometry with their paints: one for each subset of a mesh's faces that has a material,
    and one of the rest."""
    from pxr import UsdShade

    binding = UsdShade.MaterialBindingAPI(prim)
    rest, polygons = np.ones(len(form.faces), dtype=bool), form.polygons
    for subset in () if polygons is None else binding.GetMaterialBindSubsets():
        own = rest & np.isin(np.asarray(polygons), np.array(subset.GetIndicesAttr().Get(stage.time) or [], dtype=int))
        rest &= ~own
        if own.any():
            yield part(form, np.flatnonzero(own)), paint_of(stage, subset.GetPrim())
    if form.kind != "mesh" or rest.any():
        yield (form if rest.all() else part(form, np.flatnonzero(rest))), paint_of(stage, prim)


def part(form: Form, chosen: Faces) -> Form:
    """The faces of these numbers of a mesh, with the vertices that they use."""
    used, faces = np.unique(form.faces[chosen], return_inverse=True)
    uv = None if form.uv is None else form.uv[chosen]
    return replace(
        form, vertices=form.vertices[used], faces=np.asarray(faces.reshape(-1, 3), dtype=np.int64), uv=uv, polygons=None
    )


def paint_of(stage: UsdStage, prim: "Usd.Prim") -> UsdPaint | None:
    """The colour or picture of a prim's material (a preview surface, or one of Omniverse's), else its display colour:
    of several their mean; None where it has none."""
    from pxr import UsdGeom, UsdShade

    material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    sources = [material.ComputeSurfaceSource(word)[0] for word in ("", "mdl")] if material else []
    shader = next((source for source in sources if source), None)
    if shader is not None:
        color, picture = shaded(stage, shader, ("diffuseColor", "diffuse_color_constant"))
        picture = picture or shaded(stage, shader, ("diffuse_texture",))[1]
        opacity = shaded(stage, shader, ("opacity", "opacity_constant"))[0]
        if color is not None or picture:
            alpha = 1.0 if opacity is None else float(opacity[0])
            return UsdPaint((*(np.ones(3) if color is None else color)[:3].tolist(), alpha), picture)
    found = UsdGeom.PrimvarsAPI(prim if prim.IsA(UsdGeom.Gprim) else prim.GetParent())  # a mesh's subset has its mesh's
    values, alphas = (
        primvar.Get(stage.time) if primvar else None
        for primvar in (found.FindPrimvarWithInheritance(name) for name in ("displayColor", "displayOpacity"))
    )
    if values is None or len(values) == 0:
        return None
    alpha = 1.0 if alphas is None or len(alphas) == 0 else float(np.mean(alphas))
    return UsdPaint((*np.mean(np.array(values, dtype=float), axis=0).tolist(), alpha))


def shaded(stage: UsdStage, shader: Any, names: tuple[str, ...]) -> tuple[Array | None, str]:
    """The value of the first of a shader's inputs that has one, and the file of the texture that it is connected to."""
    from pxr import UsdShade

    for name in names:
        given = shader.GetInput(name)
        if not given:
            continue
        for source in UsdShade.Utils.GetValueProducingAttributes(given):
            reader = UsdShade.Shader(source.GetPrim())
            value = reader.GetInput("file").Get() if reader and reader.GetInput("file") else source.Get(stage.time)
            if hasattr(value, "resolvedPath"):
                scale = reader.GetInput("scale").Get() if reader.GetInput("scale") else None
                return (None if scale is None else np.array(scale, dtype=float)), str(value.resolvedPath)
            if value is not None:
                return np.atleast_1d(np.array(value, dtype=float)), ""
    return None, ""


def picture_file(path: str, work: Path, reach: AllowedFolders) -> str:
    """The file of a picture: itself, or that of one in a package, written into ``work``. Empty for one that is not
    there, or in a package outside ``reach``."""
    from pxr import Ar

    if not Ar.IsPackageRelativePath(path):
        return path
    package, name = Ar.SplitPackageRelativePathOuter(path)
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path)) if reach.allows(Path(package)) else None
    if not asset:
        return ""
    place = work / "textures" / re.sub(r"[^A-Za-z0-9.]", "_", f"{package}_{name}".lstrip("/"))[-100:]
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(asset.GetBuffer())
    return str(place)
