"""The loops and the size picture of one object: raw beside refined, from the same view, in step."""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, floor

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from asset2sim.physics.arrays import Array
from asset2sim.render.camera import view_directions
from asset2sim.render.cloud import Cloud, cloud_of
from asset2sim.render.draw import Picture, background, image_of, pictures
from asset2sim.render.zbuffer import FOV, Lens, Singles, changing_frames, lens_for
from asset2sim.report.loops.figure import LoopFigure

SIDE = 160
"""Edge of one of the two pictures side by side, pixels: a page shows both 320 wide, and time goes with the square.
Pictures are drawn at the size at which the page shows them, without supersampling."""
SPACING = 0.75
"""Distance between two points, in pixels: any pixel of a surface has one."""
KEYS = 4
"""Frames of each picture at which is found out what is seen."""
ROOM = np.array([1.2, 1.2, 1.7])
"""How far from where it starts a raw object is followed, in its longest edges: what explodes leaves the picture."""
QUALITIES, METHOD = (70, 40), 0
"""WebP's quality, the second where the file is else too large, and effort, 0 to 6: at 1 files are an eighth smaller
and take a fifth longer."""
WHOLE = {"kmin": 0, "kmax": 0}
"""No frame but the first is whole: in loops this short the others leave nothing behind that is worse than WebP's own
errors, and Pillow's every 3 to 5 has the encoder try three of five twice."""
MOST_BYTES = 150_000
INK, SOFT_INK = (62, 70, 82), (120, 128, 140)
LINE, EMPTY = (255, 255, 255), (226, 230, 236)
"""Colours of the line between the two pictures, and of one that shows nothing."""
FIRST, LAST = 6, 10
"""How many times as long as the others the first and the last frame are shown."""


Clouds = dict[int, Cloud]
"""The ``id`` of a figure's triangles → the cloud of them."""
Drawn = dict[int, list[tuple[Singles, Picture]]]
"""The same → what is drawn of them in one loop: transforms and picture."""


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


def lens_of(scenes: Scenes) -> Lens:
    """The lens that shows everything that happens in a loop, but what flies away."""
    points = []
    for act in scenes.acts:
        if act is not None:
            points.append(in_room(act.figure.spanned(act.motions[changing_frames(act.motions)])))
    towards = view_directions(scenes.acts[1].figure.scene.front)["perspective"]
    return lens_for(np.concatenate(points).astype(np.float32), towards.astype(np.float32), SIDE, SIDE)


def in_room(points: Array) -> Array:
    """(n, 3) points, those that are further off than an object is followed moved to the border of that."""
    return np.clip(points, [-ROOM[0], -ROOM[1], -0.15], ROOM)


def clouds_of(
    films: Sequence[Scenes], lenses: Sequence[Lens], still: Sequence[tuple[LoopFigure, Singles, Lens]]
) -> Clouds:
    """The clouds of everyone's triangles for the loops, and of who is in none for a still picture, in which each is at
    (links, 3, 4) transforms."""
    views: dict[int, list[tuple[Singles, Lens]]] = {}
    figures: dict[int, LoopFigure] = {}
    finest: dict[int, float] = {}
    for scenes, lens in zip(films, lenses, strict=True):
        for act in scenes.acts:
            if act is None:
                continue
            key = id(act.figure.faces)
            figures[key] = act.figure
            chosen = changing_frames(act.motions)
            keys = [chosen[round(share * (len(chosen) - 1))] for share in np.linspace(0.0, 1.0, min(KEYS, len(chosen)))]
            views.setdefault(key, []).extend((act.motions[frame], lens) for frame in keys)
            spanned = in_room(act.figure.spanned(act.motions[keys]))
            nearest = float(lens.project(spanned.T.astype(np.float32))[2].min())
            pixels = 0.5 * lens.height / np.tan(0.5 * FOV) / nearest
            finest[key] = min(finest.get(key, np.inf), SPACING / pixels)
    for figure, motion, lens in still:
        key = id(figure.faces)
        if key not in figures:
            figures[key] = figure
            finest[key] = SPACING / (lengthening(lens, motion) * figure.faces.size_m)
            views[key] = [(motion, lens)]
    return {
        key: cloud_of(figure.faces, finest[key] * figure.faces.size_m, views[key]) for key, figure in figures.items()
    }


def lengthening(lens: Lens, motion: Singles) -> float:
    """Pixels a metre of triangles that are drawn at these (links, 3, 4) transforms through a ``flat`` lens."""
    return float(np.linalg.norm(lens.matrix[0, :3]) * np.cbrt(np.linalg.det(motion[0, :, :3])))


def filmed(scenes: Scenes, lens: Lens, clouds: Clouds) -> bytes:
    """A loop as an animated WebP."""
    frames = len(scenes.acts[1].motions)
    sheets = [Image.new("RGB", (2 * SIDE, SIDE)) for _ in range(frames)]
    drawn: Drawn = {}
    for left, act, name in zip((0, SIDE), scenes.acts, ("raw", "refined"), strict=True):
        for sheet, picture in zip(sheets, panels(act, name, lens, clouds, frames, drawn), strict=True):
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


def panels(act: Act | None, name: str, lens: Lens, clouds: Clouds, frames: int, drawn: Drawn) -> Iterator[Image.Image]:
    """One of the two pictures of a loop, frame by frame; of what the other one has ``drawn`` nothing is drawn again."""
    if act is None:
        empty = Image.new("RGB", (SIDE, SIDE), EMPTY)
        yield from [captioned(empty, name, "cannot be shown")] * frames
        return
    key, panel = id(act.figure.faces), {}
    ground, known = background(lens, disc=True), drawn.setdefault(key, [])
    for picture in pictures(clouds[key], act.motions, lens, ground, known):
        if id(picture) not in panel:
            panel[id(picture)] = captioned(image_of(picture), name, act.word)
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
    """Words as a mask, and where its upper left corner lies from where the words are anchored, pixels: the same ones
    are written on most frames."""
    font = ImageFont.load_default(size=size)
    pen = ImageDraw.Draw(Image.new("L", (1, 1)))
    left, top, right, bottom = pen.textbbox((0, 0), words, font=font, anchor=anchor)
    corner = floor(left), floor(top)
    mask = Image.new("L", (ceil(right) - corner[0], ceil(bottom) - corner[1]))
    ImageDraw.Draw(mask).text((-corner[0], -corner[1]), words, fill=255, font=font, anchor=anchor)
    return mask, *corner
