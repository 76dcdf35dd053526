"""Frames of a film for a judge: sampled evenly, with their times, as pictures that say nothing but what they show."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from asset2sim.assets.views import png_bytes
from schemas.errors import Asset2SimError, UsageError


class UnreadableFilmError(Asset2SimError):
    """A film cannot be decoded; the message names the file."""


@dataclass(frozen=True)
class Frame:
    """One picture of a film: its time from the start, the film's length, s, and a PNG without metadata."""

    time_s: float
    length_s: float
    png: bytes


def sampled_frames(film: Path, count: int, side_px: int) -> tuple[Frame, ...]:
    """``count`` frames at even intervals, the first and the last among them, or all of a film that has fewer; their
    longest side at most ``side_px``. The same film gives the same bytes. Raises UnreadableFilmError, and UsageError
    where the package ``av`` is not installed."""
    try:
        import av
    except ImportError:
        raise UsageError("reading films needs the package av: pip install 'asset2sim[judged]'") from None
    try:
        with av.open(str(film)) as container:
            found = list(container.decode(video=0))
    except (av.FFmpegError, OSError, ValueError, IndexError) as error:
        raise UnreadableFilmError(f"{film} cannot be read ({error}); record it anew") from error
    if not found:
        raise UnreadableFilmError(f"{film} holds no picture; record it anew")
    start, end = (float(frame.time or 0.0) for frame in (found[0], found[-1]))
    chosen = np.unique(np.linspace(0, len(found) - 1, count).round().astype(int))
    return tuple(
        Frame(
            float(found[index].time or 0.0) - start, end - start, _png(found[index].to_ndarray(format="rgb24"), side_px)
        )
        for index in chosen
    )


def _png(pixels: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], side_px: int) -> bytes:
    """A PNG of the pixels alone: nothing of the film's metadata is handed on."""
    picture = Image.fromarray(pixels)
    picture.thumbnail((side_px, side_px), Image.Resampling.LANCZOS)
    return png_bytes(picture)
