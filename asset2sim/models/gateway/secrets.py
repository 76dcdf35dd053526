"""Removal of API keys from everything that is written or shown."""

import os
import re

SHORTEST_SECRET = 8
"""Characters from which a variable's value counts as a secret: shorter ones are words like ``none``."""

_SECRET_NAME = re.compile(r"KEY|TOKEN|SECRET|PASSWORD|CREDENTIAL", re.IGNORECASE)
_SECRET_SHAPE = re.compile(
    r"(?i)\b(?:sk|pk|rk|gsk|xai|hf|r8)[-_][\w*.-]{6,}"  # keys as OpenAI, Anthropic, Groq, xAI and others shape them
    r"|\bAIza[\w*-]{10,}"
    r"|\bAKIA[\w*]{8,}"
    r"|\bbearer\s+[^\s'\",}]+"
    r"|(?<=key=)[^\s&'\",}]+"
    r"|(?<=://)[^/\s@]+(?=@)"
)
_ESCAPED = re.compile(r"(?<!\\)((?:\\\\)*)(?:\\u00([0-9a-fA-F]{2})|\\(/))")
REDACTED = "***"


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
    values = {
        value for name, value in os.environ.items() if len(value) >= SHORTEST_SECRET and _SECRET_NAME.search(name)
    }
    return sorted(values, key=lambda value: (-len(value), value))


def _unescaped(match: re.Match[str]) -> str:
    character = chr(int(match.group(2), 16)) if match.group(2) else match.group(3)
    return match.group(0) if character in '"\\' or not character.isprintable() else match.group(1) + character
