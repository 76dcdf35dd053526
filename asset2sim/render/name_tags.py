"""Names written beside the parts of a picture."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import distance_transform_edt

from asset2sim.assets.surfaces.surface import Floats

TEXT_PX = 14
"""Height of the names, px."""
MARGIN = 3
"""Space around a name, px."""
FEWEST_PX = 12
"""Pixels of a part below which it gets no name: it cannot be seen."""
WAYS = 24
"""Directions in which a place for a name is looked for."""
RADII = (0, 24, 36, 50, 66, 84, 104, 128, 156, 190)
"""Distances from the part at which it is, px."""
Links = NDArray[np.int64]
Box = tuple[int, int, int, int]


def with_names(image: Image.Image, shown: Links, names: Mapping[int, tuple[str, Floats]]) -> Image.Image:
    """The picture with the name of each part that it shows, on a tag bordered in the part's colour; a line leads to the
    part where the tag is not on it. ``shown`` is (h, w) the number of the part in each pixel, ``names`` number → name
    and colour, sRGB 0 to 1."""
    canvas = image.convert("RGB")
    draw = ImageDraw.Draw(canvas)
    font = ImageFont.load_default(TEXT_PX)
    areas = {number: int((shown == number).sum()) for number in names}
    weight = np.full(shown.shape, 1e-5)
    for number, area in areas.items():
        if area:
            weight[shown == number] = 1.0 / area
    placed: list[Box] = []
    tags: list[tuple[Box, tuple[int, int], str, tuple[int, ...]]] = []
    for number in sorted((n for n in names if areas[n] >= FEWEST_PX), key=lambda n: areas[n]):
        name, color = names[number]
        inside = distance_transform_edt(np.pad(shown == number, 1))[1:-1, 1:-1]
        y, x = (int(v) for v in np.unravel_index(int(inside.argmax()), inside.shape))
        left, _, right, bottom = (int(v) for v in draw.textbbox((0, 0), name, font=font))
        size = (right - left + 2 * MARGIN, bottom + 2 * MARGIN)
        box = tag_box((x, y), size, weight, placed)
        if box is None:
            continue
        placed.append(box)
        tags.append((box, (x, y), name, tuple(int(255 * level) for level in color)))
    for box, at, _, paint in tags:
        nearest = (min(max(at[0], box[0]), box[2]), min(max(at[1], box[1]), box[3]))
        if nearest != at:
            draw.line((nearest, at), fill=(255, 255, 255), width=4)
            draw.line((nearest, at), fill=(0, 0, 0), width=2)
            draw.ellipse((at[0] - 4, at[1] - 4, at[0] + 4, at[1] + 4), fill=paint, outline=(0, 0, 0))
    for box, _, name, paint in tags:
        draw.rectangle(box, fill=(255, 255, 255), outline=(0, 0, 0), width=1)
        draw.rectangle((box[0] + 1, box[1] + 1, box[2] - 1, box[3] - 1), outline=paint, width=2)
        draw.text((box[0] + MARGIN, box[1] + MARGIN - 1), name, fill=(0, 0, 0), font=font)
    return canvas


def tag_box(at: tuple[int, int], size: tuple[int, int], weight: Floats, placed: list[Box]) -> Box | None:
    """The box (left, top, right, bottom) of a tag of this ``size`` near a point, px: on no other tag, where it hides
    least; None where there is no room. ``weight`` is what hiding each pixel costs."""
    height, width = weight.shape
    best: tuple[float, Box | None] = (np.inf, None)
    for radius in RADII:
        for way in range(WAYS if radius else 1):
            angle = 2.0 * np.pi * way / WAYS
            left = round(at[0] + radius * np.cos(angle) * 1.4 - size[0] / 2)
            top = round(at[1] + radius * np.sin(angle) - size[1] / 2)
            box = (left, top, left + size[0], top + size[1])
            if left < 0 or top < 0 or box[2] >= width or box[3] >= height:
                continue
            if any(box[0] < b[2] + 2 and b[0] < box[2] + 2 and box[1] < b[3] + 2 and b[1] < box[3] + 2 for b in placed):
                continue
            cost = float(weight[top : box[3], left : box[2]].sum()) + radius / 400.0
            if cost < best[0]:
                best = (cost, box)
    return best[1]
