"""Clauses of the guidance, and the parts that each is about."""

from collections.abc import Sequence
from dataclasses import dataclass

from asset2sim.guidance.lexicon import Item, Segment
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import (
    MovablePart,
    main_parts,
    ordinal_candidates,
    outermost_parts,
    parts_named,
    reading_order,
)

_BREAKERS = ("open", "closed", "part", "parts", "ordinal", "quantifier")
_STATES = ("open", "closed", "ajar")
_SINGLED = ("door", "drawer", "shelf", "container", "")
"""Parts of which an object has several alike, so that one in the singular means one of them; so it does where no part
has a name."""
GENERIC = ("hinge", "slide", "rail", "runner", "joint")


@dataclass(frozen=True)
class Mention:
    """The parts that a clause names, and the words for them. ``others`` means those that nothing was asked of yet;
    ``carried`` are ordinals that wait for their part, as in "the first and third drawer"."""

    parts: tuple[MovablePart, ...]
    words: tuple[str, ...]
    others: bool = False
    carried: tuple[str, ...] = ()

    @property
    def found(self) -> bool:
        """Whether the clause names any part at all."""
        return bool(self.words)


NO_MENTION = Mention((), ())


def split_states(segment: Segment) -> tuple[Segment, ...]:
    """Cut where a second part or state begins after a part and its state: "lid open drawer closed"."""
    groups: list[list[Item]] = [[]]
    for item in segment.items:
        kinds = {other.kind for other in groups[-1]}
        complete = bool(kinds & {"part", "parts"}) and bool(kinds & set(_STATES))
        if complete and item.kind in _BREAKERS and item.kind not in ("open", "closed"):
            groups.append([])
        groups[-1].append(item)
    return tuple(Segment(segment.sentence, tuple(group), segment.tokens, segment.start) for group in groups)


def mentioned_parts(info: ObjectInfo, parts: Sequence[MovablePart], segment: Segment, last: Mention) -> Mention:
    """The parts that a clause names; ``last`` is what was named before, for "the second" and "the others"."""
    words = segment.of("part", "parts")
    specific = [item for item in words if item.value not in GENERIC] or list(words)
    ordinals = [item.value for item in segment.of("ordinal")]
    quantifiers = {item.value for item in segment.of("quantifier")}
    others = "other" in quantifiers
    count = int(next((item.number for item in segment.of("count")), 0))
    if "everything" in quantifiers:
        return Mention(_openable(parts), ("everything",), others)
    if not specific:
        if (ordinals or others or count) and last.words and last.words != ("everything",):
            kind = last.words[-1]
            named = parts_named(parts, kind)
            chosen = ordinal_candidates(info, named, ordinals, parts, count) if ordinals else named
            chosen = tuple(reading_order(info, chosen, parts)[:count]) if count and not ordinals else chosen
            return Mention(chosen, (kind,), others)
        if "all" in quantifiers or others:
            return Mention(_openable(parts), ("everything",), others)
        return Mention((), (), False, tuple(ordinals))
    chosen_all: list[MovablePart] = []
    for item in specific:
        candidates = parts_named(parts, item.value) or _main_parts_if_unnamed(info, parts, item.value)
        if ordinals:
            picked = ordinal_candidates(info, candidates, ordinals, parts, count)
            picked = picked[:1] if item.kind == "part" and _single(picked) else picked
            before = ordinal_candidates(info, candidates, last.carried, parts) if last.carried else ()
            candidates = before + tuple(part for part in picked if part not in before)
        elif count:
            candidates = tuple(reading_order(info, candidates, parts)[:count])
        elif item.kind == "part" and not quantifiers and len(candidates) > 1 and _single(candidates):
            candidates = (max(candidates, key=lambda part: round(part.extent, 6)),)
        chosen_all += [part for part in candidates if part not in chosen_all]
    return Mention(tuple(chosen_all), tuple(item.value for item in specific), others)


def parts_of_whole(info: ObjectInfo, parts: Sequence[MovablePart]) -> tuple[MovablePart, ...]:
    """The parts that a state of the whole object is about: a laptop's screen, both halves of a pair of scissors; not
    the handle by which one carries it, nor keys and levers, which spring back from wherever one has them."""
    mains = main_parts([part for part in parts if part.mechanism.kind != "spring return"])
    return outermost_parts(info, tuple(part for part in mains if part.name != "handle") or mains)


def _openable(parts: Sequence[MovablePart]) -> tuple[MovablePart, ...]:
    return tuple(part for part in parts if part.mechanism.role in ("main", "cap"))


def _single(candidates: Sequence[MovablePart]) -> bool:
    return all(part.name in _SINGLED for part in candidates)


def _main_parts_if_unnamed(info: ObjectInfo, parts: Sequence[MovablePart], word: str) -> tuple[MovablePart, ...]:
    """The main parts for a word like "door" where the asset names none of its parts, else none."""
    if word in ("door", "lid", "cover", "drawer", "screen", "handle") and not any(part.name for part in parts):
        return parts_of_whole(info, parts)
    return ()
