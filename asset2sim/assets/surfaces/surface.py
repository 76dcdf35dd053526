"""Painted surfaces, the form in which every mesh format and primitive is drawn, and textures made ready for that:
decoded, shrunk, colours and opacity apart."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Color = tuple[float, float, float, float]

PLAIN: Color = (0.72, 0.72, 0.74, 1.0)
"""The default colour: a light grey that both lit and unlit sides can be read in."""


@dataclass(frozen=True)
class Texture:
    """A picture to lay over a surface; two textures are the same if their keys (path, or file and material) are."""

    key: str
    image: Image.Image = field(compare=False, repr=False)


@dataclass(frozen=True)
class Paint:
    """How a surface looks: RGBA in 0 to 1, multiplied with the texture where there is one."""

    color: Color
    texture: Texture | None = None


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of one paint. ``vertices`` (n, 3) float in metres, ``faces`` (m, 3) int, ``normals`` (n, 3) float unit
    vectors or None, ``uv`` (n, 2) float with v upwards, or None. ``paint`` is None where the file gives none."""

    vertices: Floats
    faces: Ints
    normals: Floats | None
    uv: Floats | None
    paint: Paint | None


@dataclass(frozen=True, eq=False)
class Batch:
    """Triangles of one paint, each wound so that its front is towards the side its normals point to. ``vertices`` and
    ``normals`` (n, 3) float in the root frame, ``uv`` (n, 2) float, ``faces`` (m, 3) int."""

    vertices: Floats
    normals: Floats
    uv: Floats | None
    faces: Ints
    paint: Paint


def posed(surface: Surface, surface_to_root: Floats, scale: Floats, fallback: Paint) -> Surface:
    """The surface scaled by (3,) ``scale`` and moved by a (4, 4) transform; ``fallback`` paints it if it is bare."""
    linear = surface_to_root[:3, :3] * scale
    normals = None
    if surface.normals is not None:
        # Normals go with the inverse transpose; the cofactors are that up to a factor, and need no inverse.
        cofactors = np.array([scale[1] * scale[2], scale[0] * scale[2], scale[0] * scale[1]])
        normals = unit_vectors(surface.normals @ (surface_to_root[:3, :3] * cofactors).T)
    faces = surface.faces if np.prod(scale) >= 0.0 else surface.faces[:, ::-1]
    vertices = surface.vertices @ linear.T + surface_to_root[:3, 3]
    return Surface(vertices, faces, normals, surface.uv, surface.paint or fallback)


def unit_vectors(vectors: Floats) -> Floats:
    """(n, 3) vectors at length one; those without a length stay zero."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(length > 1e-30, length, 1.0))


def face_normals(corners: Floats) -> Floats:
    """(m, 3) normals of (m, 3, 3) triangles, each twice as long as its triangle's area."""
    # By columns that lie together: np.cross takes twice as long.
    origin, one, other = np.ascontiguousarray(corners.transpose(1, 2, 0))
    (ax, ay, az), (bx, by, bz) = one - origin, other - origin
    found = np.empty((len(corners), 3))
    found[:, 0], found[:, 1], found[:, 2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return found


def compact(batch: Batch) -> Batch:
    """The batch without vertices that no face uses."""
    used = np.zeros(len(batch.vertices), dtype=bool)
    used[batch.faces] = True
    index = np.cumsum(used) - 1
    uv = None if batch.uv is None else batch.uv[used]
    return Batch(batch.vertices[used], batch.normals[used], uv, index[batch.faces], batch.paint)


TEXTURE_SIDE = 256
"""Textures are shrunk to this many pixels on their longer side: a view shows no more."""
OPAQUE = 250
"""Texels whose opacity (0 to 255) is at least this are taken for opaque."""


@dataclass(frozen=True, eq=False)
class DecodedTexture:
    """A texture's RGB picture, and its opacity as a grey RGB picture, or None where it is opaque throughout."""

    color: Image.Image
    opacity: Image.Image | None


def decode_textures(batches: Iterable[Batch]) -> dict[Texture, DecodedTexture]:
    """The textures of these batches that can be decoded; a broken one is left out, and its surface keeps its colour."""
    skins: dict[Texture, DecodedTexture] = {}
    for batch in batches:
        texture = batch.paint.texture
        if texture is None or texture in skins or batch.uv is None:
            continue
        try:
            skins[texture] = decode_texture(texture.image)
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # what Pillow raises on a bad picture
            continue
    return skins


def decode_texture(image: Image.Image) -> DecodedTexture:
    """Decode and shrink one picture."""
    image.draft("RGB", (TEXTURE_SIDE, TEXTURE_SIDE))  # lets a JPEG be decoded at a fraction of its size
    if image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info:
        whole = image.convert("RGBA")
        whole.thumbnail((TEXTURE_SIDE, TEXTURE_SIDE), Image.Resampling.BOX)
        alpha = whole.getchannel("A")
        if int(np.asarray(alpha).min()) < OPAQUE:
            return DecodedTexture(whole.convert("RGB"), Image.merge("RGB", (alpha, alpha, alpha)))
        return DecodedTexture(whole.convert("RGB"), None)
    color = image.convert("RGB")
    color.thumbnail((TEXTURE_SIDE, TEXTURE_SIDE), Image.Resampling.BOX)
    return DecodedTexture(color, None)
