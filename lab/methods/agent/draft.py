"""Parameters set by an agent so far: merged field by field and validated like an overlay's JSON."""

import json
from collections.abc import Mapping
from typing import Any

from asset2sim.models.answers import parse_overlay
from lab.methods.agent.specs import JOINT_FIELDS, LINK_FIELDS, MAX_QUOTED_CHARS
from schemas.errors import InvalidAnswerError
from schemas.features import Features
from schemas.overlay import Overlay

Draft = dict[str, Any]
"""An overlay's fields as JSON values; links and joints by name, and without a scale until one is set."""


def merged(draft: Draft, arguments: Mapping[str, Any]) -> Draft:
    """The draft with these arguments of ``set_parameters`` merged in; a null removes what was set.

    Raises ``InvalidAnswerError`` where the arguments have another shape than their schema.
    """
    new = dict(draft)
    for key in ("scale", "contact_material"):
        if arguments.get(key) is not None:
            new[key] = arguments[key]
    for key, fields in (("links", LINK_FIELDS), ("joints", JOINT_FIELDS)):
        parts = {name: dict(part) for name, part in new.get(key, {}).items()}
        for index, item in enumerate(_rows(arguments, key)):
            where = f"{key}[{index}]"
            name = _name(item, "name", where)
            unknown = sorted(set(item) - set(fields))
            if unknown:
                raise InvalidAnswerError(f"{where}.{short(unknown[0])}: no such field; fields are: {', '.join(fields)}")
            part = {**parts.get(name, {}), **{field: value for field, value in item.items() if field != "name"}}
            parts[name] = {field: value for field, value in part.items() if value is not None}
        new[key] = parts
    starts = dict(new.get("initial_joint_positions", {}))
    for index, item in enumerate(_rows(arguments, "initial_joint_positions")):
        where = f"initial_joint_positions[{index}]"
        name = _name(item, "joint", where)
        unknown = sorted(set(item) - {"joint", "position"})
        if unknown or "position" not in item:
            raise InvalidAnswerError(f"{where}: fields are: joint, position; both are required")
        starts[name] = item["position"]
    new["initial_joint_positions"] = {name: value for name, value in starts.items() if value is not None}
    return new


def checked(draft: Draft, features: Features) -> Overlay | None:
    """The draft as an overlay; None while it has no scale.

    Raises ``InvalidAnswerError`` with every violation: names, signs, numbers that are not finite. Plausibility is not
    checked: the agent has to find that out.
    """
    data = {
        **draft,
        "scale": draft.get("scale", 1.0),
        "links": [{"name": name, **part} for name, part in draft.get("links", {}).items()],
        "joints": [{"name": name, **part} for name, part in draft.get("joints", {}).items()],
    }
    overlay = parse_overlay(json.dumps(data), features)
    return overlay if "scale" in draft else None


def short(text: str) -> str:
    """The text, cut to ``MAX_QUOTED_CHARS``."""
    return text if len(text) <= MAX_QUOTED_CHARS else text[:MAX_QUOTED_CHARS] + "…"


def _rows(arguments: Mapping[str, Any], key: str) -> list[dict[str, Any]]:
    value = arguments.get(key)
    if value is None:
        return []
    if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
        raise InvalidAnswerError(f"{key}: an array of objects is wanted")
    return value


def _name(item: Mapping[str, Any], key: str, where: str) -> str:
    name = item.get(key)
    if not isinstance(name, str):
        raise InvalidAnswerError(f"{where}.{key}: a string is wanted")
    return name
