"""The object's category, and the scale that gives it its usual or requested size."""

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from asset2sim.guidance import tables
from asset2sim.guidance.amounts import LEAST_SCALE, MOST_SCALE, plain
from asset2sim.guidance.lexicon import Segment, longest_spans, noun_spans, tokenize
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.tables import Size

KEEP_WITHIN = 0.2
"""An object that is within this share of the asked size is taken to be in real metres already."""
REAL_SLACK = 1.5
"""Factor by which an object that its user calls real-sized may be outside the table's range."""
TABLETOP_M = 0.36
"""Longest edge of a thing of usual size that is handled on a table, m: 0.27 m for a small one, 0.20 m for a very small
one, the upper end of the paper's 0.10 to 0.20 m."""
_REAL = ("real size", "real sized", "actual size", "true size", "life size", "life sized", "original size")
_HEAD_ENDS = frozenset((",", ".", ";", ":", "with", "whose", "that", "which", "opening", "having"))
_GENERIC = ("", "*", "Furniture")
_OF_MOTION = frozenset(("damping", "damped", "friction"))
_OF_PARTS = _OF_MOTION | {"part", "parts"}
_NUMBERS = frozenset(("number", "mass"))
_SCALE = re.compile(r"\bscal(?:e|ed)(?:\s+(?:factor|of|to|by|is|it))*\s*[:=]?\s*(\d++(?:\.\d++)?+)(?!\s*(?:cm|mm|m)\b)")


@dataclass(frozen=True)
class Scale:
    """A uniform scale, whether the user asked for it, the object's length at that scale (m), and the reason."""

    value: float
    asked: bool
    final_m: float
    note: str


def identify(info: ObjectInfo, guidance: str) -> tuple[Size, str]:
    """The row of the size table for the object, and how it was found. The stated category, refined by a noun in the
    guidance for a kind of it ("handbag" of a suitcase); where the category is unknown or says little, the asset's name,
    then the guidance's nouns, then the labels of the links."""
    known = _category(info.category)
    nouns = _head_nouns(guidance)
    if known not in _GENERIC:
        for noun in reversed(nouns):
            if known in tables.sizes()[noun].refines:
                return tables.sizes()[noun], f"category {noun}: named in the guidance, a kind of {known}"
        return tables.sizes()[known], f"category {known}: as stated"
    for source, found in (
        ("the asset's name", [noun for noun in reversed(_nouns(info.asset_id)) if noun not in _GENERIC]),
        ("the guidance", [noun for noun in reversed(nouns) if noun not in _GENERIC]),
        ("the links' labels", _label_votes(info)),
        ("the stated category", [known] if known == "Furniture" else []),
    ):
        if found:
            return tables.sizes()[found[0]], f"category {found[0]}: from {source}"
    return tables.sizes()["*"], "category unknown: nothing names it"


def propose_scale(info: ObjectInfo, size: Size, guidance: str, statements: Sequence[Segment]) -> Scale:
    """The uniform scale: stated in numbers, else 1 where the authored size is right already, else the table's size."""
    authored = dimension(info, size)
    stated = stated_scale(info, guidance, statements)
    if stated is not None:
        value, note = stated
        return Scale(value, True, authored * value, note)
    real = asks_real_size(guidance)
    phrase, factor = size_word(guidance, statements)
    target = size.typical_m * factor
    if authored <= 0.0:
        return Scale(1.0, real, size.typical_m, "scale 1: the object has no size to compare")
    if real and size.min_m / REAL_SLACK <= authored <= size.max_m * REAL_SLACK:
        return Scale(1.0, True, authored, f"scale 1: real size, and {authored:.3g} m is plausible")
    # A normalised dataset's furniture is metres long by chance: only what is near the typical size counts as real.
    fits = abs(authored / target - 1.0) <= KEEP_WITHIN and size.min_m * factor <= authored <= size.max_m * factor
    widest = narrow_enough(info, size) * factor
    fits, target = fits and authored <= widest, min(target, widest, tabletop_limit(info, size, phrase) * factor)
    if fits and size.category != "*":
        return Scale(1.0, bool(phrase) or real, authored, f"scale 1: {authored:.3g} m is plausible for {size.category}")
    value = min(max(target / authored, LEAST_SCALE), MOST_SCALE)
    word = f", '{phrase}' × {factor:g}" if phrase else ""
    note = f"scale: {size.category} {size.dimension} {target / factor:.3g} m{word}, authored {authored:.3g} m"
    return Scale(float(f"{value:.4g}"), bool(phrase) or real, authored * value, note)


def dimension(info: ObjectInfo, size: Size) -> float:
    """The authored length, m, that the table's typical size is compared with."""
    if size.dimension == "height" and info.size_closed_m[2] > 0.0:
        return info.size_closed_m[2]
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


def _category(stated: str) -> str:
    plain = re.sub(r"[^a-z]", "", stated.lower())
    for name in tables.sizes():
        if plain and plain in (name.lower(), name.lower() + "s"):
            return name
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", stated)
    found = _nouns(words)
    return found[-1] if found else ""


def _nouns(text: str) -> list[str]:
    tokens = tuple(re.findall(r"[a-z]+", text.lower()))
    return [category for _, _, category in sorted(noun_spans(tokens), key=lambda span: span[0] - span[1])]


def _head_nouns(guidance: str) -> list[str]:
    """The categories that the guidance's first phrase names, in order; the last is what the object is."""
    return [category for _, _, category in noun_spans(head_of(tokenize(guidance)))]


def head_of(tokens: tuple[str, ...]) -> tuple[str, ...]:
    """The tokens of the guidance's first phrase, which says what the object is."""
    end = next((i for i, token in enumerate(tokens) if token in _HEAD_ENDS and i > 1), len(tokens))
    return tokens[:end]


def is_generic(category: str) -> bool:
    """Whether a stated category says little: none, "furniture", or one that no table knows."""
    return _category(category) in _GENERIC


def _label_votes(info: ObjectInfo) -> list[str]:
    votes: Counter[str] = Counter()
    for link in info.links:
        for category in _nouns(re.sub(r"_(body|base|frame|leg)$", "", link.label).replace("_", " ")):
            if category != "Door" and link.label.endswith(("_body", "_base", "_frame")):
                votes[category] += 3
    labels = {link.label for link in info.links}
    for label, category in (("key", "Keyboard"), ("door_frame", "Door"), ("glasses_body", "Eyeglasses")):
        votes[category] += 3 if label in labels else 0
    votes["Furniture"] += 1 if {"drawer", "furniture_body"} & labels else 0
    # A study may have left out the rows of a category.
    return [category for category, count in votes.most_common() if count > 0 and category in tables.sizes()]


def asks_real_size(guidance: str) -> bool:
    """Whether the guidance asks for the size of the real thing."""
    words = " ".join(tokenize(guidance))
    return any(phrase in words for phrase in _REAL)


def size_word(guidance: str, statements: Sequence[Segment]) -> tuple[str, float]:
    """The smallest of the words about the object's size, or the largest if all are above 1; ("", 1) without any. Words
    about a part ("a large drawer") or about damping are not about the object: the first phrase counts, and of the rest
    only segments about nothing else."""
    tokens = tokenize(guidance)
    end = next((i for i, token in enumerate(tokens) if token in _HEAD_ENDS - {","} and i > 0), len(tokens))
    table = {phrase: " ".join(phrase) for phrase in tables.size_words()}
    spans = []
    for segment in statements:
        kinds = {item.kind for item in segment.items}
        elsewhere = _OF_MOTION if segment.start == 0 else _OF_PARTS if segment.start < end else kinds - _NUMBERS
        if not kinds & elsewhere:
            spans += longest_spans(segment.tokens, table)
    found = [name for _, _, name in spans]
    if not found:
        return "", 1.0
    factors = {name: tables.size_words()[tuple(name.split())] for name in found}
    extreme = min if min(factors.values()) < 1.0 else max
    pick = extreme(factors, key=lambda name: factors[name])
    return pick, factors[pick]


def stated_scale(info: ObjectInfo, guidance: str, statements: Sequence[Segment]) -> tuple[float, str] | None:
    """The scale that the guidance states in numbers, as such or as a length of the object, and how; None without."""
    scale = _SCALE.search(plain(guidance))
    if scale and LEAST_SCALE <= float(scale.group(1)) <= MOST_SCALE:
        return float(scale.group(1)), f"scale {scale.group(1)}: as the guidance states"
    for segment in statements:
        if segment.of("part", "parts", "open", "closed"):
            continue
        for item in segment.of("length"):
            word = segment.tokens[item.end - segment.start :][:1]
            authored = _extent(info, word[0] if word else "", segment)
            if authored > 0.0 and item.number > 0.0:
                value = min(max(item.number / authored, LEAST_SCALE), MOST_SCALE)
                return (value, f"scale: {item.number:.3g} m {word[0] if word else 'in size'}, as the guidance states")
    return None


def _extent(info: ObjectInfo, word: str, segment: Segment) -> float:
    """The authored length, m, that a stated one is about: "30 cm tall" the height, "20 cm wide" the wider side."""
    x, y, z = info.size_closed_m
    if word in ("tall", "high", "height"):
        return z
    if word in ("wide", "width"):
        return max(x, y)
    if word in ("deep", "depth"):
        return min(x, y)
    stated = {"size", "sized", "measures", "measuring", "scale", "scaled"} & set(segment.tokens)
    return max(x, y, z) if stated or word in ("long", "length", "across", "diameter") else 0.0
