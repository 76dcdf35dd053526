"""Values that may hold a key: whole in this process and in the pickles between its workers, redacted as JSON, which is
what tables, logs and Prefect keep."""

import os
import re
from typing import Annotated
from urllib.parse import urlsplit

from pydantic import PlainSerializer, SerializationInfo

REDACTED = "***"
WHOLE = "whole"
"""Key of a serialization context that asks for the values as they are: ``model_dump_json(context={WHOLE: True})``."""
_KEY_SEGMENT = re.compile(r"(?=[^/]*\d)(?=[^/]*[A-Za-z])[\w.~+=-]{20,}")
"""A part of a path that looks like a key: letters and digits, 20 and more."""
SHORTEST_SECRET = 8
"""Characters from which a variable's value counts as a secret: shorter ones are words like ``none``."""

_SECRET_NAME = re.compile(r"KEY|TOKEN|SECRET|PASSWORD|CREDENTIAL", re.IGNORECASE)
_SECRET_SHAPE = re.compile(
    r"(?i)\b(?:sk|pk|rk|gsk|xai|hf|r8)[-_][\w*.-]{6,}"  # keys as OpenAI, Anthropic, Groq, xAI and others shape them
    r"|\bAIza[\w*-]{10,}|\bAKIA[\w*]{8,}"
    r"|\bbearer\s+[^\s'\",}]+"
    r"|(?<=key=)[^\s&'\",}]+"
    r"|(?<=://)[^/\s@]+(?=@)"
)
_ESCAPED = re.compile(r"(?<!\\)((?:\\\\)*)(?:\\u00([0-9a-fA-F]{2})|\\(/))")


def redact(text: str) -> str:
    """The text without anything that looks like a key or stands in a secret's environment variable."""
    for value in _secrets():
        text = text.replace(value, REDACTED)
    return _SECRET_SHAPE.sub(REDACTED, text)


def redact_answer(text: str) -> str:
    """A model's answer without the keys that this process holds, should a server echo one.

    Only values are looked for, not shapes: a part may be called ``sk_handle_01``. A key that is spelt with JSON escapes
    is found too; the answer is then written without them, which leaves its meaning. Values of letters or of digits
    alone are left, since an answer is made of words and numbers.
    """
    secrets = [value for value in _secrets() if not value.isalpha() and not value.isdigit()]
    plain = _ESCAPED.sub(_unescaped, text)
    if any(value in plain for value in secrets):
        text = plain
    for value in secrets:
        text = text.replace(value, REDACTED)
    return text


def _secrets() -> list[str]:
    """Values of variables that are named like secrets, longest first: one may be part of another."""
    values = {text for name, text in os.environ.items() if len(text) >= SHORTEST_SECRET and _SECRET_NAME.search(name)}
    return sorted(values, key=lambda value: (-len(value), value))


def _unescaped(match: re.Match[str]) -> str:
    character = chr(int(match.group(2), 16)) if match.group(2) else match.group(3)
    return match.group(0) if character in '"\\' or not character.isprintable() else match.group(1) + character


def redacted_address(address: str) -> str:
    """A URL without its user, query and fragment, and without parts of its path that look like keys."""
    try:
        parts = urlsplit(address)
    except ValueError:
        return REDACTED
    user, at, host = parts.netloc.rpartition("@")
    path = "/".join(REDACTED if _KEY_SEGMENT.fullmatch(part) else part for part in parts.path.split("/"))
    more = f"?{REDACTED}" if parts.query else ""
    scheme = f"{parts.scheme}://" if parts.scheme else ""
    return f"{scheme}{REDACTED if user else ''}{at}{host}{path}{more}{f'#{REDACTED}' if parts.fragment else ''}"


def secret_parts(address: str | None) -> tuple[str, ...]:
    """The texts that ``redacted_address`` hides, longest first."""
    try:
        parts = urlsplit(address or "")
    except ValueError:
        return (address or "",)
    user = parts.netloc.rpartition("@")[0]
    keys = (part for part in parts.path.split("/") if _KEY_SEGMENT.fullmatch(part))
    values = (pair.partition("=")[2] for pair in parts.query.split("&"))
    found = {user, *user.split(":", 1)[1:], parts.query, *values, parts.fragment, *keys}
    return tuple(sorted((text for text in found if len(text) > 2), key=lambda text: (-len(text), text)))


def _hidden(value: str | None, info: SerializationInfo) -> str | None:
    return value if value is None or _is_whole(info) else REDACTED


def _hidden_parts(value: str | None, info: SerializationInfo) -> str | None:
    return value if value is None or _is_whole(info) else redacted_address(value)


def _is_whole(info: SerializationInfo) -> bool:
    return bool(isinstance(info.context, dict) and info.context.get(WHOLE))


Secret = Annotated[str, PlainSerializer(_hidden, return_type=str, when_used="json")]
"""A text that is a secret as a whole, such as a hook with the address of a chat room."""
Address = Annotated[str, PlainSerializer(_hidden_parts, return_type=str, when_used="json")]
"""A URL that may hold a secret."""
