"""The picture of an object's joints: about or along what each moves, and which way counts as positive."""

import io
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from asset2sim.guidance.link_colors import PALETTE
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint
from asset2sim.render.camera import WIDE_FOV, camera_axes, fitted_camera, view_directions
from asset2sim.render.name_tags import MARGIN, Box, tag_box
from asset2sim.report.loops.figure import LoopFigure

WIDTH = 480
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
    factor = WIDTH / max(seen.size)
    seen = seen.resize((round(factor * seen.width), round(factor * seen.height)), Image.Resampling.LANCZOS)
    image = Image.blend(seen, Image.new("RGB", seen.size, "white"), FADED)
    towards = view_directions(figure.scene.front)["perspective"]
    camera = fitted_camera(figure.faces.corners.reshape(-1, 3), towards, WIDE_FOV, image.width / image.height)
    frame, focal = camera_axes(towards), 0.5 * image.height / np.tan(0.5 * camera.fov)

    def pixels(points: Array) -> list[tuple[float, float]]:
        right, up, back = ((points - camera.eye) @ frame.T).T
        return [(0.5 * image.width + x, 0.5 * image.height - y) for x, y in (focal * np.stack([right, up]) / -back).T]

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
