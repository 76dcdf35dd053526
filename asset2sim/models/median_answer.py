"""The median of several answers about one object: numbers by median, words and booleans by vote."""

from collections import Counter
from collections.abc import Callable, Sequence
from statistics import median
from typing import Any

from schemas.overlay import Overlay

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
