"""Records of finished assets, one file each, from the moment that they finish until the catalog holds them."""

import contextlib
import json
import logging
import os
from collections.abc import Iterator
from pathlib import Path

from pydantic import ValidationError

from schemas.asset import AssetRecord
from schemas.base import Frozen
from schemas.vocabulary import Redo

FOLDER = ".cache/records"
"""Under the output folder: a run that is killed leaves here what it had finished."""

logger = logging.getLogger(__name__)


class KeptRecord(Frozen):
    """A finished asset's record, the run that finished it, and what that run was to refine again."""

    run_id: str
    redo: Redo
    record: AssetRecord


def record_file(out: Path, content_hash: str) -> Path:
    """Where the record of this content is kept."""
    return out / FOLDER / f"{content_hash}.json"


def keep_record(out: Path, kept: KeptRecord) -> None:
    """Write the record; whoever reads sees all of it or nothing. On a full disk the run goes on, and loses the record
    only if it is killed."""
    file = record_file(out, kept.record.content_hash)
    part = file.with_suffix(".part")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        # Python's own JSON keeps the infinite numbers of what exploded.
        part.write_text(json.dumps(kept.model_dump(mode="json")), encoding="utf-8", errors="surrogatepass")
        os.replace(part, file)
    except OSError as error:
        logger.warning("cannot keep what has finished in %s (%s)", file.parent, error.strerror)
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def kept_records(out: Path) -> Iterator[KeptRecord]:
    """The records that earlier runs left; what is damaged or of another version is removed."""
    folder = out / FOLDER
    for file in sorted(folder.iterdir()) if folder.is_dir() else ():
        try:
            text = file.read_text(encoding="utf-8", errors="surrogatepass")
            kept = KeptRecord.model_validate(json.loads(text))
            if file == record_file(out, kept.record.content_hash):
                yield kept
                continue
        except (OSError, ValueError, ValidationError):
            pass
        with contextlib.suppress(OSError):
            file.unlink()


def drop_record(out: Path, content_hash: str) -> None:
    """The record is in the catalog, or of no use any more."""
    with contextlib.suppress(OSError):
        record_file(out, content_hash).unlink(missing_ok=True)
