"""Parameters set by an agent so far: merged field by field and validated like an overlay's JSON."""

import json
from typing import Any

from asset2sim.models.answers import parse_overlay
from lab.methods.agent.specs import SetParameters
from schemas.features import Features
from schemas.overlay import Overlay

Draft = dict[str, Any]
"""An overlay's fields as JSON values; links and joints by name, and without a scale until one is set."""


def merged(draft: Draft, given: SetParameters) -> Draft:
    """The draft with these arguments merged in; a null removes what was set."""
    stated = {"scale": given.scale, "contact_material": given.contact_material}
    new = draft | {key: value for key, value in stated.items() if value is not None}
    for key, items in (("links", given.links), ("joints", given.joints)):
        parts = dict(new.get(key, {}))
        for item in items:
            fields = parts.get(item.name, {}) | item.model_dump(exclude_unset=True)
            parts[item.name] = {field: value for field, value in fields.items() if value is not None}
        new[key] = parts
    starts = new.get("initial_joint_positions", {}) | {
        item.joint: item.position for item in given.initial_joint_positions
    }
    return new | {"initial_joint_positions": {name: at for name, at in starts.items() if at is not None}}


def checked(draft: Draft, features: Features) -> Overlay | None:
    """The draft as an overlay; None while it has no scale.

    Raises ``InvalidAnswerError`` with every violation: names, signs, numbers that are not finite. Plausibility is not
    checked: the agent has to find that out.
    """
    data = {
        **draft,
        "scale": draft.get("scale", 1.0),
        "links": list(draft.get("links", {}).values()),
        "joints": list(draft.get("joints", {}).values()),
    }
    overlay = parse_overlay(json.dumps(data), features)
    return overlay if "scale" in draft else None
