"""What carries an object, from words: what the guidance says of it, else what such things usually are."""

import re
from functools import lru_cache

from asset2sim.guidance.csv_rows import csv_rows
from asset2sim.guidance.lexicon import longest_spans, tokenize
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.sizing import head_of, is_generic
from asset2sim.guidance.tables import Phrase, nouns
from schemas.overlay import SupportProposal
from schemas.support import Mount, SupportKind

_DENIALS = frozenset(("not", "no", "never", "without", "isn't", "unlike"))
"""Words that turn a phrase round: "not fixed to the wall"."""
DENIED_WITHIN = 3
"""Tokens before a phrase in which such a word counts."""
STANDS_CONFIDENCE = 0.6
"""Confidence that a thing of a known category which no row names stands or lies by its own weight."""
NAMED_SHARE = 0.7
"""Confidence that remains where only the asset's name says what it is: files are named carelessly."""


def said_support(guidance: str) -> SupportProposal | None:
    """What the guidance says carries the object: a phrase such as "wall-mounted", or else what its first phrase calls
    the object ("a wall clock"); None where it says nothing."""
    tokens = tokenize(guidance)
    for start, _, phrase in longest_spans(tokens, _phrases("said")):
        if not _DENIALS & set(tokens[max(0, start - DENIED_WITHIN) : start]):
            return _row(phrase, f"the guidance says '{phrase}'")
    found = [span[2] for span in longest_spans(head_of(tokens), _phrases("object")) if span[1] - span[0] > 1]
    return _row(found[-1], f"the guidance calls it a {found[-1]}") if found else None


def usual_support(info: ObjectInfo, guidance: str) -> SupportProposal | None:
    """What usually carries such an object: by its category, else by the last noun of the guidance's first phrase, else
    by the last noun of the asset's name, with less confidence; None where the tables do not know it, or leave it to
    its shape."""
    stated = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", info.category)
    places = [
        ("the guidance calls it", head_of(tokenize(guidance)), 1.0),
        ("its name says", _words(info.asset_id), NAMED_SHARE),
    ]
    if stated and not is_generic(stated):
        places = [("its category is", _words(stated), 1.0)]
    for why, tokens, share in places:
        noun = _last_noun(tokens)
        if noun is None:
            continue
        row = next((row for row in support_rows() if (row["names"], row["phrase"]) == ("object", noun)), None)
        if row is not None and not row["support"]:
            return None
        told = f"{why} {noun}"
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


def _words(text: str) -> Phrase:
    return tuple(re.findall(r"[a-z]+", text.lower()))


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
