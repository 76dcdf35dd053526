"""The JSON Schema of an overlay, for models that can be held to one: what a purpose asks for, and no prose."""

import functools
from typing import Any

from schemas.overlay import Overlay

FELT = (
    "coast_s", "spring_hz", "closes_s", "stops_within", "returns_s", "damping_level", "density_kg_m3", "hollow_factor",
)  # fmt: skip
"""Fields from which rules of ours derive numbers: a method that takes an answer as it is does not ask for them."""
WITHOUT: dict[str, tuple[str, ...]] = {
    "synthesis": ("sigmas",),
    "direct": ("sigmas", *FELT),
    "ivw": FELT,
}
"""Purpose → fields of an overlay that its prompt does not ask for."""


@functools.cache
def overlay_schema(purpose: str) -> dict[str, Any]:
    """The schema of the answer to ``purpose``; titles, descriptions and defaults are left out, being in the prompt."""
    schema = trimmed(Overlay.model_json_schema(), frozenset(WITHOUT.get(purpose, ())))
    assert isinstance(schema, dict)
    return schema


def trimmed(value: object, without: frozenset[str]) -> object:
    """The schema without these properties, and without what is there for people."""
    if isinstance(value, list):
        return [trimmed(item, without) for item in value]
    if not isinstance(value, dict):
        return value
    kept = {key: item for key, item in value.items() if key not in ("title", "description", "default")}
    if isinstance(value.get("properties"), dict):
        kept["properties"] = {name: trimmed(item, without) for name, item in value["properties"].items()}
        kept["properties"] = {name: item for name, item in kept["properties"].items() if name not in without}
        rest = {key: trimmed(item, without) for key, item in kept.items() if key != "properties"}
        return {**rest, "properties": kept["properties"]}
    return {key: trimmed(item, without) for key, item in kept.items()}
