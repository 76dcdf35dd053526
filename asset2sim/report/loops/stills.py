"""Still pictures beside the loops: both objects at their true relative size, and the refined one's joints."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image, ImageDraw, ImageFont

from asset2sim.assets.surfaces.load import from_mesh
from asset2sim.assets.surfaces.scene import Scene
from asset2sim.assets.surfaces.surface import Paint, Surface
from asset2sim.guidance.link_colors import PALETTE
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint
from asset2sim.render.camera import Camera, camera_axes, view_camera, view_directions
from asset2sim.render.draw import background, over_ground
from asset2sim.render.faces import faces_of
from asset2sim.render.marked import MARGIN, Box, tag_box
from asset2sim.report.loops.figure import LoopFigure
from asset2sim.report.loops.film import INK, SOFT_INK, text
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


def in_a_row(items: Sequence[SizeItem]) -> tuple[list[float], list[Array], Camera]:
    """The items side by side, from the left: the x of each one's middle, pixels, their (links, 3, 4) transforms to one
    world whose unit is the longest of them, and the camera."""
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
        motions.append(motion / unit)
    pixels = scale * unit
    bottom = HEIGHT - BOTTOM + scale * min(float(span[:, 1].min()) for span in spans)
    matrix = np.column_stack([np.stack([pixels * right, -pixels * up, -back]), [0.0, bottom, 4.0]])
    return centers, motions, Camera(matrix, WIDTH, HEIGHT, back, flat=True)


def size_picture(items: Sequence[SizeItem]) -> bytes:
    """The items side by side as WebP."""
    centers, motions, camera = in_a_row(items)
    camera = camera.magnified(OVERSAMPLING)
    objects = [(item.figure.faces, motion) for item, motion in zip(items, motions, strict=True)]
    drawn = over_ground(objects, camera, background(camera, disc=False))
    image = Image.fromarray(drawn).resize((WIDTH, HEIGHT), Image.Resampling.LANCZOS)
    for center, item in zip(centers, items, strict=True):
        text(image, (center, HEIGHT - 22), item.words[0], 14, INK, "ms")
        text(image, (center, HEIGHT - 7), item.words[1], 12, SOFT_INK, "ms")
    stream = io.BytesIO()
    image.save(stream, "WEBP", quality=80, method=METHOD)
    return stream.getvalue()


AXES_PX = 480
"""Pixels of the picture along its wider side."""
FADED = 0.55
"""Share of the object's own picture that is left white, so that the axes stand out."""
BEYOND, TURN, SLIDE, HEAD = 0.06, 0.07, 0.22, 0.025
"""As shares of the longest edge: how far an axis goes beyond its part, the radius of the arrow around it, the length of
a slider's arrow, and of an arrow's head."""
TEXT_PX, LINE_PX = 19, 4
ARC = np.linspace(0.0, 1.5 * np.pi, 28)
"""Angles of the arrow around a hinge's axis, rad."""
PALE = ("beige", "yellow", "lime", "lavender")
"""Colours that white hides."""
Ink = tuple[int, int, int]
COLORS: list[Ink] = [
    (int(255 * r), int(255 * g), int(255 * b)) for name, (r, g, b) in PALETTE.items() if name not in PALE
]
MOVES = ("revolute", "continuous", "prismatic")


def axes_picture(figure: LoopFigure, view: Path) -> bytes | None:
    """The object's perspective ``view``, which its run drew as the figure was read, with an arrow for each joint along
    or about its axis, and its name: a WebP. None without such a view, or without joints."""
    joints = [joint for joint in figure.tree if joint.type in MOVES and joint.mimic is None]
    try:
        with Image.open(view) as opened:
            seen = opened.convert("RGB")
    except OSError:
        return None
    if not joints:
        return None
    factor = AXES_PX / max(seen.size)
    seen = seen.resize((round(factor * seen.width), round(factor * seen.height)), Image.Resampling.LANCZOS)
    image = Image.blend(seen, Image.new("RGB", seen.size, "white"), FADED)
    camera = view_camera("perspective", figure.faces.points, figure.scene.front, *image.size)

    def pixels(points: Array) -> list[tuple[float, float]]:
        return [(x, y) for x, y in camera.project(points.T)[:2].T.tolist()]

    pen, font = ImageDraw.Draw(image), ImageFont.load_default(TEXT_PX)
    taken = Image.new("L", image.size)
    tags: list[tuple[TreeJoint, Ink, tuple[float, float]]] = []
    for joint, color in zip(joints, COLORS * (len(joints) // len(COLORS) + 1), strict=False):
        arrows = [pixels(line) for line in axis_lines(joint, figure)]
        tags.append((joint, color, arrows[0][1]))
        for draw, ink, width in (
            (ImageDraw.Draw(taken), 255, LINE_PX), (pen, (255, 255, 255), LINE_PX + 3), (pen, color, LINE_PX)
        ):  # fmt: skip
            for arrow in arrows:
                draw.line(arrow, fill=ink, width=width, joint="curve")
    # A name hides no arrow where there is room beside it.
    cost = 1e-5 + np.asarray(taken, dtype=float) / 255.0
    placed: list[Box] = []
    for joint, color, (x, y) in tags:
        left, _, right, bottom = pen.textbbox((0, 0), joint.name, font=font)
        size = (round(right - left) + 2 * MARGIN, round(bottom) + 2 * MARGIN)
        box = tag_box((round(x), round(y)), size, cost, placed)
        if box is not None:
            placed.append(box)
            pen.rectangle(box, fill=(255, 255, 255), outline=color, width=2)
            pen.text((box[0] + MARGIN, box[1] + MARGIN - 1), joint.name, fill=(0, 0, 0), font=font)
    stream = io.BytesIO()
    image.save(stream, "WEBP", quality=82, method=2)
    return stream.getvalue()


def axis_lines(joint: TreeJoint, figure: LoopFigure) -> list[Array]:
    """Lines of (n, 3) points in the root frame, m: the axis, from which end to which it points, then its arrow."""
    pose, unit = figure.links_to_root[joint.child], figure.size_m
    axis = pose[:3, :3] @ joint.axis
    origin = pose[:3, 3]
    side = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    side /= np.linalg.norm(side)
    other = np.cross(axis, side)
    points = origin[None]
    if joint.child in figure.faces.links:
        points = figure.faces.corners[figure.faces.link == figure.faces.links.index(joint.child)].reshape(-1, 3)
    if joint.type == "prismatic":
        start = 0.5 * (points.min(axis=0) + points.max(axis=0))
        end = start + SLIDE * unit * axis
        head = [end - HEAD * unit * (axis + turn * 0.6 * side) for turn in (1.0, -1.0)]
        return [np.array([start, end]), np.array([head[0], end, head[1]])]
    along = (points - origin) @ axis
    low, high = along.min() - BEYOND * unit, along.max() + BEYOND * unit
    ends = origin + np.outer([low, high], axis)
    radius = TURN * unit
    arc = ends[1] - 0.5 * BEYOND * unit * axis + radius * (np.outer(np.cos(ARC), side) + np.outer(np.sin(ARC), other))
    onward = arc[-1] - arc[-2]
    onward /= np.linalg.norm(onward)
    outward = (arc[-1] - ends[1]) / np.linalg.norm(arc[-1] - ends[1])
    head = [arc[-1] - HEAD * unit * (onward + turn * 0.6 * outward) for turn in (1.0, -1.0)]
    return [ends, arc, np.array([head[0], arc[-1], head[1]])]
