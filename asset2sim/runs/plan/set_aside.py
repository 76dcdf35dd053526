"""Setting aside what an earlier run refined, where a later one failed: it does not stay under the failed row, and is
not lost."""

import os
import shutil
from contextlib import suppress
from pathlib import Path

from asset2sim.storage.objects import copy_objects, digest_of, list_objects, remove_objects
from schemas.asset import AssetRecord
from schemas.finding import remark
from schemas.vocabulary import Stage, Status

FOLDER = "set_aside"
"""Under the output folder: the last refinement of each asset that has failed since."""
CODE = "set_aside"
"""Code of the finding that says where an asset's earlier refinement is."""

Stamp = tuple[int, int]
"""What tells one folder of a name from another: its inode, and when its list of files last changed, ns."""


def stamp_of_folder(folder: Path) -> Stamp | None:
    """The stamp of a folder; None where there is none."""
    try:
        found = os.stat(folder)
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def set_aside(out: Path, record: AssetRecord, before: Stamp | str | None) -> AssetRecord:
    """Move the refined folder of a failed asset that is as it was ``before`` the run out of ``assets``, and remove what
    was set aside of an asset that passes. Returns the record, with a finding where the folder was moved, also where
    that was at an earlier call."""
    asset_id = record.ref.asset_id
    folder, place = out / "assets" / asset_id, out / FOLDER / asset_id
    if record.status is Status.OK:
        if place.exists():
            shutil.rmtree(place, ignore_errors=True)
        return record
    if before is None or stamp_of_folder(folder) not in (before, None):
        return record
    with suppress(OSError):
        if folder.exists():
            place.parent.mkdir(parents=True, exist_ok=True)
            if place.exists():
                shutil.rmtree(place)
            os.rename(folder, place)
    if folder.exists() or not place.exists():
        return record
    return with_finding(record)


def with_finding(record: AssetRecord) -> AssetRecord:
    """The failed record with the finding that says where its asset's earlier refinement is."""
    asset_id = record.ref.asset_id
    message = f"asset {asset_id}: this run failed, and what an earlier one refined is in {FOLDER}/{asset_id} now"
    finding = remark(Stage.PUBLISH, CODE, message)
    return record.model_copy(update={"findings": (*record.findings, finding)})


def set_aside_stored(url: str, record: AssetRecord, before: Stamp | str | None) -> AssetRecord:
    """``set_aside`` behind a URL: move the refined folder of a failed asset that is as it was ``before`` the run (its
    digest) out of ``assets``, and remove what was set aside of an asset that passes and had none. Returns the record,
    with a finding where the folder was moved. Raises StoreError."""
    asset_id = record.ref.asset_id
    folder, place = f"{url}/assets/{asset_id}", f"{url}/{FOLDER}/{asset_id}"
    if record.status is Status.OK:
        if before is None:
            remove_objects([f"{place}/{name}" for name in list_objects(place)])
        return record
    files = list_objects(folder) if before is not None else {}
    if not files or digest_of(files) != before:
        return record
    remove_objects([f"{place}/{name}" for name in list_objects(place)])
    copy_objects({f"{folder}/{name}": f"{place}/{name}" for name in files})
    remove_objects([f"{folder}/{name}" for name in files])
    return with_finding(record)
