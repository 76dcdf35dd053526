"""The plan of a run: which assets have to be refined, which are unchanged, and which a killed run had finished."""

import logging
import sqlite3
import uuid
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from asset2sim.assets.urdf.reach import reach_of
from asset2sim.catalog.stored_tables import recorded_assets, recorded_run_ids
from asset2sim.checks.alignment.reference import Reference
from asset2sim.runs.plan.content_hash import content_hash, shared_hash
from asset2sim.runs.plan.records import KeptRecord, drop_record, keep_record, kept_records
from asset2sim.runs.plan.state import folder_files_hash, forget_folders, note_folders, open_state, refined_folders
from asset2sim.runs.plan.url_files import remote_content_hashes, url_reach
from schemas.asset import AssetRecord, AssetRef, Unchanged
from schemas.inputs import InputSettings
from schemas.location import is_url, location_of
from schemas.settings import RunSettings, Settings
from schemas.vocabulary import RETRIED_MODES, FailureMode, Redo, Status

INPUTS = InputSettings()
logger = logging.getLogger(__name__)


def asset_files_hashes(
    state: sqlite3.Connection,
    refs: Sequence[AssetRef],
    inputs: InputSettings = INPUTS,
    limit_s: float = RunSettings().asset_time_limit_s,
) -> dict[str, str]:
    """Asset path → hash of the files that ``inputs`` let it be read from: local ones are read if they changed, of URLs
    only the store's listing. An asset whose files take over ``limit_s``, s, has a hash that no run has again, so that
    it is refined."""
    urls = {ref.path: url_reach(ref, inputs) for ref in refs if is_url(location_of(ref.path))}
    found = remote_content_hashes(state, urls) if urls else {}
    for ref in refs:
        if ref.path in found:
            continue
        try:
            reach = reach_of(ref, inputs)
            found[ref.path] = "" if ref.fault else folder_files_hash(state, Path(ref.path), reach, limit_s)
        except TimeoutError:
            logger.warning("asset %s: its files were not read within %g s; it is refined again", ref.asset_id, limit_s)
            found[ref.path] = uuid.uuid4().hex
    return found


@dataclass(frozen=True)
class Plan:
    """The assets of a run: ``todo`` have to be refined, ``finished`` are records that a killed run left, ``unchanged``
    stay as they are. ``hashes`` maps the id of each to its content hash."""

    todo: tuple[AssetRef, ...]
    finished: tuple[AssetRecord, ...]
    unchanged: tuple[Unchanged, ...]
    hashes: Mapping[str, str]


def make_plan(
    refs: Sequence[AssetRef],
    references: Mapping[str, Reference],
    out: Path,
    settings: Settings,
    pipeline: str,
    run_id: str,
    there: Container[str] | None = None,
) -> Plan:
    """Plan a run that holds ``lock_output(out)``; from here on it may write to the folders of ``todo``.

    An asset is unchanged if its row of this method and model has its content hash, its refined folder is that row's and
    there, and it did not fail in a way that ``settings.run.redo`` or ``RETRIED_MODES`` retries. A failed asset
    needs no folder. ``there`` are the ids of assets whose folder lies behind OUT's URL, with pictures if the
    settings ask for them; None: the folders lie in ``out``.
    """
    shared = shared_hash(settings, pipeline)
    lies = partial(_has_folder, out, settings) if there is None else there.__contains__
    with open_state(out) as state:
        contents = asset_files_hashes(state, refs, settings.inputs, settings.run.asset_time_limit_s)
        hashes = {
            ref.asset_id: content_hash(ref, contents[ref.path], shared, references.get(ref.asset_id)) for ref in refs
        }
        state.commit()
        left = unpublished_records(out, state)
        folders = refined_folders(state)
        rows = recorded_assets(out, settings.method.value, settings.model.model)
        todo: list[AssetRef] = []
        finished: list[AssetRecord] = []
        unchanged: list[Unchanged] = []
        for ref in refs:
            content, row, kept = hashes[ref.asset_id], rows.get(ref.asset_id), left.get(ref.asset_id)
            if kept is not None and is_reusable(kept, ref, content, settings, lies):
                finished.append(kept.record.model_copy(update={"ref": ref}))
            elif (
                row is not None
                and row.content_hash == content
                and not must_redo(row.status, row.failure_mode, settings.run.redo)
                and (row.status is Status.FAILED or (folders.get(ref.asset_id) == content and lies(ref.asset_id)))
            ):
                unchanged.append(Unchanged(asset_id=ref.asset_id, status=row.status, failure_mode=row.failure_mode))
            else:
                todo.append(ref)
        forget_folders(state, (ref.asset_id for ref in todo))
    for ref in todo:
        if (kept := left.get(ref.asset_id)) is not None:
            drop_record(out, kept.record.content_hash)
    for record in finished:
        keep_record(out, KeptRecord(run_id=run_id, redo=settings.run.redo, record=record))
    return Plan(tuple(todo), tuple(finished), tuple(unchanged), hashes)


def mark_published(out: Path, records: Sequence[AssetRecord]) -> None:
    """Note the refined folders of records that the catalog now holds, and delete the record files."""
    with open_state(out) as state:
        note_folders(state, {record.ref.asset_id: record.content_hash for record in records})
    for record in records:
        drop_record(out, record.content_hash)


def unpublished_records(out: Path, state: sqlite3.Connection) -> dict[str, KeptRecord]:
    """Asset id → record that a killed run left; those that it had published are noted and deleted instead."""
    runs = recorded_run_ids(out)
    left: dict[str, KeptRecord] = {}
    for kept in kept_records(out):
        if kept.run_id in runs:
            note_folders(state, {kept.record.ref.asset_id: kept.record.content_hash})
            drop_record(out, kept.record.content_hash)
        else:
            left[kept.record.ref.asset_id] = kept
    return left


def must_redo(status: Status, mode: FailureMode, redo: Redo) -> bool:
    """Whether an unchanged asset that ended like this is to be refined again."""
    if redo is Redo.ALL:
        return True
    return status is Status.FAILED and (redo is Redo.FAILED or mode in RETRIED_MODES)


def is_reusable(kept: KeptRecord, ref: AssetRef, content: str, settings: Settings, lies: Callable[[str], bool]) -> bool:
    """Whether a killed run's record can be used: it has this content hash and a refined folder (``lies``), awaits no
    second attempt, did not fail because the disk was full, which it may be no longer, and was made under the same
    ``redo`` setting or is not to be redone under this one."""
    record = kept.record
    if (kept.died and kept.attempt == 1) or record.failure_mode is FailureMode.DISK_FULL:
        return False
    if record.content_hash != content or (record.overlay is not None and not lies(ref.asset_id)):
        return False
    if kept.redo is settings.run.redo:
        return True
    return not must_redo(record.status, record.failure_mode, settings.run.redo)


def _has_folder(out: Path, settings: Settings, asset_id: str) -> bool:
    folder = out / "assets" / asset_id
    return (folder / "views" if settings.views.in_run else folder).is_dir()
