"""An object's size in a sentence, and the scale that gives it its usual or asked size."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from asset2sim.guidance import tables
from asset2sim.guidance.amounts import LARGEST_M, LEAST_SCALE, MOST_SCALE, plain_guidance
from asset2sim.guidance.edges import fitted_kind
from asset2sim.guidance.lexicon import HEAD_ENDS, Segment, head_of, longest_spans, noun_spans, place_of
from asset2sim.guidance.object_info import ObjectInfo, Vector
from asset2sim.guidance.parts import depth_width_height
from asset2sim.guidance.tables import Size
from schemas.authored import KEPT_AS_ASKED, MASSES_FIT, UNLIKE_UNITS
from schemas.guidance import AskedLength, AskedScale, AskedSize, SizeWord
from schemas.support import Mount, SupportProposal

KEEP_WITHIN = 0.2
"""An object that is within this share of the asked size is taken to be in real metres already."""
REAL_SLACK = 1.5
"""Factor by which an object that its user calls real-sized may be outside the table's range."""
METRIC_SLACK = 5.0
"""Factor by which an object whose file is in metres may be outside the table's range: toys, and models for a robot."""
NORMALISED_M = 0.45
"""Longest edge under which no dataset normalises its objects (a unit cube or sphere, 0.5 to 2): one that is smaller,
and of a usual size for its kind, is in metres."""
DEEPEST = 4.0 / 3.0
"""Depth over width from which a kitchen appliance (0.55 to 0.68 m deep at 0.6 m, EN 1116) has its front along y."""
TABLETOP_M = 0.36
"""Longest edge of a thing of usual size that is handled on a table, m: 0.27 m for a small one, 0.20 m for a very small
one, the upper end of the paper's 0.10 to 0.20 m."""
ABOUT_MOTION = frozenset(("damping", "damped", "friction"))
"""Kinds of phrases by which a word of size is about how a part moves ("a little friction") ..."""
ABOUT_PARTS = frozenset(("part", "parts"))
"""... and by which it is about a part."""
MEASURING = frozenset(("size", "sized", "measures", "measuring", "scale", "scaled"))
"""Words beside which a length is that of the object ..."""
LONGEST = frozenset(("long", "length", "across", "diameter"))
"""... and those after it that mean its longest edge."""
RANGE_SIGMAS = 4.0
"""σ between the least and the most size of a category, which nearly all of its objects are within."""
_REAL = re.compile(r"(?=\b(real|actual|true|life|original|full) size)")
_FULL = "full"
"""A "full size" may be that of another thing of its kind, and says nothing of this one."""
_NUMBERS = frozenset(("number", "mass"))
_ALONE = re.compile(r"(?:about |approximately |roughly |around )?\d[\d.]* ?(?:m|cm|mm|inch(?:es)?)")
_SCALE = re.compile(r"\bscal(?:e|ed)(?:\s+(?:factor|of|to|by|is|it))*\s*[:=]?\s*(\d++(?:\.\d++)?+)(?!\s*(?:cm|mm|m)\b)")


def asked_size(guidance: str, tokens: tuple[str, ...], statements: Sequence[Segment]) -> AskedSize:
    """All that the guidance says of the object's size."""
    return AskedSize(
        scale=_scale(guidance),
        lengths=_lengths(statements),
        words=_size_words(tokens, statements),
        real=tuple(_REAL.findall(" ".join(tokens))),
        kinds=named_kinds(tokens),
    )


def named_kinds(tokens: tuple[str, ...]) -> tuple[str, ...]:
    """The kinds with proportions of their own that the first phrase of the guidance names."""
    kinds = {tuple(kind.kind.split()): kind.kind for rows in tables.proportions().values() for kind in rows}
    return tuple(kind for _, _, kind in longest_spans(head_of(tokens), kinds))


def _scale(guidance: str) -> AskedScale | None:
    found = _SCALE.search(plain_guidance(guidance))
    if found is None or not LEAST_SCALE <= float(found.group(1)) <= MOST_SCALE:
        return None
    return AskedScale(words=found.group(1), value=float(found.group(1)))


def _lengths(statements: Sequence[Segment]) -> tuple[AskedLength, ...]:
    return tuple(
        AskedLength(
            metres=item.number,
            following=item.value if item.kind == "size" else _following(segment.tokens[item.end - segment.start :]),
            beside=("size",) if item.kind == "size" else tuple(sorted((MEASURING | LONGEST) & set(segment.tokens))),
            **place_of(segment),
        )
        for segment in statements
        for item in segment.of("size", *(() if segment.of("part", "parts", "open", "closed") else ("length",)))
        if item.number > 0.0
    )


def _following(tokens: tuple[str, ...]) -> str:
    """The word that says which edge a length is about, "" for none: "tall", "in height"."""
    return "".join(tokens[1:2] if tokens[:1] == ("in",) else tokens[:1])


def _size_words(tokens: tuple[str, ...], statements: Sequence[Segment]) -> tuple[SizeWord, ...]:
    end = next((i for i, token in enumerate(tokens) if token in HEAD_ENDS - {","} and i > 0), len(tokens))
    table = {phrase: " ".join(phrase) for phrase in tables.size_words()}
    return tuple(
        SizeWord(
            words=name,
            at=segment.start + start,
            factor=tables.size_words()[tuple(name.split())],
            beside=tuple(sorted({item.kind for item in segment.items})),
            place="first" if segment.start == 0 else "head" if segment.start < end else "later",
        )
        for segment in statements
        for start, stop, name in longest_spans(segment.tokens, table)
        if name not in {item.value for item in segment.of("share")}  # "45% of its travel"
        if not makes_another_kind(segment.tokens, start, stop)
    )


def makes_another_kind(tokens: tuple[str, ...], start: int, stop: int) -> bool:
    """Whether a word of size belongs to the name of a kind that has a size of its own: a mini oven is no oven."""
    return any(
        first == start and any(rest != kind for _, _, rest in noun_spans(tokens[stop:last]))
        for first, last, kind in noun_spans(tokens)
        if stop < last
    )


@dataclass(frozen=True)
class Scale:
    """A uniform scale, whether the user asked for it, the object's length at that scale (m), the reason, and the
    relative ``sigma`` of what is neither stated nor kept, 0 for what is."""

    value: float
    asked: bool
    final_m: float
    note: str
    sigma: float = 0.0


def propose_scale(info: ObjectInfo, size: Size, asked: AskedSize, carried: SupportProposal | None = None) -> Scale:
    """The uniform scale: stated in numbers, else 1 where the authored size is right already, else the table's size, of
    what hangs on a wall where words say that it is ``carried`` so."""
    authored = dimension(info, size)
    stated = stated_scale(info, asked)
    if stated is not None:
        value, note = stated
        return Scale(value, True, authored * value, note)
    real = asks_real_size(asked)
    if keeps_size(info, size, asked):
        return Scale(1.0, real, authored, f"scale 1: {info.lengths}")
    phrase, factor = size_word(asked)
    if not phrase and usual_as_it_is(info, size):
        return Scale(1.0, real, authored, f"scale 1: {authored:.3g} m is usual, and less than what is normalised")
    hangs = carried is not None and carried.mount is Mount.WALL
    fit = fitted_kind(info, size.category, asked.kinds, hangs=hangs)
    fit = None if fit is not None and fit.category not in ("", size.category) else fit  # words say that it is none
    usual = size.typical_m if fit is None else min(max(fit.scale * authored, size.min_m), size.max_m)
    target = usual * factor
    if authored <= 0.0:
        return Scale(1.0, real, size.typical_m, "scale 1: the object has no size to compare")
    if real and size.min_m / REAL_SLACK <= authored <= size.max_m * REAL_SLACK:
        return Scale(1.0, True, authored, f"scale 1: real size, and {authored:.3g} m is plausible")
    # A normalised dataset's furniture is metres long by chance: only what is near the typical size counts as real.
    within = KEEP_WITHIN if fit is None else min(KEEP_WITHIN, fit.sigma)
    fits = abs(authored / target - 1.0) <= within and size.min_m * factor <= authored <= size.max_m * factor
    widest = narrow_enough(info, size) * factor
    fits, target = fits and authored <= widest, min(target, widest, tabletop_limit(info, size, phrase) * factor)
    if fits and size.category != "*":
        told = f"scale 1: {authored:.3g} m is plausible for {size.category}"
        return Scale(1.0, bool(phrase) or real, authored, told, KEEP_WITHIN)
    value = min(max(target / authored, LEAST_SCALE), MOST_SCALE)
    word = f", '{phrase}' × {factor:g}" if phrase else ""
    by = "" if fit is None else f", of the edges of a {fit.kind} (± {fit.sigma:.0%})"
    note = f"scale: {size.category} {size.dimension} {target / factor:.3g} m{by}{word}, authored {authored:.3g} m"
    sigma = math.log(size.max_m / size.min_m) / RANGE_SIGMAS if fit is None else fit.sigma
    return Scale(float(f"{value:.4g}"), bool(phrase) or real, authored * value, note, round(sigma, 3))


def keeps_size(info: ObjectInfo, size: Size, asked: AskedSize) -> bool:
    """Whether the authored size stays: its lengths are metres, no words ask for another size, and its masses fit it or
    it is not far from all things of its kind, where that is stated: the handle of a door is called so, and no door."""
    authored = dimension(info, size)
    if not info.lengths or stated_scale(info, asked) is not None or size_word(asked)[0]:
        return False
    if info.lengths == KEPT_AS_ASKED or MASSES_FIT in info.lengths:
        return True
    unsure = info.lengths == UNLIKE_UNITS
    slack = REAL_SLACK if unsure and not asks_real_size(asked) else METRIC_SLACK
    return (not info.category and not unsure) or size.min_m / slack <= authored <= size.max_m * slack


def usual_as_it_is(info: ObjectInfo, size: Size) -> bool:
    """Whether an object of unknown units is smaller than what is normalised, and about usual for its kind in metres."""
    most = REAL_SLACK * min(size.max_m, narrow_enough(info, size))
    usual = size.min_m / REAL_SLACK <= dimension(info, size) <= most
    return usual and 0.0 < max(info.size_closed_m) < NORMALISED_M


def dimension(info: ObjectInfo, size: Size) -> float:
    """The authored length, m, that the table's typical size is compared with."""
    if size.dimension == "height" and info.size_closed_m[2] > 0.0:
        return info.size_closed_m[2]
    if size.dimension == "width" and info.size_closed_m[1] > 0.0:
        depth, width, _ = depth_width_height(info)
        return depth if depth > DEEPEST * width else width
    if size.dimension == "body" and info.body is not None and max(info.body.box_m) > 0.0:
        return max(info.body.box_m)
    return max(info.size_closed_m)


def tabletop_limit(info: ObjectInfo, size: Size, word: str) -> float:
    """The largest ``dimension``, m, of a thing of usual size of which the guidance says that it is small, by such a
    ``word``: it is handled on a table, closed or as its file has it; infinite for other words."""
    longest = max(*info.size_closed_m, *info.size_m)
    if word not in tables.tabletop_words() or longest <= 0.0:
        return math.inf
    return TABLETOP_M * dimension(info, size) / longest


def narrow_enough(info: ObjectInfo, size: Size) -> float:
    """The largest ``dimension``, m, at which the object is not wider than its category allows; infinite for any."""
    across = sorted(info.size_closed_m)[1]
    if not size.across_max_m or across <= 0.0:
        return math.inf
    return size.across_max_m * dimension(info, size) / across


def asks_real_size(asked: AskedSize) -> bool:
    """Whether the guidance asks for the size of the real thing."""
    return any(word != _FULL for word in asked.real)


def size_word(asked: AskedSize) -> tuple[str, float]:
    """The smallest of the words about the object's size, or the largest if all are above 1; ("", 1) without any. Words
    about a part ("a large drawer") or about damping are not about the object: the first phrase counts, and of the rest
    only statements about nothing else."""
    elsewhere = {"first": ABOUT_MOTION, "head": ABOUT_MOTION | ABOUT_PARTS}
    return extreme_word(
        [word for word in asked.words if not set(word.beside) & elsewhere.get(word.place, set(word.beside) - _NUMBERS)]
    )


def extreme_word(words: Sequence[SizeWord]) -> tuple[str, float]:
    """The smallest word of size and its factor, or the largest if all are above 1; ("", 1) for none."""
    if not words:
        return "", 1.0
    extreme = min if min(word.factor for word in words) < 1.0 else max
    found = extreme(words, key=lambda word: word.factor)
    return found.words, found.factor


def stated_scale(info: ObjectInfo, asked: AskedSize) -> tuple[float, str] | None:
    """The scale that the guidance states in numbers, as such or as a length of the object, and how; None without."""
    if asked.scale is not None:
        return asked.scale.value, f"scale {asked.scale.words}: as the guidance states"
    for length in asked.lengths:
        if not is_of_object(length):
            continue
        authored, longest = edge_m(info.size_closed_m, length.following), max(info.size_closed_m)
        if authored > 0.0 and length.metres * longest > LARGEST_M * authored:
            authored = longest  # "1.2 m tall" of a broom that lies
        if authored > 0.0:
            value = min(max(length.metres / authored, LEAST_SCALE), MOST_SCALE)
            return value, f"scale: {length.metres:.3g} m {length.following or 'in size'}, as the guidance states"
    return None


def is_of_object(length: AskedLength) -> bool:
    """Whether a length is one of the object: a word says of which edge, or of measuring, or it is all that is said
    between two commas ("a suitcase, 55 cm, 3 kg")."""
    told = length.following in LONGEST or length.following in EDGES or bool(MEASURING & set(length.beside))
    return told or _ALONE.fullmatch(length.words) is not None


EDGES = {
    **dict.fromkeys(("tall", "high", "height"), "z"),
    **dict.fromkeys(("wide", "width"), "wider"),
    **dict.fromkeys(("deep", "depth"), "narrower"),
}
"""Word after a stated length → the edge that it is about; any other means the longest."""


def edge_m(size_m: Vector, following: str) -> float:
    """The edge, m, that a length is about which ``following`` follows: "30 cm tall" the height, "20 cm wide" the wider
    side; the longest for other words."""
    x, y, z = size_m
    return {"z": z, "wider": max(x, y), "narrower": min(x, y)}.get(EDGES.get(following, ""), max(size_m))
