"""The loops and the size picture of one object: raw beside refined, from the same view, in step."""

import io
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, floor

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from asset2sim.physics.arrays import Array
from asset2sim.render.camera import FILM_FOV, Camera, Singles, fitted_camera, view_directions
from asset2sim.render.draw import Picture, pictures
from asset2sim.render.sight import ALIKE
from asset2sim.report.loops.figure import LoopFigure

SIDE = 160
"""Edge of one of the two pictures side by side, pixels: a page shows both 320 wide, and time goes with the square.
Pictures are drawn at the size at which the page shows them, without supersampling."""
ROOM = np.array([1.2, 1.2, 1.7])
"""How far from where it starts a raw object is followed, in its longest edges: what explodes leaves the picture."""
QUALITIES, METHOD = (70, 40), 0
"""WebP's quality, the second for too large files, and effort, 0 to 6: at 1 files are 1/8 smaller and 1/5 slower."""
WHOLE = {"kmin": 0, "kmax": 0}
"""No frame but the first is whole: in loops this short the others leave nothing behind that is worse than WebP's own
errors, and Pillow's every 3 to 5 has the encoder try three of five twice."""
MOST_BYTES = 150_000
INK, SOFT_INK = (62, 70, 82), (120, 128, 140)
LINE, EMPTY = (255, 255, 255), (226, 230, 236)
"""Colours of the line between the two pictures, and of one that shows nothing."""
FIRST, LAST = 6, 10
"""How many times as long as the others the first and the last frame are shown."""


Drawn = dict[int, list[tuple[Singles, Picture]]]
"""The ``id`` of a figure's triangles → what is drawn of them in one loop: transforms and picture."""


@dataclass(frozen=True, eq=False)
class Act:
    """One of the two pictures of a loop: a figure at (frames, links, 3, 4) transforms to the world that is
    drawn, and a word if something ended it."""

    figure: LoopFigure
    motions: Singles
    word: str = ""


@dataclass(frozen=True, eq=False)
class Scenes:
    """One loop: its ``name``, who plays in it, raw first, None where there is none, the times of its frames, s, None
    where there is no clock, and how long each is shown, ms."""

    name: str
    acts: tuple[Act | None, Act]
    times_s: Array | None
    shown_ms: int


def camera_of(scenes: Scenes) -> Camera:
    """The camera that shows everything that happens in a loop, but what flies away."""
    points = []
    for act in scenes.acts:
        if act is not None:
            spanned = act.figure.spanned(act.motions[changing_frames(act.motions)])
            points.append(np.clip(spanned, [-ROOM[0], -ROOM[1], -0.15], ROOM))
    towards = view_directions(scenes.acts[1].figure.scene.front)["perspective"]
    return fitted_camera(np.concatenate(points), towards, FILM_FOV, SIDE, SIDE)


def changing_frames(motions: Singles) -> list[int]:
    """The frames of (frames, links, 3, 4) transforms that show another picture than the one before."""
    chosen = [0]
    for frame in range(1, len(motions)):
        if np.abs(motions[frame] - motions[chosen[-1]]).max() > ALIKE:
            chosen.append(frame)
    return chosen


def filmed(scenes: Scenes) -> bytes:
    """A loop as an animated WebP."""
    camera = camera_of(scenes)
    frames = len(scenes.acts[1].motions)
    sheets = [Image.new("RGB", (2 * SIDE, SIDE)) for _ in range(frames)]
    drawn: Drawn = {}
    for left, act, name in zip((0, SIDE), scenes.acts, ("raw", "refined"), strict=True):
        for sheet, picture in zip(sheets, panels(act, name, camera, frames, drawn), strict=True):
            sheet.paste(picture, (left, 0))
    for number, sheet in enumerate(sheets):
        sheet.paste(LINE, (SIDE - 1, 0, SIDE + 1, SIDE))
        if scenes.times_s is not None:
            text(sheet, (2 * SIDE - 8, SIDE - 8), f"{scenes.times_s[number]:.2f} s", 12, SOFT_INK, "rs")
    shown = scenes.shown_ms
    durations = [FIRST * shown, *[shown] * (frames - 2), LAST * shown]
    found = b""
    for quality in QUALITIES:
        stream = io.BytesIO()
        options = {"save_all": True, "append_images": sheets[1:], "duration": durations, "loop": 0}
        sheets[0].save(stream, "WEBP", quality=quality, method=METHOD, **options, **WHOLE)
        found = stream.getvalue()
        if len(found) <= MOST_BYTES:
            break
    return found


def panels(act: Act | None, name: str, camera: Camera, frames: int, drawn: Drawn) -> Iterator[Image.Image]:
    """One of the two pictures of a loop, frame by frame; of what the other one has ``drawn`` nothing is drawn again."""
    if act is None:
        empty = Image.new("RGB", (SIDE, SIDE), EMPTY)
        yield from [captioned(empty, name, "cannot be shown")] * frames
        return
    faces, panel = act.figure.faces, {}
    for picture in pictures(faces, act.motions, camera, drawn.setdefault(id(faces), [])):
        if id(picture) not in panel:
            panel[id(picture)] = captioned(Image.fromarray(picture), name, act.word)
        yield panel[id(picture)]


def captioned(image: Image.Image, name: str, word: str) -> Image.Image:
    """The picture with a name at its upper left, and a word below that."""
    text(image, (9, 20), name, 13, INK, "ls")
    if word:
        text(image, (9, 36), word, 11, SOFT_INK, "ls")
    return image


def text(
    image: Image.Image, xy: tuple[float, float], words: str, size: int, ink: tuple[int, int, int], anchor: str
) -> None:
    """Write words on a picture."""
    mask, left, top = stamp(words, size, anchor)
    image.paste(ink, (round(xy[0]) + left, round(xy[1]) + top), mask)


@lru_cache(maxsize=256)
def stamp(words: str, size: int, anchor: str) -> tuple[Image.Image, int, int]:
    """Words as a mask, and its upper left corner from their anchor, pixels: most frames have the same ones."""
    font = ImageFont.load_default(size=size)
    pen = ImageDraw.Draw(Image.new("L", (1, 1)))
    left, top, right, bottom = pen.textbbox((0, 0), words, font=font, anchor=anchor)
    corner = floor(left), floor(top)
    mask = Image.new("L", (ceil(right) - corner[0], ceil(bottom) - corner[1]))
    ImageDraw.Draw(mask).text((-corner[0], -corner[1]), words, fill=255, font=font, anchor=anchor)
    return mask, *corner
