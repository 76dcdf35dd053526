"""A model's answer parsed, as overlay or refinement step, or an error with every violation; several ones' median."""

import functools
import json
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from statistics import median
from typing import Any, TypeVar, get_args

from pydantic import Field, ValidationError
from pydantic_core import ErrorDetails

from asset2sim.models.lenient_json import parse_json
from schemas.base import Finite, Frozen
from schemas.errors import InvalidAnswerError, first_words, known_names, shortened
from schemas.features import Features
from schemas.overlay import Overlay

_Model = TypeVar("_Model", bound=Frozen)

MAX_VIOLATIONS = 20
"""Violations that a message lists; a model that makes more has misread the question."""

MAX_CHOICES = 40
"""Valid names that a message lists for an unknown one."""


class RefinementAnswer(Frozen):
    """A model's step: whether the state is right, whether it is done, and what to add to which joint's position."""

    state_ok: bool
    approved: bool
    deltas: dict[str, Finite] = Field(default_factory=dict)


class InvalidFieldsError(InvalidAnswerError):
    """An answer whose fields do not fit; ``violations`` has a line for each."""

    def __init__(self, violations: Sequence[str]) -> None:
        self.violations = tuple(violations)
        super().__init__(first_words(self.violations, MAX_VIOLATIONS, "; "))

    def __reduce__(self) -> tuple[object, ...]:
        return InvalidFieldsError, (self.violations,)


def parse_overlay(text: str, features: Features) -> Overlay:
    """The overlay in a model's answer: finite, non-negative, names known and given once, positions for movable joints.

    ``asked`` may list ``scale``, a joint, or a joint's name with a term after a dot (``lid.damping``).
    Raises ``InvalidAnswerError`` with every violation, its path and the valid choices. Whether the numbers are sensible
    is checked by validation.
    """
    overlay = strict_fit(Overlay, parse_json(text))
    links = [link.name for link in features.links]
    joints = [joint.name for joint in features.joints]
    movable = [joint.name for joint in features.movable_joints]
    positions = overlay.initial_joint_positions
    violations = [
        *_name_violations("links", [link.name for link in overlay.links], "link", links),
        *_name_violations("joints", [joint.name for joint in overlay.joints], "joint", joints),
        *_key_violations("initial_joint_positions", positions, "movable joint", movable),
        *_key_violations("uncertainty", overlay.uncertainty, "movable joint, or scale", ("scale", *movable)),
        *(
            f"asked[{index}]: '{_quoted(name)}' is neither 'scale' nor a joint; joints are: {_choices(joints)}"
            for index, name in enumerate(overlay.asked)
            if name != "scale" and name not in joints and not name.startswith(tuple(f"{joint}." for joint in joints))
        ),
        *_dispute_violations(overlay, links, joints),
    ]
    if violations:
        raise InvalidFieldsError(violations)
    return overlay


def _dispute_violations(overlay: Overlay, links: Sequence[str], joints: Sequence[str]) -> list[str]:
    known: dict[str, Sequence[str]] = {"size": ["", "scale"], "mass": links, "contact": links}
    return [
        f"disagrees[{index}].about: '{_quoted(item.about)}' has no {item.quantity}; choose from "
        f"{_choices(known.get(item.quantity, joints))}"
        for index, item in enumerate(overlay.disagrees)
        if item.about not in known.get(item.quantity, joints)
    ]


def parse_refinement(text: str, focus: Sequence[str]) -> RefinementAnswer:
    """The refinement step in a model's answer; deltas only for the focus joints. Raises ``InvalidAnswerError``."""
    answer = strict_fit(RefinementAnswer, parse_json(text))
    violations = _key_violations("deltas", answer.deltas, "focus joint", focus)
    if violations:
        raise InvalidFieldsError(violations)
    return answer


def strict_fit(model: type[_Model], value: object) -> _Model:
    """The model of a JSON value, without conversion of types; raises ``InvalidFieldsError``."""
    if not isinstance(value, dict):
        raise InvalidFieldsError([f"the answer is a JSON {_json_type(value)}; an object is wanted"])
    try:
        # Through JSON again, because strict mode takes a list for a tuple only there.
        return model.model_validate_json(json.dumps(value), strict=True)
    except ValidationError as error:
        raise InvalidFieldsError([_violation(item, model) for item in error.errors(include_url=False)]) from None


def _violation(item: ErrorDetails, model: type[Frozen]) -> str:
    loc = item["loc"]
    path = ".".join(_path(loc))
    if item["type"] == "extra_forbidden":
        return f"{path}: no such field; fields are: {_choices(sorted(_owner(model, loc[:-1]).model_fields))}"
    if item["type"] == "missing":
        return f"{path}: this field is required"
    return f"{path or 'the answer'}: {item['msg']}, not {_quoted(json.dumps(item['input'], default=str))}"


def _owner(model: type[Frozen], loc: Iterable[int | str]) -> type[Frozen]:
    """The record at a place in a model."""
    for name in (item for item in loc if isinstance(item, str) and item in model.model_fields):
        kinds: list[Any] = [model.model_fields[name].annotation]
        for kind in kinds:
            kinds.extend(get_args(kind))
        model = next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Frozen)), model)
    return model


def _path(loc: Iterable[int | str]) -> list[str]:
    parts: list[str] = []
    for item in loc:
        if isinstance(item, int) and parts:
            parts[-1] += f"[{item}]"
        else:
            parts.append(_quoted(str(item)))
    return parts


def _name_violations(path: str, names: Sequence[str], kind: str, known: Sequence[str]) -> list[str]:
    unknown = [
        f"{path}[{index}].name: unknown {kind} '{_quoted(name)}'; {kind}s are: {_choices(known)}"
        for index, name in enumerate(names)
        if name not in known
    ]
    twice = [
        f"{path}: {kind} '{_quoted(name)}' is given {count} times; once is wanted"
        for name, count in Counter(names).items()
        if count > 1
    ]
    return unknown + twice


def _key_violations(path: str, names: Iterable[str], kind: str, known: Sequence[str]) -> list[str]:
    return [
        f"{path}.{_quoted(name)}: '{_quoted(name)}' is not a {kind}; {kind}s are: {_choices(known)}"
        for name in names
        if name not in known
    ]


def _json_type(value: object) -> str:
    names = {list: "array", str: "string", bool: "boolean", type(None): "null"}
    return names.get(type(value), "number")


def _quoted(text: str) -> str:
    return shortened(text, 60)


RULE_FIELDS = (
    "coast_s", "spring_hz", "press_start", "press_end", "closes_s", "stops_within", "returns_s", "damping_level",
    "mechanism", "density_kg_m3", "hollow_factor", "wall_m", "contents",
)  # fmt: skip
"""Fields from which our rules derive numbers; methods that use a model's numbers unchanged do not ask for them."""

OWN_FIELDS = ("mass_change", "effort_n", "effort_nm", "stiff")
"""Fields that only ``prior/household`` fills."""

STATED = ("contact_friction", "restitution")
"""Fields that only the synthesis asks for: what the user states of contacts."""

DISPUTED = ("disagrees",)
"""Fields that only the synthesis asks for, of an object whose file states numbers in metres."""

WITHOUT: dict[str, tuple[str, ...]] = {
    "synthesis": ("sigmas", "notes", *OWN_FIELDS, *DISPUTED),
    "direct": ("sigmas", "notes", "uncertainty", *OWN_FIELDS, *RULE_FIELDS, *STATED, *DISPUTED),
    "ivw": ("notes", "uncertainty", *OWN_FIELDS, *RULE_FIELDS, *STATED, *DISPUTED),
}
"""Purpose → fields of an overlay that its prompt does not ask for."""


@functools.cache
def overlay_schema(purpose: str, *, disputable: bool = False) -> dict[str, Any]:
    """The schema of the answer to ``purpose``; titles, descriptions and defaults are left out, being in the prompt.
    ``disputable``: whether the object has numbers of its own to disagree with."""
    without = frozenset(WITHOUT.get(purpose, OWN_FIELDS)) - (frozenset(DISPUTED) if disputable else frozenset())
    schema: dict[str, Any] = trimmed(Overlay.model_json_schema(), without)
    text = json.dumps(schema)
    schema["$defs"] = {name: item for name, item in schema["$defs"].items() if f"#/$defs/{name}" in text}
    return schema


def trimmed(value: object, without: frozenset[str], words: Sequence[str] = ("title", "description", "default")) -> Any:
    """The schema without these properties, and without what ``words`` name: titles, descriptions and defaults."""
    if isinstance(value, list):
        return [trimmed(item, without, words) for item in value]
    if not isinstance(value, dict):
        return value
    kept = {key: item for key, item in value.items() if key not in words}
    named = kept.pop("properties") if isinstance(value.get("properties"), dict) else None
    rest = {key: trimmed(item, without, words) for key, item in kept.items()}
    if named is not None:
        own = {key: trimmed(item, without, words) for key, item in named.items() if key not in without}
        rest["properties"] = own
    return rest


def _choices(names: Sequence[str]) -> str:
    return known_names(names, MAX_CHOICES) or "none"


_WHOLE: dict[str, Callable[[Any], float]] = {
    "contents": lambda items: sum(item["mass_kg"] for item in items),
    "inertia": lambda six: six[0] + six[3] + six[5],
}
"""Fields that are taken whole, of the answer whose mass or trace is the median: their numbers hang together."""
_BY_NAME = ("links", "joints")
_WEIGHED_BY = ("mass_kg", "wall_m", "hollow_factor")
"""Fields of which one gives a link its mass."""


def median_answer(answers: Sequence[Overlay]) -> Overlay:
    """One overlay of several: each number the median of the answers that state it, each word and boolean the most
    frequent, the first of equals. What at most half of the answers state is left out. Raises ValueError for none."""
    if not answers:
        raise ValueError("there is no answer to take the median of")
    if len(answers) == 1:
        return answers[0]
    dumped = [answer.model_dump(mode="json", exclude_none=True, exclude={"notes"}) for answer in answers]
    merged = _merged(dumped) | {"notes": (f"median of {len(answers)} answers", *answers[0].notes)}
    return Overlay.model_validate(merged)


def _merged(items: Sequence[dict[str, Any]]) -> dict[str, Any]:
    names = dict.fromkeys(name for item in items for name in item)
    stated = {name: [item[name] for item in items if name in item] for name in names}
    return {name: _one(name, values) for name, values in stated.items() if 2 * len(values) > len(items)}


def _one(name: str, values: Sequence[Any]) -> Any:
    first = values[0]
    if name in _BY_NAME:
        return _named(values)
    if name in _WHOLE:
        middle = sorted(values, key=_WHOLE[name])
        return middle[(len(middle) - 1) // 2]
    if name == "asked":
        said = Counter(item for value in values for item in dict.fromkeys(value))
        return tuple(item for item, count in said.items() if 2 * count > len(values))
    if name in ("support", "mass_change"):  # of one piece
        kinds = Counter(str(value.get("kind")) for value in values)
        return next(value for value in values if str(value.get("kind")) == kinds.most_common(1)[0][0])
    if isinstance(first, dict):
        return _merged(values)
    if isinstance(first, bool | str):
        return Counter(values).most_common(1)[0][0]
    if isinstance(first, list):
        return [median(column) for column in zip(*values, strict=True)]
    return median(values)


def _named(lists: Sequence[list[dict[str, Any]]]) -> list[dict[str, Any]]:
    """Parts by their names, those that more than half of the answers have."""
    parts: dict[str, list[dict[str, Any]]] = {}
    for part in (part for items in lists for part in items):
        parts.setdefault(part["name"], []).append(part)
    return [_weighable(_merged(items), items[0]) for items in parts.values() if 2 * len(items) > len(lists)]


def _weighable(part: dict[str, Any], first: dict[str, Any]) -> dict[str, Any]:
    """The part with what it weighs by: where every answer says it another way, as the first does."""
    known = any(name in part for name in _WEIGHED_BY)
    return (
        part if known else {**{name: first[name] for name in (*_WEIGHED_BY, "density_kg_m3") if name in first}, **part}
    )
