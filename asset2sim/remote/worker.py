"""What a worker does beside refining where data or output lie behind URLs: fetch the asset, send what came of it."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from asset2sim.catalog.storage.cache import data_root, working_folder
from asset2sim.catalog.storage.disk import is_disk_full
from asset2sim.catalog.storage.mirror import remove_tree, send_folder
from asset2sim.catalog.storage.objects import StoreError, remove_objects, scheme_of, send_objects
from asset2sim.isolation.asset import Attempt, failed_record, first_log_file, log_file
from asset2sim.models.gateway.refused_answers import answers_file
from asset2sim.remote.data import fetch_asset
from schemas.asset import AssetRecord, AssetRef
from schemas.location import is_url, location_of
from schemas.settings import Settings
from schemas.vocabulary import FailureMode


def with_files(ref: AssetRef, out: Path | str, settings: Settings, work: Callable[[AssetRef], Attempt]) -> Attempt:
    """The attempt of ``work`` at an asset whose files are on this machine; its folder and logs are sent to OUT's URL.

    What the asset's own objects lack is its failure (``unreadable_asset``); a store that does not answer is the day's
    (``engine_crash``), so that the next run tries it again.
    """
    place = location_of(ref.path)
    if not is_url(place) and not is_url(out):
        return work(ref)
    try:
        local = ref.model_copy(update={"path": str(fetch_asset(place, settings.method))}) if is_url(place) else ref
    except StoreError as error:
        return Attempt(failed_record(ref, settings, _mode_of(error), str(error)))
    attempt = work(local)
    record = in_urls(attempt.record, ref, out)
    if is_url(out):
        try:
            send_asset(out, ref.asset_id)
        except StoreError as error:
            reason = f"its refined folder cannot be sent: {error}"
            mode = FailureMode.ENGINE_CRASH
            failed = failed_record(ref, settings, mode, reason, seconds=record.seconds, calls=record.calls)
            return replace(attempt, record=failed)
    return replace(attempt, record=record)


def send_asset(out: str, asset_id: str) -> None:
    """Make an asset's folder and logs below OUT's URL what they are here, and remove the folder here: nobody reads it
    any more, and a dataset's would fill the disk."""
    folder = working_folder(out)
    assets = folder / "assets" / asset_id
    if assets.is_dir():
        send_folder(f"{out}/assets/{asset_id}", assets)
        remove_tree(assets)
    logs = {f"{out}/{log.relative_to(folder).as_posix()}": log for log in _logs(folder, asset_id)}
    send_objects({url: log for url, log in logs.items() if log.is_file()})
    remove_objects([url for url, log in logs.items() if not log.is_file()])


def in_urls(record: AssetRecord, ref: AssetRef, out: Path | str) -> AssetRecord:
    """The record with the asset where its user has it, and no folder of this machine's copies in what it says."""
    places = {}
    if is_url(out):
        places[str(working_folder(out))] = out
    if is_url(place := location_of(ref.path)):
        places[f"{data_root() / scheme_of(place)}/"] = f"{scheme_of(place)}://"

    def told(text: str) -> str:
        for local, url in places.items():
            text = text.replace(local, url)
        return text

    findings = tuple(item.model_copy(update={"message": told(item.message)}) for item in record.findings)
    return record.model_copy(update={"ref": ref, "reason": told(record.reason), "findings": findings})


def _mode_of(error: StoreError) -> FailureMode:
    if is_disk_full(error):
        return FailureMode.DISK_FULL
    return FailureMode.UNREADABLE_ASSET if error.missing or error.refused else FailureMode.ENGINE_CRASH


def _logs(folder: Path, asset_id: str) -> tuple[Path, ...]:
    return log_file(folder, asset_id), first_log_file(folder, asset_id), answers_file(folder, asset_id)
