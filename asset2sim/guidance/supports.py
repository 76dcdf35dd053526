"""Support of an object, from words: what the guidance says of it, else what such things usually are."""

import re
from functools import lru_cache

from asset2sim.guidance.category import is_generic
from asset2sim.guidance.csv_rows import csv_rows
from asset2sim.guidance.lexicon import head_of, longest_spans, name_words
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.tables import Phrase, nouns
from schemas.support import Mount, SupportKind, SupportProposal

_DENIALS = frozenset(("not", "no", "never", "without", "isn't", "unlike"))
"""Words that turn a phrase round: "not fixed to the wall"."""
_FASTENED = frozenset((
    "hung", "hang", "hangs", "hanging", "mounted", "screwed", "bolted", "fixed", "attached", "fastened", "anchored",
    "nailed", "clamped", "hooked",
))  # fmt: skip
_TO = frozenset(("to", "on", "onto", "in", "into", "at", "from", "above", "over", "against"))
_HOLDERS = {
    **dict.fromkeys(("wall", "walls", "nail", "hook"), "wall"),
    **dict.fromkeys(("floor", "ground", "concrete"), "floor"),
    **dict.fromkeys(("counter", "countertop", "worktop", "desk", "table", "bench"), "counter"),
    "ceiling": "ceiling",
}
"""Word for the thing that an object is fastened to → its mount."""
FASTENED_CONFIDENCE = 0.95
"""Confidence in a support that words state as a fastening: "screwed onto the wall"."""
DENIED_WITHIN = 3
"""Tokens before a phrase in which such a word counts."""
STANDS_CONFIDENCE = 0.6
"""Confidence that a thing of a known category which no row names stands or lies by its own weight."""
HANGS_CONFIDENCE = 0.5
"""Confidence that what is made as wall cupboards are hangs: some stand on a sideboard."""
MADE_SO = "it is made as wall cupboards are"
NAMED_SHARE = 0.7
"""Confidence that remains where only the asset's name says what it is: files are named carelessly."""


def said_support(tokens: Phrase) -> SupportProposal | None:
    """The support that the guidance names: a phrase such as "wall-mounted", or else what its first phrase calls
    the object ("a wall clock"); None where it says nothing."""
    if (fastened := _fastened(tokens)) is not None:
        return fastened
    for start, _, phrase in longest_spans(tokens, _phrases("said")):
        if not _DENIALS & set(tokens[max(0, start - DENIED_WITHIN) : start]):
            return _row(phrase, f"the guidance says '{phrase}'")
    found = [span[2] for span in longest_spans(head_of(tokens), _phrases("object")) if span[1] - span[0] > 1]
    return _row(found[-1], f"the guidance calls it a {found[-1]}") if found else None


def _fastened(tokens: Phrase) -> SupportProposal | None:
    """The support of what is said to be fastened to or to hang from something; None where nothing is said."""
    for index, token in enumerate(tokens):
        to = tokens[index + 1 : index + 2]
        if token not in _FASTENED or not _TO & set(to) or _DENIALS & set(tokens[max(0, index - DENIED_WITHIN) : index]):
            continue
        near = tokens[index + 2 : index + 5]
        mount = next((_HOLDERS[word] for word in near if word in _HOLDERS), None)
        # Over a stove or a table something hangs on a wall; a lamp would have said so.
        mount = "wall" if to[0] in ("above", "over") else mount
        if mount is not None:
            words = " ".join(tokens[index : index + 5])
            reason = f"the guidance says '{words}'"
            kind = SupportKind.FIXED
            return SupportProposal(kind=kind, mount=Mount(mount), confidence=FASTENED_CONFIDENCE, reason=reason)
    return None


def called_by(tokens: Phrase) -> str | None:
    """The name that the guidance's first phrase gives the object, by the name that the table of supports has for it."""
    return _last_noun(head_of(tokens))


def usual_support(info: ObjectInfo, called: str | None, kind: str = "") -> SupportProposal | None:
    """The usual support of such an object: by its category, or the ``kind`` of it that it is where the table has a row
    of that, else by what the guidance calls it, else by the last noun of the asset's name, with less confidence; a wall
    where it is made to hang and no row says otherwise; None where the tables leave it to its shape."""
    places = [
        ("the guidance calls it", called, 1.0),
        ("its name says", _last_noun(name_words(info.asset_id)), NAMED_SHARE),
    ]
    if info.category and not is_generic(info.category):
        nouns_of = [_last_noun(name_words(name)) for name in (kind, info.category)]
        known = [noun for noun in nouns_of if noun in _phrases("object").values()]
        places = [("its category is", known[0] if known else nouns_of[-1], 1.0)]
    for why, noun, share in places:
        if noun is None:
            continue
        row = next((row for row in support_rows() if (row["names"], row["phrase"]) == ("object", noun)), None)
        if row is not None and not row["support"]:
            return None
        told = f"{why} {noun}"
        if row is None and info.hangs:
            reason, fixed = f"{MADE_SO}: {info.hangs}", SupportKind.FIXED
            return SupportProposal(kind=fixed, mount=Mount.WALL, confidence=HANGS_CONFIDENCE, reason=reason)
        if row is None:
            usual = SupportProposal(
                kind=SupportKind.FREESTANDING, confidence=STANDS_CONFIDENCE, reason=f"{told}, which stands or lies"
            )
        else:
            usual = _row(noun, told)
        return usual.model_copy(update={"confidence": share * usual.confidence})
    return None


def _last_noun(tokens: Phrase) -> str | None:
    """The last phrase that names a thing, by the name that the table has for it ("faucet" for a tap), else in the
    words of its category; None without any."""
    known = _phrases("object")
    spans = longest_spans(tokens, {**nouns(), **known})
    if not spans:
        return None
    name = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", spans[-1][2]).lower()
    return None if name == "furniture" else name


@lru_cache
def support_rows() -> list[dict[str, str]]:
    """The rows of what carries an object: ``phrase``, whether it ``names`` the object or is ``said`` of it, the
    ``support``, its ``mount``, and ``confidence``."""
    return csv_rows("supports")


@lru_cache
def _phrases(names: str) -> dict[Phrase, str]:
    return {tuple(row["phrase"].split()): row["phrase"] for row in support_rows() if row["names"] == names}


@lru_cache
def _row(phrase: str, why: str) -> SupportProposal:
    row = next(row for row in support_rows() if row["phrase"] == phrase)
    return SupportProposal(
        kind=SupportKind(row["support"]),
        mount=Mount(row["mount"]) if row["mount"] else None,
        confidence=float(row["confidence"]),
        reason=f"{why}; {row['source']}" if row["names"] == "object" else why,
    )
