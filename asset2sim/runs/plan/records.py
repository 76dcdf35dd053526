"""Records of finished assets, one file each, from the moment that they finish until the catalog holds them.

Whoever refines an asset writes its file, on whichever machine; the run reads it."""

import contextlib
import json
import logging
import os
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from pydantic import BaseModel, ValidationError

from schemas.asset import AssetRecord
from schemas.base import Frozen
from schemas.request import ModelCall
from schemas.vocabulary import Redo

_sets: dict[type[BaseModel], set[str]] = {}


def lean(value: object) -> None:
    """Have all models of one type within ``value`` share the set of the fields that were given to them.

    Pydantic keeps such a set in every model: ten real records took 208 kB each in memory, and take 95 kB so. The
    models are frozen, so nobody changes the sets.
    """
    if isinstance(value, BaseModel):
        given = value.__pydantic_fields_set__
        shared = _sets.setdefault(type(value), given)
        if shared is not given and shared == given:
            object.__setattr__(value, "__pydantic_fields_set__", shared)
        for part in value.__dict__.values():
            lean(part)
    elif isinstance(value, tuple):
        for part in value:
            lean(part)


FOLDER = ".cache/records"
"""Under the output folder: a run that is killed leaves here what it had finished."""
VISIBLE_LIMIT_S = 10.0
"""Time in which a file that another machine wrote must be seen here, s: NFS looks again after 3 s and more."""
VISIBLE_POLL_S = 0.1
"""Time between two looks for it, s."""

logger = logging.getLogger(__name__)


class KeptRecord(Frozen):
    """A finished asset's record, the run that finished it, and what that run was to refine again.

    ``attempt`` is 2 where it was tried once more; ``died`` says how the asset's process died where it is still to be
    tried once more.
    """

    run_id: str
    redo: Redo
    record: AssetRecord
    attempt: int = 1
    died: str = ""


def record_file(out: Path, content_hash: str) -> Path:
    """Where the record of this content is kept."""
    return out / FOLDER / f"{content_hash}.json"


def write_record(out: Path, kept: KeptRecord) -> None:
    """Write the record; whoever reads sees all of it or nothing. Raises OSError, and leaves nothing, where it cannot be
    written."""
    file = record_file(out, kept.record.content_hash)
    # Two workers may have the same asset where the scheduler took one for lost.
    part = file.with_suffix(f".{uuid.uuid4().hex[:8]}.part")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        # Python's own JSON keeps the infinite numbers of what exploded.
        part.write_text(json.dumps(kept.model_dump(mode="json")), encoding="utf-8", errors="surrogatepass")
        os.replace(part, file)
    except OSError:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def keep_record(out: Path, kept: KeptRecord) -> None:
    """Write the record as ``write_record`` does. On a full disk the run goes on, and loses it only if it is killed."""
    try:
        write_record(out, kept)
    except OSError as error:
        logger.warning("cannot keep what has finished in %s (%s)", out / FOLDER, error.strerror)


def read_record(out: Path, content_hash: str) -> KeptRecord | None:
    """The record that is kept of this content; None where there is none, or a damaged or another version's."""
    try:
        text = record_file(out, content_hash).read_text(encoding="utf-8", errors="surrogatepass")
        kept = KeptRecord.model_validate(json.loads(text))
    except (OSError, ValueError, ValidationError):
        return None
    lean(kept)
    return kept if kept.record.content_hash == content_hash else None


def await_record(out: Path, content_hash: str, run_id: str, attempt: int) -> KeptRecord | None:
    """The record that another process has just written in this run, at this attempt or a later one; None where it is
    not seen within ``VISIBLE_LIMIT_S``."""
    end = time.monotonic() + VISIBLE_LIMIT_S
    while True:
        kept = read_record(out, content_hash)
        if kept is not None and kept.run_id == run_id and kept.attempt >= attempt:
            return kept
        if time.monotonic() > end:
            return None
        time.sleep(VISIBLE_POLL_S)
        _look_again(out / FOLDER)


def kept_records(out: Path) -> Iterator[KeptRecord]:
    """The records that earlier runs left; what is damaged or of another version is removed."""
    folder = out / FOLDER
    for file in sorted(folder.iterdir()) if folder.is_dir() else ():
        kept = read_record(out, file.stem) if file.suffix == ".json" else None
        if kept is not None:
            yield kept
            continue
        with contextlib.suppress(OSError):
            file.unlink()


def drop_record(out: Path, content_hash: str) -> None:
    """The record is in the catalog, or of no use any more."""
    with contextlib.suppress(OSError):
        record_file(out, content_hash).unlink(missing_ok=True)


def _look_again(folder: Path) -> None:
    """Have a network file system ask its server what is in the folder: opening one does, looking for a file may not."""
    with contextlib.suppress(OSError):
        os.close(os.open(folder, os.O_RDONLY))


CALLS_FOLDER = ".cache/calls"
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
    return out / CALLS_FOLDER / f"{content_hash}.jsonl"
