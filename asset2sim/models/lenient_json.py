"""Parsing of JSON as models write it: fenced, in prose, with comments or trailing commas; nothing is guessed. The
forgiving grammar is JSON5's (the ``json5`` package). A package that repairs JSON would also complete an answer that was
cut off and keep the last of two values under one key, and so state physics that the model did not."""

import itertools
import json
import math
import re
from collections.abc import Iterable, Iterator

from schemas.errors import InvalidAnswerError, shortened

MAX_CHARACTERS = 1_000_000
"""Longest answer that is parsed: far beyond what the largest object needs."""
MAX_FORGIVEN_CHARACTERS = 100_000
"""Longest answer that is parsed as JSON5, which takes 10 s for a megabyte."""
_MAX_PIECES = 100
"""Code fences or objects that are tried in an answer, which should have one."""
_MAX_STRAY_BRACES = 5
"""Unclosed braces that prose may have; each costs a scan of all the text after it."""

_FENCE = re.compile(r"```[\w-]*[ \t]*\n(.*?)```", re.DOTALL)
_END_OF_THINKING = re.compile(r"</think(?:ing)?>")
_OBJECT_START = re.compile(r"""\{\s*(?:["'}]|//|/\*|\w+\s*:)""")
# Unclosed tokens match to the end of the text: a failure there would cost another scan from the next quote.
_TOKENS = re.compile(r'"(?:[^"\\]|\\.)*"?|//[^\n]*|/\*.*?(?:\*/|\Z)|[{}]', re.DOTALL)


def parse_json(text: str) -> object:
    """The JSON value in a model's answer. Raises ``InvalidAnswerError`` where there is none, or several, or NaN in it.
    A text that is JSON as a whole is that value. Otherwise one object is searched for in code fences, then anywhere;
    equal objects count as one."""
    if len(text) > MAX_CHARACTERS:
        raise InvalidAnswerError(f"the answer has {len(text)} characters; the most that is read is {MAX_CHARACTERS}")
    forgiving = len(text) <= MAX_FORGIVEN_CHARACTERS
    try:
        value = _parse_one(text, forgiving)
    except _NotJsonError as whole:
        value = _find_object(_END_OF_THINKING.split(text)[-1], str(whole), forgiving)
    _refuse_non_finite(value)
    return value


class _NotJsonError(Exception):
    """This piece of text is not one JSON value; the message says why."""


def _find_object(text: str, reason: str, forgiving: bool) -> object:
    for pieces in ((fence.group(1) for fence in _FENCE.finditer(text)), _objects(text)):
        found: list[object] = []
        for piece in itertools.islice(pieces, _MAX_PIECES):
            try:
                value = _parse_one(piece, forgiving)
            except _NotJsonError as error:
                reason = str(error)
                continue
            if isinstance(value, dict) and value not in found:
                found.append(value)
        if len(found) == 1:
            return found[0]
        if found:
            raise InvalidAnswerError(f"the answer holds {len(found)} different JSON objects; exactly one is wanted")
    raise InvalidAnswerError(f"the answer is not JSON: {reason}")


def _parse_one(text: str, forgiving: bool) -> object:
    """One JSON value, as strict JSON if possible, else as JSON5."""
    try:
        return json.loads(text, object_pairs_hook=_unique)
    except InvalidAnswerError:
        raise
    except RecursionError:
        raise _NotJsonError("it is nested too deeply") from None
    except ValueError as error:
        strict_reason = _shorten(str(error))
    if not forgiving or "{" not in text:
        raise _NotJsonError(strict_reason)
    import json5

    try:
        return json5.loads(text, object_pairs_hook=_unique)
    except RecursionError:
        raise _NotJsonError("it is nested too deeply") from None
    except ValueError as error:
        reason = _shorten(str(error).removeprefix("<string>:"))
        raise _NotJsonError(f"{strict_reason} (as JSON5: {reason})") from None


def _objects(text: str) -> Iterator[str]:
    """Stretches of text from an opening brace to the brace that closes it, outermost only."""
    position, strays = 0, 0
    while strays < _MAX_STRAY_BRACES and (start := text.find("{", position)) >= 0:
        end = _closing(text, start)
        if end is not None:
            yield text[start:end]
            position = end
        elif _OBJECT_START.match(text, start):
            # Not a brace in prose: a part of a truncated object must not count as the whole.
            raise InvalidAnswerError("the answer is not JSON: it ends inside an object; a shorter answer is wanted")
        else:
            strays += 1
            position = start + 1


def _closing(text: str, start: int) -> int | None:
    """The index behind the brace that closes the one at ``start``; None where the text ends before."""
    depth = 0
    for token in _TOKENS.finditer(text, start):
        if token.group() == "{":
            depth += 1
        elif token.group() == "}":
            depth -= 1
            if depth == 0:
                return token.end()
    return None


def _unique(pairs: Iterable[tuple[str, object]]) -> dict[str, object]:
    items = list(pairs)
    value = dict(items)
    if len(value) != len(items):
        names = [name for name, _ in items]
        twice = sorted({name for name in names if names.count(name) > 1})
        raise InvalidAnswerError(f"the same key stands twice in one object: {_shorten(', '.join(twice))}")
    return value


def _refuse_non_finite(value: object) -> None:
    """Raise where a number is not finite; without recursion, since depth is the model's choice."""
    todo: list[tuple[str, object]] = [("", value)]
    while todo:
        path, item = todo.pop()
        if isinstance(item, dict):
            todo.extend((f"{path}.{key}" if path else str(key), part) for key, part in item.items())
        elif isinstance(item, list):
            todo.extend((f"{path}[{index}]", part) for index, part in enumerate(item))
        elif isinstance(item, float) and not math.isfinite(item):
            raise InvalidAnswerError(f"{_shorten(path) or 'the answer'}: {item} is not a finite number")


def _shorten(text: str) -> str:
    return shortened(" ".join(text.split()), 120)
