"""Transfers of a worker where data or output is behind a URL: download the asset, upload its result."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from asset2sim.assets.urdf.references import outer_references
from asset2sim.baselines.reference import LEVELS
from asset2sim.checks.alignment.reference import FILE as REFERENCE
from asset2sim.models.gateway.refused_answers import answers_file
from asset2sim.runs.asset_attempt import AssetAttempt, failed_record, first_log_file, log_file
from asset2sim.runs.plan.url_files import BUCKET, AllowedUrls, allowed_urls, choose_urdf_name, outer_objects, visible
from asset2sim.storage.cache import data_root, working_folder
from asset2sim.storage.mirror import changed, fetch, remove_others, remove_tree, send_folder
from asset2sim.storage.objects import (
    Stored,
    StoreError,
    key_of,
    list_objects,
    object_info,
    remove_objects,
    scheme_of,
    send_objects,
    store_usage_error,
)
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import is_disk_full
from schemas.location import Location
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Method


def local_copy_path(url: str) -> Path:
    """Path of the local copy of a URL; relative paths between objects stay the same."""
    return data_root() / scheme_of(url) / key_of(url)


def fetch_asset(folder: str, method: Method, reach: AllowedUrls = BUCKET) -> Path:
    """The local copy of an asset's folder, with the files elsewhere within ``reach`` that its URDF refers to, as they
    are now; for a URL without objects, or outside, it does not exist. Raises StoreError where an object cannot be
    read."""
    if not reach.allows(folder):
        return local_copy_path(folder)
    inner = visible(list_objects(folder))
    bring({f"{folder}/{name}": stored for name, stored in inner.items()})
    place = local_copy_path(folder)
    remove_others(place, ["./"], inner)
    urdf = choose_urdf_name(inner)
    if urdf is not None:
        references = outer_references((place / urdf).read_text(encoding="utf-8", errors="replace"))
        bring(outer_objects(folder, inner, urdf, references, object_info, list_objects, reach))
    if method is Method.REFERENCE and REFERENCE not in inner:
        _bring_reference(folder)
    return place


def fetch_file(url: str) -> Path:
    """Path of the up-to-date local copy of one object; without an object there is no file at that path."""
    stored = object_info(url)
    if stored is None:
        local_copy_path(url).unlink(missing_ok=True)
    else:
        bring({url: stored})
    return local_copy_path(url)


def local_file(place: Location) -> Path:
    """A file on this machine: itself, or its copy. Raises UsageError where the store does not answer."""
    if not place.is_url:
        return place.folder
    try:
        return fetch_file(place)
    except StoreError as error:
        raise store_usage_error(error) from error


def bring(objects: dict[str, Stored]) -> None:
    """Download those of these objects, by URL, of which there is no up-to-date local copy."""
    for scheme in {scheme_of(url) for url in objects}:
        root = data_root() / scheme
        named = {key_of(url): stored for url, stored in objects.items() if scheme_of(url) == scheme}
        # `s3:/` and `/bucket/key` make the URL again.
        fetch(f"{scheme}:/", root, {name: named[name] for name in changed(root, named)})


def _bring_reference(folder: str) -> None:
    """Download the nearest reference file (the experts' choices) above the asset, within its bucket."""
    for _ in range(LEVELS):
        folder = folder.rpartition("/")[0]
        if not key_of(folder) or fetch_file(f"{folder}/{REFERENCE}").is_file():
            return


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
    root = Location(ref.root or ref.path)
    path = fetch_asset(ref.path, settings.method, allowed_urls(ref, settings.inputs))
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
