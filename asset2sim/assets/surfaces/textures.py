"""Textures made ready for the renderer: decoded, shrunk, colours and opacity apart."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from PIL import Image

from asset2sim.assets.surfaces.surface import Batch, Texture

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
