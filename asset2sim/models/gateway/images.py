"""Images of a model request: scaled down, as data URLs, each after its label."""

import base64
import io
from typing import Any

from PIL import Image

from schemas.request import LabelledImage, ModelRequest


def downscaled(request: ModelRequest, side_px: int) -> ModelRequest:
    """The request with every picture, also those of its turns, at most ``side_px`` wide and high."""
    turns = tuple(
        turn.model_copy(update={"images": tuple(fitted(image, side_px) for image in turn.images)})
        for turn in request.turns
    )
    images = tuple(fitted(image, side_px) for image in request.images)
    return request.model_copy(update={"images": images, "turns": turns})


def fitted(image: LabelledImage, side_px: int) -> LabelledImage:
    """The picture with its longest side at most ``side_px``; one that fits, or that cannot be read, stays as it is.

    The same picture gives the same bytes, which the answer cache needs.
    """
    try:
        with Image.open(io.BytesIO(image.png)) as picture:
            if max(picture.size) <= side_px:
                return image
            picture.thumbnail((side_px, side_px), Image.Resampling.LANCZOS)
            out = io.BytesIO()
            picture.save(out, format="PNG", optimize=False)
    except (OSError, ValueError, Image.DecompressionBombError):
        return image
    return image.model_copy(update={"png": out.getvalue()})


def image_parts(images: tuple[LabelledImage, ...]) -> list[dict[str, Any]]:
    """OpenAI content parts: for each picture a text with its label, then the picture itself."""
    parts: list[dict[str, Any]] = []
    for image in images:
        url = "data:image/png;base64," + base64.b64encode(image.png).decode("ascii")
        parts.append({"type": "text", "text": f"Image: {image.label}"})
        parts.append({"type": "image_url", "image_url": {"url": url}})
    return parts


def has_images(request: ModelRequest) -> bool:
    """Whether the request, or a turn of it, has a picture."""
    return bool(request.images) or any(turn.images for turn in request.turns)
