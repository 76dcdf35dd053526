"""Frames to pictures: background, smoothing and PNG bytes."""

import io

import numpy as np
from PIL import Image

from asset2sim.assets.views.renderer import Frame

BACKGROUND_TOP, BACKGROUND_BOTTOM = (244.0, 246.0, 249.0), (224.0, 228.0, 234.0)
"""Background colours, RGB: light, and never quite white, so that white objects keep an outline."""


def finish(frame: Frame, width: int, height: int) -> Image.Image:
    """The frame over the background, averaged down to ``width`` by ``height`` pixels."""
    rows = np.linspace(0.0, 1.0, frame.color.shape[0], dtype=np.float32)[:, None, None]
    top, bottom = np.array(BACKGROUND_TOP, dtype=np.float32), np.array(BACKGROUND_BOTTOM, dtype=np.float32)
    color = np.where(frame.drawn[..., None], frame.color, top + rows * (bottom - top))
    image = Image.fromarray(np.clip(color + 0.5, 0.0, 255.0).astype(np.uint8), "RGB")
    if image.size != (width, height):
        image = image.resize((width, height), Image.Resampling.BOX)
    return image


def png_bytes(image: Image.Image) -> bytes:
    """The picture as a PNG file."""
    stream = io.BytesIO()
    image.save(stream, format="PNG")
    return stream.getvalue()
