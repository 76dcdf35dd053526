"""Refined folders that are not as a run wrote them (edited by hand, truncated) or are set aside after a failed run."""

import hashlib
import os
import shutil
import sqlite3
import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path

from asset2sim.assets.checksums import FILE, changed_files
from asset2sim.runs.plan.asset_files import AssetFile, files_below
from asset2sim.runs.plan.state import SETTLED_NS
from asset2sim.storage.objects import copy_objects, digest_of, list_objects, remove_objects
from schemas.asset import AssetRecord
from schemas.errors import first_words
from schemas.finding import remark
from schemas.vocabulary import Redo, Stage, Status

MOST_NAMED = 10
"""Assets, and files of each, that a message names."""

Changes = Mapping[str, tuple[str, ...]]
"""Asset id → what became of its files."""


def hand_changes(
    state: sqlite3.Connection, out: Path, asset_ids: Iterable[str], there: Mapping[str, str] | None
) -> dict[str, tuple[str, ...]]:
    """The changes in these assets' folders since they were written. Files are read only where a size or a time is
    another than when they were last looked at. Of folders in a store (``there``: asset id → digest of names, sizes and
    versions) it is not known which file it was."""
    known, found, looks = _known(state), dict[str, tuple[str, ...]](), dict[str, str]()
    if there is not None:
        stored = {name: there[name] for name in asset_ids if name in there}
        return {name: ("files in the store changed",) for name, look in stored.items() if known.get(name, look) != look}
    for asset_id in asset_ids:
        folder = out / "assets" / asset_id
        files = list(files_below(folder))
        look = _look(files)
        if not files or look == known.get(asset_id):
            continue
        changed = changed_files(folder)
        if changed is None and asset_id in known:
            changed = (f"{FILE} removed",)
        if changed:
            found[asset_id] = changed
        elif changed is not None and _settled(files):
            looks[asset_id] = look
    _note(state, looks)
    return found


def note_written(
    state: sqlite3.Connection, out: Path, asset_ids: Iterable[str], there: Mapping[str, str] | None
) -> None:
    """Remember how the folders look that a run has just written, in ``out`` or in a store (``there``). Where a file is
    younger than the folder's checksums, or so young that it may change unseen, the next look reads it."""
    if there is not None:
        _note(state, {asset_id: there[asset_id] for asset_id in asset_ids if asset_id in there})
        return
    looks = {}
    for asset_id in asset_ids:
        files = list(files_below(out / "assets" / asset_id))
        written = next((file.mtime_ns for file in files if file.name == FILE), None)
        if written is not None and _settled(files) and all(file.mtime_ns <= written for file in files):
            looks[asset_id] = _look(files)
    _note(state, looks)


def changes_text(changes: Changes, redo: Redo) -> str | None:
    """A sentence on what was changed by hand and what becomes of it; None where nothing was."""
    if not changes:
        return None
    named = [f"{asset_id} ({first_words(files, MOST_NAMED)})" for asset_id, files in changes.items()]
    then = "refined anew with --force" if redo is Redo.ALL else "kept; --force refines them anew"
    return f"changed by hand since they were refined: {first_words(named, MOST_NAMED)}: {then}"


def _known(state: sqlite3.Connection) -> dict[str, str]:
    return dict(state.execute("SELECT asset_id, look FROM outputs"))


def _note(state: sqlite3.Connection, looks: Mapping[str, str]) -> None:
    state.executemany("INSERT OR REPLACE INTO outputs VALUES (?, ?)", looks.items())


def _look(files: Iterable[AssetFile]) -> str:
    """Digest of names, sizes and times."""
    text = "\n".join(sorted(f"{file.name}\0{file.size}\0{file.mtime_ns}\0{file.ctime_ns}" for file in files))
    return hashlib.sha256(text.encode(errors="surrogateescape")).hexdigest()


def _settled(files: Iterable[AssetFile]) -> bool:
    latest = max((max(file.mtime_ns, file.ctime_ns) for file in files), default=0)
    return latest < time.time_ns() - SETTLED_NS


SET_ASIDE = "set_aside"
"""Folder of OUT with the last refinement of each asset that has failed since, and code of the finding that says so."""

Stamp = tuple[int, int]
"""Stamp by which two folders of one name differ: its inode, and when its list of files last changed, ns."""


def stamp_of_folder(folder: Path) -> Stamp | None:
    """The stamp of a folder; None where there is none."""
    try:
        found = os.stat(folder)
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns


def set_aside(out: Path, record: AssetRecord, before: Stamp | str | None) -> AssetRecord:
    """Move the refined folder of a failed asset that is as ``before`` the run out of ``assets``; remove what was set
    aside of one that passes. Returns the record, with a finding where the folder was moved, earlier too."""
    asset_id = record.ref.asset_id
    folder, place = out / "assets" / asset_id, out / SET_ASIDE / asset_id
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
    message = f"asset {asset_id}: this run failed, and what an earlier one refined is in {SET_ASIDE}/{asset_id} now"
    finding = remark(Stage.PUBLISH, SET_ASIDE, message)
    return record.model_copy(update={"findings": (*record.findings, finding)})


def set_aside_stored(url: str, record: AssetRecord, before: Stamp | str | None) -> AssetRecord:
    """``set_aside`` behind a URL: move the refined folder of a failed asset that is as it was ``before`` the run (its
    digest) out of ``assets``, and remove what was set aside of an asset that passes and had none. Returns the record,
    with a finding where the folder was moved. Raises StoreError."""
    asset_id = record.ref.asset_id
    folder, place = f"{url}/assets/{asset_id}", f"{url}/{SET_ASIDE}/{asset_id}"
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
