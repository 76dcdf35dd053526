"""Frames of a film for a judge: spread evenly, with their times, as pictures that say nothing but what they show."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from asset2sim.render import png_bytes
from schemas.errors import Asset2SimError, UsageError

if TYPE_CHECKING:
    from av import VideoFrame

CHANGED_LEVELS, CHANGED_SHARE = 16, 4e-4
"""A frame is another picture where more than this share of its pixels differs by more than so many of 255 levels of a
colour: less is the film's compression."""

Pixels = np.ndarray[tuple[int, ...], np.dtype[np.uint8]]
"""(height, width, 3) levels of red, green and blue."""


class UnreadableFilmError(Asset2SimError):
    """A film cannot be decoded; the message names the file."""


@dataclass(frozen=True)
class FilmFrame:
    """One picture of a film: its time from the start, the film's length, s, and a PNG without metadata."""

    time_s: float
    length_s: float
    png: bytes


def sampled_frames(film: Path, count: int, side_px: int) -> tuple[FilmFrame, ...]:
    """``count`` frames of a film, or all of one that shows fewer, ``chosen`` evenly; their longest side at most
    ``side_px``. The same film gives the same bytes. Raises UnreadableFilmError, and UsageError where the package ``av``
    is not installed."""
    try:
        import av
    except ImportError:
        raise UsageError("reading films needs the package av: pip install ./lab") from None
    try:
        with av.open(str(film)) as container:
            found = list(container.decode(video=0))
    except (av.FFmpegError, OSError, ValueError, IndexError) as error:
        raise UnreadableFilmError(f"{film} cannot be read ({error}); record it anew") from error
    if not found:
        raise UnreadableFilmError(f"{film} holds no picture; record it anew")
    small = [_pixels(frame)[::2, ::2].copy() for frame in found]
    start, end = (float(frame.time or 0.0) for frame in (found[0], found[-1]))
    frames = []
    for index in chosen(small, count):
        time_s = float(found[index].time or 0.0) - start
        frames.append(FilmFrame(time_s, end - start, _png(_pixels(found[index]), side_px)))
    return tuple(frames)


def chosen(pictures: Sequence[Pixels], count: int) -> tuple[int, ...]:
    """Which frames of a film are shown: the first, the last, and between them evenly those that are another picture
    than the one before, so that none is spent on an arm that waits. All of a film without motion count."""
    changing = [0]
    for index, picture in enumerate(pictures):
        change = np.abs(picture.astype(np.int16) - pictures[changing[-1]]).max(axis=-1)
        if float((change > CHANGED_LEVELS).mean()) > CHANGED_SHARE:
            changing.append(index)
    if len(changing) < count:
        changing = list(range(len(pictures)))
    changing[-1] = len(pictures) - 1
    return tuple(changing[place] for place in np.unique(np.linspace(0, len(changing) - 1, count).round().astype(int)))


def _pixels(frame: "VideoFrame") -> Pixels:
    return np.asarray(frame.to_ndarray(format="rgb24"), dtype=np.uint8)


def _png(pixels: Pixels, side_px: int) -> bytes:
    """A PNG of the pixels alone: nothing of the film's metadata is handed on."""
    picture = Image.fromarray(pixels)
    picture.thumbnail((side_px, side_px), Image.Resampling.LANCZOS)
    return png_bytes(picture)
