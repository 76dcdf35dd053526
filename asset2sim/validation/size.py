"""Bound the proposed scale by the usual size of the object's category and by the user's words."""

from dataclasses import dataclass

from asset2sim.guidance import tables
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.sizing import (
    KEEP_WITHIN,
    REAL_SLACK,
    asks_real_size,
    dimension,
    keeps_size,
    narrow_enough,
    size_word,
    stated_scale,
    usual_as_it_is,
)
from asset2sim.guidance.tables import Size
from schemas.authored import KEPT_AS_ASKED
from schemas.finding import Notes
from schemas.guidance import AskedSize, Guidance
from schemas.overlay import Overlay

HAND_M = 0.10
"""Least length for handling on a table, m (paper: 0.10 to 0.20 m); a word like "small" may ask for it of anything."""
STATED_SHARE = 0.05
"""How far a scale may be from the one that the user states in numbers: models round."""

DIGITS = 5e-4
"""Relative rounding slack at a bound: scales are proposed with four digits."""
DIMENSIONS = {"longest": "longest edge", "height": "height", "width": "width", "body": "body"}
"""The dimension by which a category's size is given, in words."""


@dataclass(frozen=True)
class SizeBounds:
    """Smallest and largest allowed final ``dimension`` of the object, m, and ``why``; ``exact`` is the size that the
    user states, None where there is none; ``asked``: the words ask for a size at all."""

    low_m: float
    high_m: float
    why: str
    exact: float | None = None
    asked: bool = True


def with_sensible_size(info: ObjectInfo, guidance: Guidance, overlay: Overlay, notes: Notes) -> Overlay:
    """The overlay with its scale moved to the nearest size that the object's kind and the user's words allow. An object
    of unknown category only has to fit into a home."""
    size = tables.sizes()[guidance.category]
    authored = dimension(info, size)
    if authored <= 0.0:
        return overlay
    bounds = size_bounds(info, size, guidance.size)
    far = not size.min_m / REAL_SLACK <= authored <= size.max_m * REAL_SLACK
    if far and bounds.why == info.lengths and size.category != "*" and info.lengths != KEPT_AS_ASKED:
        usual = f"a household {size.category} has {size.min_m:.3g} to {size.max_m:.3g} m"
        message = f"its file's {DIMENSIONS[size.dimension]} of {authored:.3g} m stays: {bounds.why}; {usual}"
        notes.info("size_unusual", f"{message}; if it is one, state its size", value=authored)
    proposed = overlay.scale * authored
    if bounds.low_m * (1.0 - DIGITS) <= proposed <= bounds.high_m * (1.0 + DIGITS):
        return overlay
    nearest = min(max(proposed, bounds.low_m), bounds.high_m) if bounds.exact is None else bounds.exact
    scale = nearest / authored
    message = (
        f"scale {overlay.scale:.4g} makes the object's {DIMENSIONS[size.dimension]} {proposed:.3g} m; {bounds.why} "
        f"allows {bounds.low_m:.3g} to {bounds.high_m:.3g} m; set to {scale:.4g}, {nearest:.3g} m"
    )
    notes.warn("size_unlikely", message, value=proposed, limit=nearest)
    # A number that no words ask for is not the user's, whatever the answer says.
    asked = overlay.asked if bounds.asked else tuple(name for name in overlay.asked if name != "scale")
    return overlay.model_copy(update={"scale": scale, "asked": asked})


def size_bounds(info: ObjectInfo, size: Size, asked: AskedSize) -> SizeBounds:
    """The sizes that the words and the table of household sizes allow.

    In this order: a size or scale that the user states in numbers; the file's own, where it is in metres; the
    category's range times the factor of the user's word of size, which for words like "small" also includes what a hand
    handles on a table; the range itself.
    """
    authored = dimension(info, size)
    stated = stated_scale(info, asked)
    if stated is not None:
        exact = stated[0] * authored
        return SizeBounds(exact * (1.0 - STATED_SHARE), exact * (1.0 + STATED_SHARE), "the user's number", exact)
    if keeps_size(info, size, asked):
        slack = 1.0 + STATED_SHARE
        return SizeBounds(authored / slack, authored * slack, info.lengths, authored, asked=asks_real_size(asked))
    kind = "any household object" if size.category == "*" else f"a household {size.category}"
    if asks_real_size(asked):
        return SizeBounds(size.min_m / REAL_SLACK, size.max_m * REAL_SLACK, f"the real size of {kind}")
    word, factor = size_word(asked)
    widest = narrow_enough(info, size)
    low, high = min(size.min_m, (1.0 - KEEP_WITHIN) * widest) * factor, min(size.max_m, widest) * factor
    if factor < 1.0:
        low = min(low, HAND_M)
    if not word and usual_as_it_is(info, size):
        low, high = min(low, authored), max(high, authored)
    return SizeBounds(low, high, f"'{word}' of {kind}" if word else kind, asked=bool(word))
