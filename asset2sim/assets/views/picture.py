"""Frames to pictures: background, smoothing, PNG bytes and the labelled sheet."""

import io
from collections.abc import Mapping

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from asset2sim.assets.views.renderer import Frame

BACKGROUND_TOP, BACKGROUND_BOTTOM = (244.0, 246.0, 249.0), (224.0, 228.0, 234.0)
"""Background colours, RGB: light, and never quite white, so that white objects keep an outline."""
LABEL_HEIGHT = 22
GAP = 6


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


def contact_sheet(images: Mapping[str, Image.Image]) -> Image.Image:
    """The pictures side by side in the order given, each with its name above it. Raises ValueError if there is none."""
    if not images:
        raise ValueError("a contact sheet needs at least one picture")
    width = sum(image.width for image in images.values()) + GAP * (len(images) + 1)
    height = max(image.height for image in images.values()) + LABEL_HEIGHT + GAP
    sheet = Image.new("RGB", (width, height), (255, 255, 255))
    pen = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=13)
    left = GAP
    for name, image in images.items():
        pen.text((left + image.width / 2, LABEL_HEIGHT / 2 + 1), name, fill=(60, 64, 70), font=font, anchor="mm")
        sheet.paste(image, (left, LABEL_HEIGHT))
        left += image.width + GAP
    return sheet
