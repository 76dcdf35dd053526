"""Refusals of a settings model, each a line that says what would be right; for command lines and settings files."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

Schema = Mapping[str, Any]


Place = tuple[int | str, ...]


def mistakes_in(error: ValidationError, model: type[BaseModel]) -> Iterator[tuple[Place, str]]:
    """Where each refused value stands, and what is wrong with it: "'0' is not a whole number from 1 on"."""
    told = set[Place]()
    for found in error.errors(include_url=False):
        # Of a list one, and of what may be of several kinds.
        field = tuple(part for part in found["loc"] if isinstance(part, str))
        if field not in told:
            told.add(field)
            yield found["loc"], _mistake(found, model)


def _mistake(found: ErrorDetails, model: type[BaseModel]) -> str:
    place = found["loc"]
    if found["type"] == "value_error":
        return str(found["ctx"]["error"])
    schema = schema_at(model, place)
    value = ", ".join(map(str, found["input"])) if isinstance(found["input"], list) else found["input"]
    if "enum" in schema or "const" in schema:
        return f"invalid choice: '{value}' (choose from {', '.join(schema.get('enum', [schema.get('const')]))})"
    if found["type"] in ("missing", "too_short", "too_long"):
        whole = schema_at(model, [part for part in place if isinstance(part, str)])
        return f"expected {whole.get('minItems', 1)} arguments"
    return f"'{value}' is not {condition_in_words(schema)}"


def condition_in_words(schema: Schema) -> str:
    """Condition of a value, in words: "a number above 0"."""
    kinds = {"integer": "a whole number", "number": "a number", "boolean": "true or false", "string": "a text"}
    kind = kinds.get(schema.get("type", ""))
    if kind is None:
        return "a list" if schema.get("type") == "array" else "a section of fields"
    above, least, most = (schema.get(name) for name in ("exclusiveMinimum", "minimum", "maximum"))
    if above is not None:
        return f"{kind} above {above:g}"
    if least is not None:
        return f"{kind} from {least:g} {'on' if most is None else f'to {most:g}'}"
    return kind


def schema_at(model: type[BaseModel], place: Sequence[int | str]) -> Schema:
    """The JSON schema of the field at a place in a model; what else may be null is left out."""
    root = model.model_json_schema()
    schema = _resolved(root, root)
    for part in place:
        if isinstance(part, str):
            schema = schema.get("properties", {}).get(part, {})
        else:
            schema = schema.get("items") or (schema.get("prefixItems", [])[part : part + 1] or [{}])[0]
        schema = _resolved(schema, root)
    return schema


def _resolved(schema: Schema, root: Schema) -> Schema:
    while "$ref" in schema or "anyOf" in schema:
        if "$ref" in schema:
            schema = root["$defs"][schema["$ref"].rpartition("/")[2]]
        else:
            schema = next(kind for kind in schema["anyOf"] if kind.get("type") != "null")
    return schema
