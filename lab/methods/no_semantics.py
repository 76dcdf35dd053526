"""Asset2Sim without semantics: names and labels are removed from every request (paper, ablations).

Link and joint names become ``link_0`` …, ``joint_0`` …, and are restored in the answer; labels, joint kinds, materials,
the category and the asset's id are left empty. Shapes, kinematics and views stay, and so does the user's guidance,
which comes from the user and not from the asset.
"""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import DASHED, DeclaredMethod, ProposalJob, Proposed
from asset2sim.baselines.ours import by_rules
from asset2sim.models.lenient_json import parse_json
from asset2sim.models.prompts import SYNTHESIS, data_block
from schemas.errors import InvalidAnswerError
from schemas.features import Features
from schemas.request import ModelAnswer, ModelAsk, ModelRequest, Turn
from schemas.vocabulary import Method

WITHHELD = (
    *("asset_id", "category", "label", "labels", "label_a", "label_b", "joint_kind", "material", "materials", "mesh"),
    *("meshes", "file"),
)
"""Request fields whose value reveals what something is: left empty."""
PLAIN = (
    *("purpose", "type", "volume_source", "view", "problem", "severity", "at_a", "at_b", "a_leaves", "toward"),
    *("directions", "color", "volume_means", "opens", "gravity", "depth"),
)
"""Fields whose value is our vocabulary: left unchanged even where a part of the asset has the same name."""
GUIDANCE = "user_guidance"
PURPOSE = "no_semantics"
"""Purpose of a synthesis without semantics."""
ANYTHING = "part"
"""Replacement for a label or category inside a sentence."""

_BLOCK = re.compile(r"<(\w+)>\n(.*?)\n</\1>", re.DOTALL)


@dataclass(frozen=True)
class NameAliases:
    """Name → alias (``aliases``, one to one), alias → name (``names``), and patterns for whole names, aliases, and
    words that are labels, categories and the like."""

    aliases: Mapping[str, str]
    names: Mapping[str, str]
    any_name: re.Pattern[str]
    any_alias: re.Pattern[str]
    any_word: re.Pattern[str]


def without_semantics(ask: ModelAsk, features: Features) -> ModelAsk:
    """An asker that sends requests without semantics and returns answers with the asset's own names."""
    alias_map = name_aliases(features)

    def asked(request: ModelRequest) -> ModelAnswer:
        answer = ask(anonymized_request(request, alias_map))
        if answer.content is None:
            return answer
        return answer.model_copy(update={"content": restored(answer.content, alias_map)})

    return asked


def unlabelled(features: Features) -> Features:
    """The features as our rules see them without semantics: no labels, materials and category. Names stay, by which
    the asset is written; those of the datasets say nothing."""
    links = tuple(link.model_copy(update={"label": "", "joint_kind": "", "materials": ()}) for link in features.links)
    return features.model_copy(update={"links": links, "category": ""})


def name_aliases(features: Features) -> NameAliases:
    """Aliases of an asset's links and joints, in its order; a name shared by a link and a joint has one alias."""
    aliases = {link.name: f"link_{index}" for index, link in enumerate(features.links)}
    for index, joint in enumerate(features.joints):
        aliases.setdefault(joint.name, f"joint_{index}")
    words = {features.asset_id, features.category, features.urdf_file}
    for link in features.links:
        words |= {link.label, link.joint_kind, *link.materials, *(mesh.file for mesh in link.meshes)}
    names = {alias: name for name, alias in aliases.items()}
    return NameAliases(aliases, names, any_of(aliases), any_of(names), any_of(words, re.IGNORECASE))


def any_of(words: Iterable[str], flags: int = 0) -> re.Pattern[str]:
    """Pattern for any of these whole words, longest first; it matches nothing where there are none."""
    longest = sorted({word for word in words if word}, key=lambda word: (-len(word), word))
    return re.compile(rf"(?<!\w)(?:{'|'.join(map(re.escape, longest))})(?!\w)" if longest else r"(?!)", flags)


def anonymized_request(request: ModelRequest, alias_map: NameAliases) -> ModelRequest:
    """The request without semantics: its text and, in a conversation, every turn. A synthesis is of another purpose
    then, so that an answer recorded for ours is none to it."""
    turns = tuple(anonymized_turn(turn, alias_map) for turn in request.turns)
    purpose = PURPOSE if request.purpose == SYNTHESIS else request.purpose
    text = anonymized_text(request.text, alias_map)
    return request.model_copy(update={"text": text, "turns": turns, "purpose": purpose})


def anonymized_turn(turn: Turn, alias_map: NameAliases) -> Turn:
    """One earlier message without semantics: blocks of data, a JSON answer, or a sentence."""
    content = turn.content
    if _BLOCK.search(content):
        return turn.model_copy(update={"content": anonymized_text(content, alias_map)})
    try:
        content = json.dumps(anonymized_value(json.loads(content), alias_map), ensure_ascii=False)
    except (ValueError, RecursionError):
        content = anonymized_sentence(content, alias_map)
    return turn.model_copy(update={"content": content})


def anonymized_text(text: str, alias_map: NameAliases) -> str:
    """A prompt's text without semantics in its data blocks; the user's guidance is unchanged."""

    def block(match: re.Match[str]) -> str:
        tag, value = match.group(1), match.group(2)
        return match.group(0) if tag == GUIDANCE else data_block(tag, anonymized_value(json.loads(value), alias_map))

    return _BLOCK.sub(block, text)


def anonymized_value(value: Any, alias_map: NameAliases, key: str = "") -> Any:
    """JSON data without semantics. Keys get aliases where all keys of the object are names; other keys stay."""
    if key in WITHHELD:
        return [] if isinstance(value, list | tuple) else {} if isinstance(value, dict) else ""
    if isinstance(value, dict):
        named = all(name in alias_map.aliases for name in value)
        return {
            alias_map.aliases[name] if named else name: anonymized_value(item, alias_map, "" if named else name)
            for name, item in value.items()
        }
    if isinstance(value, list):
        return [anonymized_value(item, alias_map, key) for item in value]
    return anonymized_sentence(value, alias_map) if isinstance(value, str) and key not in PLAIN else value


def anonymized_sentence(text: str, alias_map: NameAliases) -> str:
    """A sentence with aliases in place of names and ``ANYTHING`` in place of labels."""
    if text in alias_map.aliases:
        return alias_map.aliases[text]
    # Names first, in one pass: an alias may be another part's name, and a label may be a part of a name.
    pieces = alias_map.any_name.split(text)
    found = [alias_map.aliases[match.group(0)] for match in alias_map.any_name.finditer(text)]
    plain = [alias_map.any_word.sub(ANYTHING, piece) for piece in pieces]
    return "".join(part for pair in zip(plain, (*found, ""), strict=True) for part in pair)


def restored(content: str, alias_map: NameAliases) -> str:
    """An answer with the asset's own names; invalid JSON is returned unchanged, for the parser to refuse."""
    try:
        return json.dumps(named_value(parse_json(content), alias_map), ensure_ascii=False)
    except (InvalidAnswerError, ValueError, RecursionError):
        return content


def named_value(value: Any, alias_map: NameAliases) -> Any:
    """JSON data with names in place of aliases, also in keys and within sentences."""
    if isinstance(value, dict):
        return {named_value(key, alias_map): named_value(item, alias_map) for key, item in value.items()}
    if isinstance(value, list):
        return [named_value(item, alias_map) for item in value]
    if isinstance(value, str):
        return alias_map.any_alias.sub(lambda match: alias_map.names[match.group(0)], value)
    return value


def withheld(ask: ModelAsk, extraction: Extraction) -> tuple[ModelAsk, Extraction]:
    """Requests and features without names and labels."""
    features = extraction.features
    return without_semantics(ask, features), replace(extraction, features=unlabelled(features))


def propose(job: ProposalJob, extraction: Extraction) -> Proposed:
    """Ours, pictures labelled by aliases. Raises SynthesisError."""
    return by_rules(job, extraction, name_aliases(extraction.features).aliases, semantics=False)


METHOD = DeclaredMethod(
    Method.NO_SEMANTICS,
    "ours, no semantics",
    "ours with every name and label withheld",
    propose,
    place=60,
    rules=True,
    given=withheld,
    colour="#56B4E9",
    dashes=DASHED,
)
