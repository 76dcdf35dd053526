"""The plan of a run: which assets have to be refined, which are unchanged, and which a killed run had finished."""

import logging
import sqlite3
import uuid
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import partial
from pathlib import Path

from asset2sim.assets.urdf.references import allowed_folders
from asset2sim.catalog.stored_tables import RecordedResult, recorded_assets, recorded_run_ids
from asset2sim.intake.url_files import allowed_urls, remote_content_hashes
from asset2sim.models.gateway.recorded import answer_digests
from asset2sim.runs.plan.content_hash import content_hash, shared_hash
from asset2sim.runs.plan.hand_changes import Changes, Stamp, hand_changes, note_written, stamp_of_folder
from asset2sim.runs.plan.records import KeptRecord, LeftRecords, drop_record, kept_records
from asset2sim.runs.plan.state import (
    folder_files_hash,
    forget_folders,
    note_folders,
    open_state,
    read_state,
    refined_folders,
)
from asset2sim.runs.plan.timeouts import Timeouts, is_left, timed_out, timeouts_in_a_row
from schemas.asset import AssetRecord, AssetRef, AssetSummary, Unchanged
from schemas.inputs import InputSettings
from schemas.location import Location
from schemas.settings import RunSettings, Settings
from schemas.vocabulary import RETRIED_MODES, FailureMode, Redo, Status

logger = logging.getLogger(__name__)
RUN, INPUTS = RunSettings(), InputSettings()


def asset_files_hashes(
    state: sqlite3.Connection, refs: Sequence[AssetRef], inputs: InputSettings = INPUTS,
    limit_s: float = RUN.asset_time_limit_s,
) -> dict[str, str]:  # fmt: skip
    """Asset path → hash of the files that ``inputs`` let it read: of local ones what changed is read, of URLs the
    listing. One that takes over ``limit_s``, s, has a hash that no run has again: it is refined."""
    urls = {ref.path: allowed_urls(ref, inputs) for ref in refs if Location(ref.path).is_url}
    found = remote_content_hashes(state, urls) if urls else {}
    for ref in refs:
        if ref.path in found:
            continue
        try:
            reach = allowed_folders(ref, inputs)
            found[ref.path] = "" if ref.fault else folder_files_hash(state, Path(ref.path), reach, limit_s)
        except TimeoutError:
            logger.warning("asset %s: its files were not read within %g s; it is refined again", ref.asset_id, limit_s)
            found[ref.path] = uuid.uuid4().hex
    return found


class Why(StrEnum):
    """Why an asset is refined."""

    NEW = "new"
    CHANGED = "changed"
    ALL = "--force"
    FAILED = "failed, and --retry-failed"
    AGAIN = "failed in a way that may pass"
    FOLDER = "its refined folder is not there, or another method or run wrote it"
    LEFT = "an interrupted run refined it: it is only published"


@dataclass(frozen=True)
class Plan:
    """The assets of a run: ``todo`` have to be refined, ``finished`` are records that a killed run left, ``unchanged``
    stay as they are. ``hashes`` maps the id of each to its content hash, ``why`` the ids of ``todo`` and ``finished``
    to the reason. ``by_hand`` says what in refined folders is not as it was written: of these an asset is in ``todo``
    only if ``redo`` is ``all``, and in none of the three if it has no row of this method and model. ``timeouts``: asset
    id → runs in a row, the last ones, in which this content took too long. ``owned``: ids of ``todo`` whose refined
    folder is of the row that the run replaces → what tells it from a new one.
    """

    todo: tuple[AssetRef, ...]
    finished: LeftRecords
    unchanged: tuple[Unchanged, ...]
    hashes: Mapping[str, str]
    by_hand: Changes = field(default_factory=dict)
    why: Mapping[str, Why] = field(default_factory=dict)
    timeouts: Mapping[str, int] = field(default_factory=dict)
    owned: Mapping[str, Stamp | str] = field(default_factory=dict)


@dataclass(frozen=True)
class Past:
    """Knowledge of earlier runs. ``hashes``: asset id → its content hash today; ``reusable``: ids of assets whose
    record a killed run left and which holds; ``stale``: asset id → the content hashes of records that do not;
    ``folders``: asset id → the refinement that lies in its folder; ``lies``: whether an asset has such a folder;
    ``by_hand``: what was changed in it; ``rows``: what the catalog says; ``late``: who took too long, and how often."""

    hashes: Mapping[str, str]
    reusable: Collection[str]
    stale: Mapping[str, Sequence[str]]
    folders: Mapping[str, str]
    lies: Callable[[str], bool]
    by_hand: Changes
    rows: Mapping[str, RecordedResult]
    late: Mapping[str, Timeouts]

    def owns_folder(self, asset_id: str) -> bool:
        """Whether the asset's refined folder is that of its row."""
        row = self.rows.get(asset_id)
        return row is not None and (row.alone or self.folders.get(asset_id) == row.content_hash)


def make_plan(
    refs: Sequence[AssetRef],
    out: Path,
    settings: Settings,
    pipeline: str,
    there: Mapping[str, str] | None = None,
    *,
    dry: bool = False,
) -> Plan:
    """Plan a run that holds ``lock_output(out)``; from here on it may write to the folders of ``todo``. A ``dry`` plan
    needs no lock and writes nothing.

    An asset is unchanged if its row of this method and model has its content hash, its refined folder is that row's and
    there, and it did not fail in a way that ``settings.run.redo`` or ``RETRIED_MODES`` retries. A failed asset
    needs no folder. One that took too long in ``max_timeouts`` runs in a row is not retried. What was changed by hand
    is kept, whatever else changed, unless ``redo`` is ``all``. ``there`` are the ids of assets whose folder lies behind
    OUT's URL, with pictures if the settings ask for them, and how each looks; None: the folders lie in ``out``.
    """
    with read_state(out) if dry else open_state(out) as state:
        hashes = content_hashes(state, refs, settings, pipeline)
        state.commit()
        past = read_past(state, refs, hashes, out, settings, there, clean=not dry)
        plan = plan_of(refs, past, out, settings, there)
        forget_folders(state, (ref.asset_id for ref in plan.todo))
    for ref in () if dry else plan.todo:
        for stale in past.stale.get(ref.asset_id, ()):
            drop_record(out, stale)
    return plan


def content_hashes(
    state: sqlite3.Connection, refs: Sequence[AssetRef], settings: Settings, pipeline: str
) -> dict[str, str]:
    """Asset id → hash of all that its result depends on."""
    shared = shared_hash(settings, pipeline)
    contents = asset_files_hashes(state, refs, settings.inputs, settings.run.asset_time_limit_s)
    answers = answer_digests(settings.model, (ref.asset_id for ref in refs))
    return {ref.asset_id: content_hash(ref, contents[ref.path], shared, answers.get(ref.asset_id, "")) for ref in refs}


def read_past(
    state: sqlite3.Connection,
    refs: Sequence[AssetRef],
    hashes: Mapping[str, str],
    out: Path,
    settings: Settings,
    there: Mapping[str, str] | None,
    *,
    clean: bool,
) -> Past:
    """Results of earlier runs for these assets; ``clean``: records that were published are deleted."""
    lies = partial(_has_folder, out, settings) if there is None else there.__contains__
    known = {ref.asset_id: ref for ref in refs}
    reusable, stale = set[str](), defaultdict[str, list[str]](list)
    for kept in unpublished_records(out, state, clean=clean):
        asset_id = kept.record.ref.asset_id
        if asset_id in known and is_reusable(kept, known[asset_id], hashes[asset_id], settings, lies):
            reusable.add(asset_id)
        else:
            stale[asset_id].append(kept.record.content_hash)
    folders, by_hand = refined_folders(state), hand_changes(state, out, hashes, there)
    rows = recorded_assets(out, settings.method.value, settings.model.model)
    slow = {name for name, row in rows.items() if timed_out(row, hashes.get(name))}
    late = timeouts_in_a_row(out, settings, slow)
    return Past(hashes, reusable, stale, folders, lies, by_hand, rows, late)


def plan_of(
    refs: Sequence[AssetRef], past: Past, out: Path, settings: Settings, there: Mapping[str, str] | None
) -> Plan:
    """The plan that follows from what is known of earlier runs."""
    why = {ref.asset_id: reason for ref in refs if (reason := why_done(ref.asset_id, past, settings)) is not None}
    todo = tuple(ref for ref in refs if why.get(ref.asset_id, Why.LEFT) is not Why.LEFT)
    finished = tuple(ref for ref in refs if why.get(ref.asset_id) is Why.LEFT)
    owned = ((ref.asset_id, _look(out, ref.asset_id, there)) for ref in todo if past.owns_folder(ref.asset_id))
    return Plan(
        todo=todo,
        finished=LeftRecords(out, finished, past.hashes),
        unchanged=tuple(
            Unchanged(asset_id=ref.asset_id, status=row.status, failure_mode=row.failure_mode)
            for ref in refs
            if ref.asset_id not in why and (row := past.rows.get(ref.asset_id)) is not None
        ),
        hashes=past.hashes,
        by_hand=past.by_hand,
        why=why,
        timeouts={name: times.count for name, times in past.late.items()},
        owned={asset_id: look for asset_id, look in owned if look is not None},
    )


def why_done(asset_id: str, past: Past, settings: Settings) -> Why | None:
    """Why a run has anything to do with an asset; None where it stays as it is, unchanged or changed by hand."""
    if asset_id in past.reusable:
        return Why.LEFT
    content, redo = past.hashes[asset_id], settings.run.redo
    has_folder = past.folders.get(asset_id) == content and past.lies(asset_id)
    left_alone = is_left(past.late.get(asset_id), settings)
    reason = why_refined(past.rows.get(asset_id), content, redo, has_folder, left_alone)
    return None if asset_id in past.by_hand and redo is not Redo.ALL else reason


def _look(out: Path, asset_id: str, there: Mapping[str, str] | None) -> Stamp | str | None:
    """Mark that tells a refined folder from a new one: its stamp, or its digest ``there``; None where there is none."""
    return stamp_of_folder(out / "assets" / asset_id) if there is None else there.get(asset_id)


def why_refined(
    row: RecordedResult | None, content: str, redo: Redo, has_folder: bool, is_left_alone: bool
) -> Why | None:
    """Why an asset with this row is refined; None where it is unchanged."""
    if row is None:
        return Why.NEW
    if row.content_hash != content:
        return Why.CHANGED
    if redo is Redo.ALL:
        return Why.ALL
    if row.status is Status.FAILED:
        if redo is Redo.FAILED:
            return Why.FAILED
        return Why.AGAIN if must_redo(row.status, row.failure_mode, redo) and not is_left_alone else None
    return None if has_folder else Why.FOLDER


def mark_published(
    out: Path, records: Iterable[AssetRecord | AssetSummary], there: Mapping[str, str] | None = None
) -> None:
    """Note the refined folders of records that the catalog now holds, and delete the record files. ``there`` says how
    folders behind OUT's URL look; None: they lie in ``out``."""
    hashes = {record.ref.asset_id: record.content_hash for record in records}
    with open_state(out) as state:
        note_folders(state, hashes)
        note_written(state, out, hashes, there)
    for content in hashes.values():
        drop_record(out, content)


def unpublished_records(out: Path, state: sqlite3.Connection, *, clean: bool = True) -> Iterator[KeptRecord]:
    """Records that a killed run left, one at a time; published ones are noted, and deleted where ``clean``."""
    runs = recorded_run_ids(out)
    for kept in kept_records(out, clean=clean):
        if kept.run_id in runs:
            note_folders(state, {kept.record.ref.asset_id: kept.record.content_hash})
            if clean:
                drop_record(out, kept.record.content_hash)
        else:
            yield kept


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
    return (folder / "views" if settings.views.write else folder).is_dir()
