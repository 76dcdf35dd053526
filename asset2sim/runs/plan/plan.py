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
from types import MappingProxyType

from asset2sim.assets.urdf.reach import reach_of
from asset2sim.catalog.stored_tables import RecordedResult, recorded_assets, recorded_run_ids
from asset2sim.checks.alignment.expectations import Expectations
from asset2sim.checks.alignment.reference import Reference
from asset2sim.models.gateway.recorded import answer_digests
from asset2sim.runs.plan.content_hash import content_hash, shared_hash
from asset2sim.runs.plan.hand_changes import Changes, hand_changes, note_stored, note_written
from asset2sim.runs.plan.records import KeptRecord, drop_record, kept_records, read_record
from asset2sim.runs.plan.set_aside import Stamp, stamp
from asset2sim.runs.plan.state import (
    folder_files_hash,
    forget_folders,
    note_folders,
    open_state,
    read_state,
    refined_folders,
)
from asset2sim.runs.plan.timeouts import is_left, timed_out, timeouts_in_a_row
from asset2sim.runs.plan.url_files import remote_content_hashes, url_reach
from schemas.asset import AssetRecord, AssetRef, Unchanged
from schemas.inputs import InputSettings
from schemas.location import Location
from schemas.settings import RunSettings, Settings
from schemas.summary import AssetSummary
from schemas.vocabulary import RETRIED_MODES, FailureMode, Redo, Status

logger = logging.getLogger(__name__)
RUN, INPUTS = RunSettings(), InputSettings()


def asset_files_hashes(
    state: sqlite3.Connection, refs: Sequence[AssetRef], inputs: InputSettings = INPUTS,
    limit_s: float = RUN.asset_time_limit_s,
) -> dict[str, str]:  # fmt: skip
    """Asset path → hash of the files that ``inputs`` let it be read from: local ones are read if they changed, of URLs
    only the store's listing. An asset whose files take over ``limit_s``, s, has a hash that no run has again and
    is refined."""
    urls = {ref.path: url_reach(ref, inputs) for ref in refs if Location(ref.path).is_url}
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


def make_plan(
    refs: Sequence[AssetRef],
    references: Mapping[str, Reference],
    out: Path,
    settings: Settings,
    pipeline: str,
    there: Mapping[str, str] | None = None,
    expectations: Expectations = MappingProxyType({}),
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
    shared = shared_hash(settings, pipeline)
    lies = partial(_has_folder, out, settings) if there is None else there.__contains__
    with read_state(out) if dry else open_state(out) as state:
        contents = asset_files_hashes(state, refs, settings.inputs, settings.run.asset_time_limit_s)
        answers = answer_digests(settings.model, (ref.asset_id for ref in refs))
        hashes = {
            ref.asset_id: content_hash(
                ref,
                contents[ref.path],
                shared,
                references.get(ref.asset_id),
                answers.get(ref.asset_id, ""),
                expectations.get(ref.asset_id, ()),
            )
            for ref in refs
        }
        state.commit()
        known = {ref.asset_id: ref for ref in refs}
        left, reusable = defaultdict[str, list[str]](list), set[str]()
        for kept in unpublished_records(out, state, clean=not dry):
            asset_id = kept.record.ref.asset_id
            if (ref := known.get(asset_id)) and is_reusable(kept, ref, hashes[asset_id], settings, lies):
                reusable.add(asset_id)
            else:
                left[asset_id].append(kept.record.content_hash)
        folders = refined_folders(state)
        by_hand = hand_changes(state, out, hashes, there)
        keeps = settings.run.redo is not Redo.ALL
        rows = recorded_assets(out, settings.method.value, settings.model.model)
        late = timeouts_in_a_row(
            out, settings, {name for name, row in rows.items() if timed_out(row, hashes.get(name))}
        )
        why: dict[str, Why] = {}
        todo: list[AssetRef] = []
        finished: list[AssetRef] = []
        unchanged: list[Unchanged] = []
        for ref in refs:
            content, row = hashes[ref.asset_id], rows.get(ref.asset_id)
            if ref.asset_id in reusable:
                finished.append(ref)
                why[ref.asset_id] = Why.LEFT
                continue
            has_folder = folders.get(ref.asset_id) == content and lies(ref.asset_id)
            reason = why_refined(row, content, settings.run.redo, has_folder, is_left(late.get(ref.asset_id), settings))
            if reason is not None and not (keeps and ref.asset_id in by_hand):
                todo.append(ref)
                why[ref.asset_id] = reason
            elif row is not None:
                unchanged.append(Unchanged(asset_id=ref.asset_id, status=row.status, failure_mode=row.failure_mode))
        owned = {
            ref.asset_id: found
            for ref in todo
            if (row := rows.get(ref.asset_id)) and (row.alone or folders.get(ref.asset_id) == row.content_hash)
            if (found := _seen(out, ref.asset_id, there)) is not None
        }
        forget_folders(state, (ref.asset_id for ref in todo))
    counts = {name: times.count for name, times in late.items()}
    records = LeftRecords(out, tuple(finished), hashes)
    plan = Plan(tuple(todo), records, tuple(unchanged), hashes, by_hand, why, counts, owned)
    if dry:
        return plan
    for ref in todo:
        for stale in left[ref.asset_id]:
            drop_record(out, stale)
    return plan


def _seen(out: Path, asset_id: str, there: Mapping[str, str] | None) -> Stamp | str | None:
    """What tells a refined folder from a new one: its stamp, or its digest ``there``; None where there is none."""
    return stamp(out / "assets" / asset_id) if there is None else there.get(asset_id)


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
        if there is None:
            note_written(state, out, hashes)
        else:
            note_stored(state, there, hashes)
    for content in hashes.values():
        drop_record(out, content)


def unpublished_records(out: Path, state: sqlite3.Connection, *, clean: bool = True) -> Iterator[KeptRecord]:
    """The records that a killed run left, one at a time; those that it had published are noted, and deleted where
    ``clean``, instead."""
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
    return (folder / "views" if settings.views.in_run else folder).is_dir()
