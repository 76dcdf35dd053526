"""Records of finished assets, files of their workers until the catalog has them: what a killed run leaves."""

import contextlib
import json
import logging
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import BaseModel, ValidationError

from asset2sim.storage.regular_files import write_whole
from schemas.asset import AssetRecord, AssetRef
from schemas.base import Frozen
from schemas.request import ModelCall
from schemas.vocabulary import Redo

_sets: dict[tuple[type[BaseModel], frozenset[str]], set[str]] = {}


def share_field_sets(value: object) -> None:
    """Let models of one type within ``value`` whose sets of given fields are equal share one such set. It never
    changes: the models are frozen. Ten real records took 208 kB each in memory, and take 95 kB so."""
    left = [value]
    while left:
        part = left.pop()
        if isinstance(part, tuple):
            left += part
        elif isinstance(part, BaseModel):
            given = part.__pydantic_fields_set__
            shared = _sets.setdefault((type(part), frozenset(given)), given)
            object.__setattr__(part, "__pydantic_fields_set__", shared)
            left += part.__dict__.values()


RECORDS_FOLDER = ".cache/records"
"""Under the output folder: a run that is killed leaves here what it had finished."""
logger = logging.getLogger(__name__)


class KeptRecord(Frozen):
    """A finished asset's record, the run that finished it, and that run's ``redo`` setting. ``attempt`` is 2 for a
    second attempt. ``died`` says how the attempt's process died; set on attempt 1, a second attempt is due."""

    run_id: str
    redo: Redo
    record: AssetRecord
    attempt: int = 1
    died: str = ""


def record_file(out: Path, content_hash: str) -> Path:
    """Where the record of this content is kept."""
    return out / RECORDS_FOLDER / f"{content_hash}.json"


def write_record(out: Path, kept: KeptRecord) -> None:
    """Write the record's file atomically. Raises OSError, and leaves no file, where it cannot be written."""
    # Python's own JSON keeps the infinite numbers of what exploded.
    text = json.dumps(kept.model_dump(mode="json"))
    write_whole(record_file(out, kept.record.content_hash), text.encode("utf-8", "surrogatepass"))


def keep_record(out: Path, kept: KeptRecord) -> None:
    """``write_record`` that warns instead of raising: without the file, a record is lost only if the run is killed."""
    try:
        write_record(out, kept)
    except OSError as error:
        logger.warning("cannot keep what has finished in %s (%s)", out / RECORDS_FOLDER, error.strerror)


def read_record(out: Path, content_hash: str) -> KeptRecord | None:
    """The kept record of this content hash; None where it is missing, damaged or of another version."""
    try:
        text = record_file(out, content_hash).read_text(encoding="utf-8", errors="surrogatepass")
        kept = KeptRecord.model_validate(json.loads(text))
    except (OSError, ValueError, ValidationError):
        return None
    share_field_sets(kept)
    return kept if kept.record.content_hash == content_hash else None


def kept_records(out: Path, *, clean: bool = True) -> Iterator[KeptRecord]:
    """The records that earlier runs left; what is damaged or of another version is removed where ``clean``."""
    folder = out / RECORDS_FOLDER
    for file in sorted(folder.iterdir()) if folder.is_dir() else ():
        kept = read_record(out, file.stem) if file.suffix == ".json" else None
        if kept is not None:
            yield kept
        elif clean:
            with contextlib.suppress(OSError):
                file.unlink()


def drop_record(out: Path, content_hash: str) -> None:
    """Delete a record's file, once the catalog holds it or it is of no use any more."""
    with contextlib.suppress(OSError):
        record_file(out, content_hash).unlink(missing_ok=True)


@dataclass(frozen=True)
class LeftRecords(Collection[AssetRecord]):
    """Records that a killed run left for these assets, each read from its file as it is asked for."""

    out: Path
    refs: tuple[AssetRef, ...] = ()
    hashes: Mapping[str, str] = field(default_factory=dict)

    def __iter__(self) -> Iterator[AssetRecord]:
        for ref in self.refs:
            if (kept := read_record(self.out, self.hashes[ref.asset_id])) is not None:
                yield kept.record.model_copy(update={"ref": ref})

    def __len__(self) -> int:
        return len(self.refs)

    def __contains__(self, item: object) -> bool:
        return any(record == item for record in self)


CALLS_FOLDER = ".cache/calls"
"""Under the output folder: a file per asset in work that has asked, named by its content hash."""


def paid_calls(out: Path, content_hash: str) -> tuple[ModelCall, ...]:
    """Uncached model calls of an attempt that was lost before it had a record."""
    try:
        lines = _calls_file(out, content_hash).read_text(encoding="utf-8").splitlines()
        return tuple(ModelCall.model_validate(json.loads(line)) for line in lines)
    except (OSError, ValueError, ValidationError):
        return ()


def call_writer(out: Path, content_hash: str) -> Callable[[Iterable[ModelCall]], None]:
    """A function that writes model calls to disk as they are made; on a full disk it writes none, and goes on."""

    def keep(calls: Iterable[ModelCall]) -> None:
        lines = "".join(f"{json.dumps(call.model_dump(mode='json'))}\n" for call in calls if not call.cached)
        if not lines:
            return
        with contextlib.suppress(OSError):
            file = _calls_file(out, content_hash)
            file.parent.mkdir(parents=True, exist_ok=True)
            with file.open("a", encoding="utf-8") as stream:
                stream.write(lines)

    return keep


def delete_paid_calls(out: Path, content_hash: str) -> None:
    """Delete the kept calls, once a record holds them."""
    with contextlib.suppress(OSError):
        _calls_file(out, content_hash).unlink(missing_ok=True)


def _calls_file(out: Path, content_hash: str) -> Path:
    return out / CALLS_FOLDER / f"{content_hash}.jsonl"
