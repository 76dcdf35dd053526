"""Local copies of datasets' files behind URLs, brought up to date."""

from pathlib import Path

from asset2sim.assets.urdf.references import outer_references
from asset2sim.intake.locate import split_url
from asset2sim.intake.url_files import BUCKET, AllowedUrls, choose_urdf_name, outer_objects, visible
from asset2sim.storage.mirror import changed_objects, fetch, remove_others
from asset2sim.storage.objects import (
    Stored,
    StoreError,
    data_root,
    key_of,
    list_objects,
    local_copy_path,
    object_info,
    scheme_of,
    store_usage_error,
)
from schemas.location import Location

LEVELS = 3
"""Parent folders of an asset that are searched for a file of its dataset: category, dataset, and one more."""


def fetch_asset(url: str, reach: AllowedUrls = BUCKET) -> Path:
    """The local copy of an asset's folder or file, with all of its folder and the files elsewhere within ``reach`` that
    its URDF refers to, as they are now; for a URL without objects, or outside, it does not exist. Raises StoreError
    where an object cannot be read."""
    folder, named = split_url(url)
    place = local_copy_path(folder)
    if not reach.allows(folder):
        return place / named
    inner = visible(list_objects(folder))
    _bring({f"{folder}/{name}": stored for name, stored in inner.items()})
    remove_others(place, ["./"], inner)
    urdf = choose_urdf_name(url, inner)
    if urdf is not None:
        references = outer_references((place / urdf).read_text(encoding="utf-8", errors="replace"))
        _bring(outer_objects(folder, inner, urdf, references, object_info, list_objects, reach))
    return place / named


def fetch_above(folder: str, name: str) -> None:
    """Download the nearest file of that name above an asset that was fetched and has none, within its bucket."""
    if local_copy_path(folder).joinpath(name).is_file():
        return
    for _ in range(LEVELS):
        folder = folder.rpartition("/")[0]
        if not key_of(folder) or fetch_file(f"{folder}/{name}").is_file():
            return


def fetch_file(url: str) -> Path:
    """Path of the up-to-date local copy of one object; without an object there is no file at that path."""
    stored = object_info(url)
    if stored is None:
        local_copy_path(url).unlink(missing_ok=True)
    else:
        _bring({url: stored})
    return local_copy_path(url)


def local_file(place: Location) -> Path:
    """A file on this machine: itself, or its copy. Raises UsageError where the store does not answer."""
    if not place.is_url:
        return place.folder
    try:
        return fetch_file(place)
    except StoreError as error:
        raise store_usage_error(error) from error


def _bring(objects: dict[str, Stored]) -> None:
    """Download those of these objects, by URL, of which there is no up-to-date local copy."""
    for scheme in {scheme_of(url) for url in objects}:
        root = data_root() / scheme
        named = {key_of(url): stored for url, stored in objects.items() if scheme_of(url) == scheme}
        # `s3:/` and `/bucket/key` make the URL again.
        fetch(f"{scheme}:/", root, {name: named[name] for name in changed_objects(root, named)})
