"""Model calls of an asset that is in work, kept as they are made: its worker may be lost with what they cost."""

import contextlib
import json
from collections.abc import Callable, Iterable
from pathlib import Path

from pydantic import ValidationError

from schemas.request import ModelCall

FOLDER = ".cache/calls"
"""Under the output folder: a file per asset in work that has asked, named by its content hash."""


def paid_calls(out: Path, content_hash: str) -> tuple[ModelCall, ...]:
    """The calls, answers out of the cache apart, of an attempt that was lost before it came to a record."""
    try:
        lines = _file(out, content_hash).read_text(encoding="utf-8").splitlines()
        return tuple(ModelCall.model_validate(json.loads(line)) for line in lines)
    except (OSError, ValueError, ValidationError):
        return ()


def keeping_calls(out: Path, content_hash: str) -> Callable[[Iterable[ModelCall]], None]:
    """A function that keeps calls as they are made; where the disk takes none, they are lost if their worker is."""

    def keep(calls: Iterable[ModelCall]) -> None:
        lines = "".join(f"{json.dumps(call.model_dump(mode='json'))}\n" for call in calls if not call.cached)
        if not lines:
            return
        with contextlib.suppress(OSError):
            file = _file(out, content_hash)
            file.parent.mkdir(parents=True, exist_ok=True)
            with file.open("a", encoding="utf-8") as stream:
                stream.write(lines)

    return keep


def drop_calls(out: Path, content_hash: str) -> None:
    """A record holds them."""
    with contextlib.suppress(OSError):
        _file(out, content_hash).unlink(missing_ok=True)


def _file(out: Path, content_hash: str) -> Path:
    return out / FOLDER / f"{content_hash}.jsonl"
