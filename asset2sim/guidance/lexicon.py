"""The phrases of the guidance and their meanings, in segments of one statement each."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from asset2sim.guidance import tables
from asset2sim.guidance.amounts import plain_guidance

_TOKEN = re.compile(r"\d+(?:[.,]\d+)?|[a-z]+n't|[a-z]+|[%°;:,.!?()]")
_COUNTED = re.compile(r"\b(?:\d+|one|two|three|four|five|six|seven|eight|nine|ten)-(?!third|quarter|half)[a-z]+")
_SENTENCE_ENDS = frozenset(".!?;")
_SEGMENT_ENDS = frozenset(",:()")
HEAD_ENDS = frozenset((",", ".", ";", ":", "with", "whose", "that", "which", "opening", "having"))
"""Tokens that end the first phrase."""
_SPLITTERS = frozenset(("and", "but", "while", "whereas", "with", "whose", "that", "which", "so", "plus", "yet"))
UNITS = {
    "degree": ("angle", math.radians(1.0)), "degrees": ("angle", math.radians(1.0)),
    "deg": ("angle", math.radians(1.0)), "°": ("angle", math.radians(1.0)),
    "rad": ("angle", 1.0), "radian": ("angle", 1.0), "radians": ("angle", 1.0),
    "%": ("share", 0.01), "percent": ("share", 0.01),
    "m": ("length", 1.0), "metre": ("length", 1.0), "metres": ("length", 1.0),
    "meter": ("length", 1.0), "meters": ("length", 1.0),
    "cm": ("length", 0.01), "centimetre": ("length", 0.01), "centimetres": ("length", 0.01),
    "centimeter": ("length", 0.01), "centimeters": ("length", 0.01),
    "mm": ("length", 0.001), "millimetre": ("length", 0.001), "millimetres": ("length", 0.001),
    "millimeter": ("length", 0.001), "millimeters": ("length", 0.001),
    "inch": ("length", 0.0254), "inches": ("length", 0.0254),
    "s": ("time", 1.0), "sec": ("time", 1.0), "secs": ("time", 1.0), "seconds": ("time", 1.0),
    "newtons": ("force", 1.0), "newtonmetres": ("torque", 1.0),
    "kg": ("mass", 1.0), "kilogram": ("mass", 1.0), "kilograms": ("mass", 1.0), "kilos": ("mass", 1.0),
    "g": ("mass", 0.001), "gram": ("mass", 0.001), "grams": ("mass", 0.001),
}  # fmt: skip
_REACHES = {"length": "stops", "angle": "turns"}
"""What a length or an angle means after "within": how far a part may glide, and no size or state."""
_ORDINALS = {
    "first": "0", "1st": "0", "second": "1", "2nd": "1", "third": "2", "3rd": "2", "fourth": "3", "4th": "3",
    "fifth": "4", "sixth": "5", "last": "-1",
    "top": "top", "upper": "top", "uppermost": "top", "topmost": "top",
    "bottom": "bottom", "lower": "bottom", "lowest": "bottom", "bottommost": "bottom",
    "left": "left", "leftmost": "left", "right": "right", "rightmost": "right",
    "middle": "middle", "centre": "middle", "center": "middle", "central": "middle",
}  # fmt: skip
_QUANTIFIERS = {
    "all": "all", "both": "all", "every": "all", "each": "all",
    "other": "other", "others": "other", "rest": "other", "remaining": "other", "else": "other",
    "everything": "everything", "anything": "everything",
}  # fmt: skip
LONG_NOUN, LEAST_LETTERS = 6, 3
"""Letters of a noun with which a compound may end, and of what stands before it: shorter ones end other words, too
("portable", "headphone")."""
_COUNTS = {"one": 1, "two": 2, "three": 3, "four": 4}
_RESISTS = ("damping", "damped", "friction")
_TRAVEL = frozenset(("travel", "range", "stroke", "throw", "swing", "way"))
"""Words for a joint's range, a share of which says how far its part is open: "at 45% of its travel"."""
_PULLS = frozenset((
    "pull", "push", "swing", "slide", "lift", "pry", "prise", "get", "force", "flip", "twist", "turn", "press", "crank",
    "hold", "keep", "ease",
))  # fmt: skip
"""Verbs after whose infinitive a state is what somebody does to the part: "20 N to pull open"."""
_UNREAL = frozenset(("to", "can", "could", "would", "will", "may", "might", "be"))
_CONDITIONS = frozenset(("when", "whenever", "if", "once", "until", "after", "before"))
_MOVING = frozenset((("by", "itself"), ("by", "themselves"), ("and", "down"), ("and", "close"), ("and", "closes")))
_ADJECTIVES = 1
"""Words that may stand between a length and the object that is so long: "8 inch steel scissors"."""
_SOLD_BY_WIDTH = frozenset(("Dishwasher", "Oven", "Refrigerator", "WashingMachine", "Microwave"))
"""Kitchen appliances, whose one stated length is the width of their niche: "a 24 inch dishwasher" (EN 1116)."""
_STATE_KINDS = ("open", "closed", "rest", "pressed", "up", "down", "switched")


@dataclass(frozen=True)
class Item:
    """A phrase with a meaning; ``start`` counts tokens. ``number`` is in SI units for measured phrases."""

    kind: str
    value: str
    start: int
    end: int
    number: float = 0.0


@dataclass(frozen=True)
class Segment:
    """One statement: the phrases between two separators, and the numbers of its sentence and first token."""

    sentence: int
    items: tuple[Item, ...]
    tokens: tuple[str, ...]
    start: int = 0

    def of(self, *kinds: str) -> tuple[Item, ...]:
        """The items of these kinds."""
        return tuple(item for item in self.items if item.kind in kinds)


def tokenize(guidance: str) -> tuple[str, ...]:
    """Lower-case words, numbers and separators, without counts ("two-drawer") and numbers that cannot be met."""
    text = plain_guidance(guidance)
    text = re.sub(r"\b(\d)(st|nd|rd|th)\b", lambda m: _ORDINAL_NAMES.get(m.group(1), m.group(1)), text)
    return tuple(_TOKEN.findall(_COUNTED.sub(" ", text)))


_ORDINAL_NAMES = {"1": "first", "2": "second", "3": "third", "4": "fourth", "5": "fifth", "6": "sixth"}


def place_of(segment: Segment) -> dict[str, Any]:
    """The words of a segment and the number of its first token, as a wish states them."""
    return {"words": " ".join(segment.tokens), "at": segment.start}


def segments(tokens: tuple[str, ...], category: str) -> tuple[Segment, ...]:
    """The tokens of a sentence cut into segments, each with what was recognised in it. Words that name the object
    ("drawer cabinet", or "shelf" where that is its category) are not taken for its parts, but "its shelf" and "the left
    switch" are."""
    nouns = [
        (a, b)
        for a, b, noun in noun_spans(tokens)
        if b - a > 1 or (noun == category and tokens[max(a - 1, 0)] not in ("its", *_ORDINALS))
    ]
    found: list[Segment] = []
    items: list[Item] = []
    words: list[str] = []
    sentence, index, start = 0, 0, 0
    while index < len(tokens):
        token = tokens[index]
        ends_sentence = token in _SENTENCE_ENDS
        if ends_sentence or token in _SEGMENT_ENDS or token in _SPLITTERS:
            found.append(Segment(sentence, tuple(items), tuple(words), start))
            items, words = [], []
            sentence += ends_sentence
            index += 1
            start = index
            continue
        item = None if any(a <= index < b for a, b in nouns) else _item(tokens, index)
        if item is not None and item.kind == "length" and _is_of(item, nouns, tokens):
            item = replace(item, kind="size", value="wide" if category in _SOLD_BY_WIDTH else "")
        if item is not None:
            items.append(item)
        end = item.end if item is not None else index + 1
        words.extend(tokens[index:end])
        index = end
    found.append(Segment(sentence, tuple(items), tuple(words), start))
    return tuple(segment for segment in found if segment.tokens)


def _is_of(length: Item, nouns: Sequence[tuple[int, int]], tokens: tuple[str, ...]) -> bool:
    """Whether a length is that of the object named beside it: "8 inch steel scissors", "a trolley of 1 m"."""
    of = tokens[max(length.start - 1, 0) : length.start] == ("of",)
    return any(0 <= a - length.end <= _ADJECTIVES or (of and b == length.start - 1) for a, b in nouns)


def head_of(tokens: tuple[str, ...]) -> tuple[str, ...]:
    """The tokens of the guidance's first phrase, which says what the object is."""
    first = 1 if noun_spans(tokens[:1]) else 2  # "desk with …", but "this is …"
    end = next((i for i, token in enumerate(tokens) if token in HEAD_ENDS and i >= first), len(tokens))
    return tokens[:end]


def noun_spans(tokens: tuple[str, ...]) -> list[tuple[int, int, str]]:
    """(start, end, category) of every phrase that names a category, longest match first, left to right."""
    return longest_spans(tokens, tables.nouns())


def longest_spans(tokens: tuple[str, ...], table: dict[tuple[str, ...], str]) -> list[tuple[int, int, str]]:
    """(start, end, value) of the longest phrases of a table in the tokens; plurals match their singulars."""
    longest = max(map(len, table), default=1)
    spans, index = [], 0
    while index < len(tokens):
        for length in range(min(longest, len(tokens) - index), 0, -1):
            phrase = tokens[index : index + length]
            value = table.get(phrase) or table.get((*phrase[:-1], singular(phrase[-1])))
            if value is not None:
                spans.append((index, index + length, value))
                index += length - 1
                break
        index += 1
    return spans


def name_words(name: str) -> tuple[str, ...]:
    """The words of a name, CamelCase, underscores and digits apart; of one word the noun that it ends with, as of
    "hingecabinet", where that is long enough to be no ending of other words."""
    words = re.findall(r"[a-z]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower())
    known = tables.nouns()
    return tuple(next((noun for noun in _endings(word) if (noun,) in known), word) for word in words)


def _endings(word: str) -> list[str]:
    """The word itself, and what of it may be a compound's last word, longest first."""
    return [word, *(word[start:] for start in range(LEAST_LETTERS, len(word) - LONG_NOUN + 1))]


def singular(word: str) -> str:
    """A plain plural's singular; other words as they are."""
    if word.endswith("ves"):
        return word[:-3] + "f"
    if word.endswith(("shes", "ches", "xes", "sses")):
        return word[:-2]
    return word[:-1] if word.endswith("s") and not word.endswith("ss") else word


def _item(tokens: tuple[str, ...], index: int) -> Item | None:
    token = tokens[index]
    if token[0].isdigit():
        return _measure(tokens, index)
    vocabulary = tables.words()
    for length in range(min(max(map(len, vocabulary)), len(tokens) - index), 0, -1):
        word = vocabulary.get(tokens[index : index + length])
        if word is not None and _is_meant(word.kind, tokens, index, index + length):
            return Item(word.kind, word.value, index, index + length)
    if token == "close" and (index == 0 or not tokens[index - 1].isalpha()):
        return Item("closed", "", index, index + 1)
    if token == "left" and tokens[index - 1 : index] != ("the",) and _opens(tokens[index + 1 : index + 2]):
        return None
    if token.endswith("n't"):
        return Item("not", "state", index, index + 1)
    if token in _COUNTS and _counts_parts(tokens, index):
        return Item("count", token, index, index + 1, _COUNTS[token])
    if token in _ORDINALS and not _is_time(tokens, index):
        return Item("ordinal", _ORDINALS[token], index, index + 1)
    if token in _QUANTIFIERS:
        return Item("quantifier", _QUANTIFIERS[token], index, index + 1)
    name = part_word(token)
    return Item("part" if name == token else "parts", name, index, index + 1) if name else None


def part_word(token: str) -> str:
    """The word of the part table that a token is, in the singular; "" if there is none."""
    forms = (token, singular(token), token.removesuffix("es"))
    return next((form for form in forms if form in tables.part_words()), "")


def _is_meant(kind: str, tokens: tuple[str, ...], index: int, end: int) -> bool:
    """Whether the words up to ``end`` have the meaning that the vocabulary has for them: a state is not only possible,
    and "lower" is a level before damping or friction alone, else a place."""
    if kind != "level" or tokens[index] not in _ORDINALS:
        return kind not in _STATE_KINDS or not _is_hypothetical(tokens, index)
    words = (tables.words().get((token,)) for token in tokens[end : end + 2])
    return any(word is not None and word.kind in _RESISTS for word in words)


def _is_hypothetical(tokens: tuple[str, ...], index: int) -> bool:
    """Whether the words around speak of what the object can do ("can be opened", "opens by itself", "glides up and
    down") or of another time ("when closed")."""
    if tokens[index + 1 : index + 3] in _MOVING:
        return True
    if index > 1 and tokens[index - 2] == "to" and tokens[index - 1] in _PULLS:
        return True
    if tokens[index + 1 : index + 2] == ("with",) and tokens[index + 3 : index + 4] == ("newtons",):
        return True  # "pressed with 2 N"
    start = max((i + 1 for i in range(index) if not tokens[i][0].isalnum()), default=0)
    clause = tokens[max(start, index - 4) : index]
    return tokens[max(index - 1, 0)] in _UNREAL or bool(_CONDITIONS & set(clause))


def _counts_parts(tokens: tuple[str, ...], index: int) -> bool:
    """Whether a number counts parts: before their word or its ordinal, after an ordinal, or for those named before:
    "two drawers", "two upper drawers", "the top two", "one of them", "one ajar"."""
    before, after = tokens[max(index - 1, 0) : index], tokens[index + 1 : index + 2]
    if any(word in _ORDINALS for word in before):
        return tokens[index] != "one"
    return any(word in _ORDINALS or word == "of" or part_word(word) for word in after) or _opens(after)


def _opens(following: tuple[str, ...]) -> bool:
    word = tables.words().get(following)
    return word is not None and word.kind in ("open", "closed", "ajar", "degree")


def _is_time(tokens: tuple[str, ...], index: int) -> bool:
    before = tokens[index - 1] if index > 0 else ""
    return tokens[index] == "second" and (before in ("a", "per") or before[:1].isdigit())


def _measure(tokens: tuple[str, ...], index: int) -> Item | None:
    unit = UNITS.get(tokens[index + 1]) if index + 1 < len(tokens) else None
    if unit is None:
        return Item("number", tokens[index], index, index + 1, float(tokens[index].replace(",", ".")))
    kind, factor = unit
    if index > 0 and tokens[index - 1] == "within" and kind in _REACHES:
        kind = _REACHES[kind]
    value = "travel" if kind == "share" and _TRAVEL & set(tokens[index + 3 : index + 5]) else tokens[index]
    return Item(kind, value, index, index + 2, float(tokens[index].replace(",", ".")) * factor)
