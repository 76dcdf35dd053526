"""The size picture: raw and refined at their true relative size beside a cube of 10 cm, in parallel projection."""

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from PIL import Image

from asset2sim.assets.surfaces.load import from_mesh
from asset2sim.assets.surfaces.scene import Scene
from asset2sim.assets.surfaces.surface import Paint, Surface
from asset2sim.physics.arrays import Array
from asset2sim.render.camera import camera_axes, view_directions
from asset2sim.render.cloud import merged_clouds
from asset2sim.render.draw import background, image_of, pictures
from asset2sim.render.faces import faces_of
from asset2sim.render.zbuffer import Lens, Singles
from asset2sim.report.loops.figure import LoopFigure
from asset2sim.report.loops.film import INK, SOFT_INK, SPACING, Clouds, lengthening, text
from asset2sim.report.loops.record import LoopMotion

WIDTH, HEIGHT = 640, 320
"""Pixels of the picture."""
OVERSAMPLING, METHOD = 1.25, 1
"""Pixels drawn per pixel shown along each side, at most, and WebP's effort, 0 to 6."""
TOP, BOTTOM, GAP = 14, 70, 28
"""Pixels above the highest object, for the words below, and between two objects."""
SLOT = 96
"""Least width that an object has, for its words, pixels."""
CUBE_M = 0.1
CUBE_COLOR = (0.90, 0.45, 0.13, 1.0)


@dataclass(frozen=True, eq=False)
class SizeItem:
    """Something that stands in the picture: (links, 3, 4) transforms of a figure's triangles to a world of its own, in
    m, whose floor is z = 0, and the words below it."""

    figure: LoopFigure
    motion: Array
    words: tuple[str, str]


def cube() -> SizeItem:
    """The cube."""
    box = from_mesh(trimesh.creation.box((CUBE_M, CUBE_M, CUBE_M)))
    surface = Surface(box.vertices, box.faces, None, None, Paint(CUBE_COLOR))
    scene = Scene((surface,), ("cube",), np.array([1.0, 0.0, 0.0]))
    figure = LoopFigure((), "cube", {}, scene, faces_of(scene), {"cube": np.eye(4)}, CUBE_M)
    lifted = np.eye(4)[None, :3].copy()
    lifted[0, 2, 3] = 0.5 * CUBE_M
    return SizeItem(figure, lifted, ("cube", "10 cm"))


def standing_item(figure: LoopFigure, recording: LoopMotion, name: str) -> SizeItem:
    """An object as it is in a recording's first frame, its lowest point on the floor."""
    placed = figure.placed(recording)[0]
    points = figure.spanned(placed[None])
    low, high = points.min(axis=0), points.max(axis=0)
    motion = placed[:, :3].copy()
    motion[:, :2, 3] -= 0.5 * (low + high)[:2]
    motion[:, 2, 3] -= low[2]
    return SizeItem(figure, motion, (name, length_text(float((high - low).max()))))


def length_text(length_m: float) -> str:
    """A length in words: 4 mm, 23 cm, 1.74 m, 170 m."""
    if length_m < 0.0095:
        return f"{1e3 * length_m:.2g} mm"
    if length_m < 0.995:
        return f"{1e2 * length_m:.2g} cm"
    return f"{length_m:.3g} m"


def scale_of(boxes: Sequence[tuple[float, float]]) -> float:
    """Pixels a metre at which objects of these widths and heights in the picture's plane, m, fit side by side."""
    free = WIDTH - GAP * (len(boxes) + 1)
    scale = (HEIGHT - TOP - BOTTOM) / max(height for _, height in boxes)
    while sum(max(width * scale, SLOT) for width, _ in boxes) > free:
        scale *= 0.98
    return scale


@dataclass(frozen=True, eq=False)
class PlacedItems:
    """The items' places in the picture: the x of each one's middle, pixels, their (links, 3, 4) transforms to one world
    whose unit is the longest of them, and the lens, in pixels that are shown."""

    items: tuple[SizeItem, ...]
    centers: tuple[float, ...]
    motions: tuple[Singles, ...]
    lens: Lens


def in_a_row(items: Sequence[SizeItem]) -> PlacedItems:
    """The items side by side, from the left."""
    right, up, back = camera_axes(view_directions(items[0].figure.scene.front)["perspective"])
    spans = [item.figure.spanned(item.motion[None]) @ np.stack([right, up]).T for item in items]
    boxes = [(float(np.ptp(span[:, 0])), float(np.ptp(span[:, 1]))) for span in spans]
    scale, unit = scale_of(boxes), max(item.figure.size_m for item in items)
    slots = [max(width * scale, SLOT) for width, _ in boxes]
    left = 0.5 * (WIDTH - sum(slots) - GAP * (len(items) - 1))
    centers, motions = [], []
    for item, span, slot in zip(items, spans, slots, strict=True):
        centers.append(left + 0.5 * slot)
        left += slot + GAP
        motion = item.motion.copy()
        motion[:, :, 3] += (centers[-1] / scale - 0.5 * (span[:, 0].min() + span[:, 0].max())) * right
        motions.append((motion / unit).astype(np.float32))
    pixels = scale * unit
    bottom = HEIGHT - BOTTOM + scale * min(float(span[:, 1].min()) for span in spans)
    matrix = np.column_stack([np.stack([pixels * right, -pixels * up, -back]), [0.0, bottom, 4.0]])
    lens = Lens(matrix.astype(np.float32), WIDTH, HEIGHT, back.astype(np.float32), flat=True)
    return PlacedItems(tuple(items), tuple(centers), tuple(motions), lens)


def size_picture(row: PlacedItems, clouds: Clouds) -> bytes:
    """The picture as WebP, drawn from these clouds."""
    chosen = [clouds[id(item.figure.faces)] for item in row.items]
    density = [
        SPACING / (cloud.spacing_m * lengthening(row.lens, motion))
        for cloud, motion in zip(chosen, row.motions, strict=True)
    ]
    lens = row.lens.shrunk(1.0 / min(OVERSAMPLING, *density))
    drawn = next(pictures(merged_clouds(chosen), np.concatenate(row.motions)[None], lens, background(lens, disc=False)))
    image = image_of(drawn).resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)
    for center, item in zip(row.centers, row.items, strict=True):
        text(image, (center, HEIGHT - 22), item.words[0], 14, INK, "ms")
        text(image, (center, HEIGHT - 7), item.words[1], 12, SOFT_INK, "ms")
    stream = io.BytesIO()
    image.save(stream, "WEBP", quality=80, method=METHOD)
    return stream.getvalue()
