"""Transfers of a worker where data or output is behind a URL: download the asset, upload its result."""

from collections.abc import Callable
from dataclasses import replace

from asset2sim.baselines.declared_method import known_methods
from asset2sim.intake.locate import split_url
from asset2sim.intake.url_files import allowed_urls, fetch_above, fetch_asset
from asset2sim.models.gateway.questions import answers_file
from asset2sim.runs.asset_attempt import AssetAttempt, failed_record, first_log_file, log_file
from asset2sim.storage.mirror import remove_tree, send_folder
from asset2sim.storage.objects import (
    StoreError,
    data_root,
    local_copy_path,
    remove_objects,
    scheme_of,
    send_objects,
    working_folder,
)
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import is_disk_full
from schemas.location import Location
from schemas.settings import Settings
from schemas.vocabulary import FailureMode


def run_with_local_files(
    ref: AssetRef, out: Location, settings: Settings, work: Callable[[AssetRef], AssetAttempt]
) -> AssetAttempt:
    """Run ``work`` on a local copy of an asset, and upload its folder and logs to OUT's URL; one of both is a URL.

    An object that is missing or refused fails the asset as ``unreadable_asset``; a store that does not answer fails it
    as ``engine_crash``, so that the next run tries it again.
    """
    place = Location(ref.path)
    try:
        local = fetched(ref, settings) if place.is_url else ref
    except StoreError as error:
        return AssetAttempt(failed_record(ref, settings, _mode_of(error), str(error)))
    attempt = work(local)
    record = without_local_paths(attempt.record, ref, out)
    if out.is_url:
        try:
            send_asset(out, ref.asset_id)
        except StoreError as error:
            reason = f"its refined folder cannot be sent: {error}"
            mode = FailureMode.ENGINE_CRASH
            failed = failed_record(ref, settings, mode, reason, seconds=record.seconds, calls=record.calls)
            return replace(attempt, record=failed)
    return replace(attempt, record=record)


def fetched(ref: AssetRef, settings: Settings) -> AssetRef:
    """The reference of the local copy of an asset behind a URL, its dataset's folder being the copy of the dataset's.
    Raises StoreError where an object cannot be read."""
    root = Location(ref.root or split_url(ref.path)[0])
    path = fetch_asset(ref.path, allowed_urls(ref, settings.inputs))
    if above := known_methods()[settings.method].reads_above:
        fetch_above(split_url(ref.path)[0], above)
    return ref.model_copy(update={"path": str(path), "root": str(local_copy_path(root) if root.is_url else root)})


def with_local_packages(settings: Settings) -> Settings:
    """The settings with the local copies of those packages' folders that are behind URLs."""
    found = ((name, Location(place)) for name, place in settings.inputs.package_folders.items())
    packages = tuple(f"{name}={local_copy_path(place) if place.is_url else place}" for name, place in found)
    return settings.model_copy(update={"inputs": settings.inputs.model_copy(update={"packages": packages})})


def send_asset(out: str, asset_id: str) -> None:
    """Upload an asset's folder and logs to OUT's URL, and remove the local folder: it is not read again, and those of a
    whole dataset would fill the disk."""
    folder = working_folder(out)
    assets = folder / "assets" / asset_id
    if assets.is_dir():
        send_folder(f"{out}/assets/{asset_id}", assets)
        remove_tree(assets)
    paths = (log_file(folder, asset_id), first_log_file(folder, asset_id), answers_file(folder, asset_id))
    logs = {f"{out}/{log.relative_to(folder).as_posix()}": log for log in paths}
    send_objects({url: log for url, log in logs.items() if log.is_file()})
    remove_objects([url for url, log in logs.items() if not log.is_file()])


def without_local_paths(record: AssetRecord, ref: AssetRef, out: Location) -> AssetRecord:
    """The record with the user's URLs in place of local paths, in its asset reference, reason and findings."""
    places: dict[str, str] = {}
    if out.is_url:
        places[str(working_folder(out))] = out
    if (place := Location(ref.path)).is_url:
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
