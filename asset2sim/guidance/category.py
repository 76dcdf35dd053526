"""The category of an object, by which the tables know it: stated, or named by its words, its name or its parts."""

import re
from collections import Counter
from collections.abc import Sequence

from asset2sim.guidance import tables
from asset2sim.guidance.edges import LEVEL, fitted_kind
from asset2sim.guidance.lexicon import head_of, name_words, noun_spans, segments
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import parts_of
from asset2sim.guidance.sizing import asked_size, named_kinds, size_word

FEWEST_FLAPS = 3
_GENERIC = ("", "*", "Furniture")


def identify(info: ObjectInfo, tokens: tuple[str, ...]) -> tuple[str, str]:
    """The object's row of the table of sizes, "*" where nothing names it, and what named it. The stated category,
    refined by a noun in the guidance for a kind of it ("handbag" of a suitcase), or by its shape; where the category is
    unknown or says little, the asset's name, then the guidance's nouns, then the labels of the links."""
    known = _category(info.category)
    nouns = [category for _, _, category in noun_spans(head_of(tokens))]
    if known not in _GENERIC:
        for noun in reversed(nouns):
            if known in tables.sizes()[noun].refines:
                return noun, f"named in the guidance, a kind of {known}"
        if known == "Box" and has_crossing_flaps(info):
            return "Carton", "its flaps, a kind of Box"
        if known == "Knife" and has_folding_blade(info):
            return "PocketKnife", "its hinged blade, a kind of Knife"
        shape = fitted_kind(info, known, named_kinds(tokens))
        if shape is not None and shape.category in tables.sizes() and not _asked_smaller(tokens, known, shape.category):
            return shape.category, f"its edges, those of a {shape.kind}"
        return known, "as stated"
    for source, found in (
        ("the asset's name", [noun for noun in reversed(_nouns(info.asset_id)) if noun not in _GENERIC]),
        ("the guidance", [noun for noun in reversed(nouns) if noun not in _GENERIC]),
        ("the links' labels", _label_votes(info)),
        ("the stated category", [known] if known == "Furniture" else []),
    ):
        if found:
            return found[0], f"from {source}"
    return "*", "nothing names it"


def _asked_smaller(tokens: tuple[str, ...], known: str, kind: str) -> bool:
    """Whether words ask for less than the smallest of a ``kind``: a very small trash can is no wheeled bin."""
    _, factor = size_word(asked_size("", tokens, segments(tokens, known)))
    return factor < 1.0 and factor * tables.sizes()[known].typical_m < tables.sizes()[kind].min_m


def has_crossing_flaps(info: ObjectInfo) -> bool:
    """Whether lids hang at adjacent sides of an object, three or more, as the flaps of a carton: boards do not fold so,
    and compartments have their lids side by side."""
    lids = {link.name for link in info.links if {"lid", "flap"} & {*re.findall(r"[a-z]+", link.label.lower())}}
    hinged = [joint for joint in info.joints if joint.motion == "hinge" and joint.child in lids]
    axes = [joint.axis for joint in hinged if abs(joint.axis[2]) < LEVEL]
    crossing = any(abs(sum(a * b for a, b in zip(one, other, strict=True))) < LEVEL for one in axes for other in axes)
    return len(axes) >= FEWEST_FLAPS and crossing


def has_folding_blade(info: ObjectInfo) -> bool:
    """Whether a blade turns on a hinge: a knife that folds."""
    return any(part.name == "blade" and part.joint.motion == "hinge" for part in parts_of(info, "Knife"))


def _category(stated: str) -> str:
    plain = re.sub(r"[^a-z]", "", stated.lower())
    for name in tables.sizes():
        if plain and plain in (name.lower(), name.lower() + "s"):
            return name
    found = _nouns(stated)
    return found[-1] if found else ""


def _nouns(name: str) -> list[str]:
    return [category for _, _, category in sorted(noun_spans(name_words(name)), key=lambda span: span[0] - span[1])]


def named_in_file(asset_id: str, robot: str, links: Sequence[str]) -> str:
    """The category that an object without a stated one is named by in its file: by its robot's name, else by a noun
    that all its links' names have or that its root link's has; "" where its own name says one, or nothing does. A door
    is a part of most things, and no object's name where another part is none."""
    if any(noun not in _GENERIC for noun in _nouns(asset_id)):
        return ""
    own = [noun for noun in _nouns(robot) if noun not in _GENERIC]
    if own:
        return own[-1]
    nouns = [[noun for noun in _nouns(name) if noun not in _GENERIC] for name in links]
    shared = set(nouns[0]).intersection(*nouns[1:]) if nouns else set[str]()
    found = [noun for noun in (nouns[0] if nouns else []) if noun in shared or noun != "Door"]
    return found[0] if found else ""


def row_of(stated: str, read: str) -> str:
    """The row of the tables for an object of this stated category, or where that says little of the one that was
    ``read`` from its names, words and labels; "" where neither says any."""
    known = _category(stated)
    return known if known not in _GENERIC else read.replace("*", "") or known


def is_generic(category: str) -> bool:
    """Whether a stated category says little: none, "furniture", or one that no table knows."""
    return _category(category) in _GENERIC


def _label_votes(info: ObjectInfo) -> list[str]:
    votes: Counter[str] = Counter()
    for link in info.links:
        for category in _nouns(re.sub(r"_(body|base|frame|leg)$", "", link.label)):
            if category != "Door" and link.label.endswith(("_body", "_base", "_frame")):
                votes[category] += 3
    labels = {link.label for link in info.links}
    for label, category in (("key", "Keyboard"), ("door_frame", "Door"), ("glasses_body", "Eyeglasses")):
        votes[category] += 3 if label in labels else 0
    votes["Furniture"] += 1 if {"drawer", "furniture_body"} & labels else 0
    # A study may have left out the rows of a category.
    return [category for category, count in votes.most_common() if count > 0 and category in tables.sizes()]
