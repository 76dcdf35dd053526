"""Painted surfaces, the form in which every mesh format and primitive is drawn, and textures made ready for that:
decoded, shrunk, colours and opacity apart."""

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


TEXTURE_SIDE = 256
"""Textures are shrunk to this many pixels on their longer side: a view shows no more."""


def decode_texture(image: Image.Image) -> Image.Image:
    """A picture decoded and shrunk, as RGBA."""
    image.draft("RGB", (TEXTURE_SIDE, TEXTURE_SIDE))  # lets a JPEG be decoded at a fraction of its size
    found = image.convert("RGBA")
    found.thumbnail((TEXTURE_SIDE, TEXTURE_SIDE), Image.Resampling.BOX)
    return found
