"""An asset behind a URL, brought to this machine: only what changed travels."""

from collections.abc import Iterable
from pathlib import Path

from asset2sim.assets.urdf.locate import outer_references
from asset2sim.baselines.reference import LEVELS
from asset2sim.catalog.storage.cache import data_root
from asset2sim.catalog.storage.mirror import changed, fetch
from asset2sim.catalog.storage.objects import (
    Stored,
    StoreError,
    key_of,
    list_objects,
    object_info,
    scheme_of,
    usage_error,
)
from asset2sim.checks.alignment.reference import FILE as REFERENCE
from asset2sim.remote.sources import outer_objects, urdf_among, visible
from schemas.location import is_url
from schemas.vocabulary import Method


def local_place(url: str) -> Path:
    """Where this machine keeps its copy of what lies at a URL: relative paths between objects stay what they are."""
    return data_root() / scheme_of(url) / key_of(url)


def fetch_asset(folder: str, method: Method) -> Path:
    """The local copy of an asset's folder, with the files elsewhere that its URDF refers to, as they are now.

    Raises StoreError where an object cannot be read. A folder without objects is one that is not there.
    """
    inner = visible(list_objects(folder))
    bring({f"{folder}/{name}": stored for name, stored in inner.items()})
    place = local_place(folder)
    _remove_others(place, inner)
    urdf = urdf_among(inner)
    if urdf is not None:
        references = outer_references((place / urdf).read_text(encoding="utf-8", errors="replace"))
        bring(outer_objects(folder, inner, urdf, references, object_info, list_objects))
    if method is Method.REFERENCE and REFERENCE not in inner:
        _bring_reference(folder)
    return place


def fetch_file(url: str) -> Path:
    """The local copy of one object as it is now; where there is none, there is no file at that path."""
    stored = object_info(url)
    if stored is None:
        local_place(url).unlink(missing_ok=True)
    else:
        bring({url: stored})
    return local_place(url)


def local_file(place: Path | str) -> Path:
    """A file on this machine: itself, or its copy. Raises UsageError where the store does not answer."""
    if not is_url(place):
        return place
    try:
        return fetch_file(place)
    except StoreError as error:
        raise usage_error(error) from error


def bring(objects: dict[str, Stored]) -> None:
    """Bring the objects, by URL, that this machine has no copy of."""
    for scheme in {scheme_of(url) for url in objects}:
        root = data_root() / scheme
        named = {key_of(url): stored for url, stored in objects.items() if scheme_of(url) == scheme}
        # `s3:/` and `/bucket/key` make the URL again.
        fetch(f"{scheme}:/", root, {name: named[name] for name in changed(root, named)})


def _bring_reference(folder: str) -> None:
    """The nearest file with the experts' choices above the asset, within its bucket."""
    for _ in range(LEVELS):
        folder = folder.rpartition("/")[0]
        if not key_of(folder) or fetch_file(f"{folder}/{REFERENCE}").is_file():
            return


def _remove_others(place: Path, names: Iterable[str]) -> None:
    """Remove what the local copy of an asset's folder has beyond these names."""
    there = set(names)
    for path in sorted(place.rglob("*"), reverse=True) if place.is_dir() else ():
        if path.is_dir() and not path.is_symlink():
            if not any(path.iterdir()):
                path.rmdir()
        elif path.relative_to(place).as_posix() not in there:
            path.unlink(missing_ok=True)
    if place.is_dir() and not there:
        place.rmdir()
