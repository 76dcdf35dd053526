"""A dataset's folders and files, here or behind a URL, whose listings are cached: one request lists a thousand."""

import os
import time
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from asset2sim.storage.objects import Stored, StoreError, list_objects, object_info, read_object, store_usage_error
from asset2sim.storage.regular_files import link_problem, read_regular
from schemas.errors import UsageError
from schemas.location import Location

LISTING_MAX_AGE_S = 60.0
"""Age up to which a listing is used again, s: checking a request, finding the assets and hashing them come within
seconds of each other. The next run finds what changed meanwhile."""
KEPT = 4
"""Listings in the cache at most: a few hundred bytes an object."""


@dataclass(frozen=True)
class Listing:
    """The objects below ``url``, and their names, sorted."""

    url: str
    objects: Mapping[str, Stored]
    names: tuple[str, ...]


_kept: dict[str, tuple[float, Listing]] = {}


def listing_of(url: str) -> Listing:
    """Listing of a URL, or of a folder above it, at most ``LISTING_MAX_AGE_S`` old. Raises StoreError."""
    known = cached_listing(url)
    if known is not None:
        return known
    listing = fetch_listing(url)
    while len(_kept) >= KEPT:
        _kept.pop(next(iter(_kept)), None)
    _kept[url] = (time.monotonic(), listing)
    return listing


def fetch_listing(url: str) -> Listing:
    """Listing of a URL from the store, not from the cache."""
    objects = list_objects(url)
    return Listing(url, objects, tuple(objects))


def cached_listing(url: str) -> Listing | None:
    """A cached listing that covers a URL and is at most ``LISTING_MAX_AGE_S`` old; None if there is none."""
    return next((found for found in _fresh() if url == found.url or is_below(found, url)), None)


def objects_below(listing: Listing, url: str) -> dict[str, Stored]:
    """Name relative to ``url`` → object, of a folder that is the listing's or below it."""
    prefix = _prefix(listing, url)
    start = bisect_left(listing.names, prefix)
    found: dict[str, Stored] = {}
    for name in listing.names[start:]:
        if not name.startswith(prefix):
            break
        found[name[len(prefix) :]] = listing.objects[name]
    return found


def is_below(listing: Listing, url: str) -> bool:
    """Whether a URL is below the listing's folder."""
    return url.startswith(f"{listing.url}/")


def _prefix(listing: Listing, url: str) -> str:
    """Prefix of the names of a folder's objects in the listing."""
    inner = url.removeprefix(listing.url).strip("/")
    return f"{inner}/" if inner else ""


def _fresh() -> list[Listing]:
    for url, (asked, _) in list(_kept.items()):
        if time.monotonic() - asked > LISTING_MAX_AGE_S:
            _kept.pop(url, None)
    return [listing for _, listing in _kept.values()]


@dataclass(frozen=True)
class Tree:
    """The folders and files below ``place``. ``folders`` (no hidden ones) and ``files`` (whatever is no folder) list
    the names in a folder, sorted, none where it is not there; "" is ``place`` itself. ``broken`` has the links in a
    folder that lead nowhere, no hidden ones, each with what is wrong, in words that follow its name. ``read`` gives the
    first so many bytes of a regular file. Each raises OSError where a folder or a file cannot be read."""

    place: Location
    folders: Callable[[str], list[str]]
    files: Callable[[str], list[str]]
    broken: Callable[[str], dict[str, str]]
    read: Callable[[str, int], bytes]

    def at(self, name: str) -> Location:
        """Path or URL of a folder or a file."""
        return self.place.below(name) if name else self.place


def local_tree(root: Path) -> Tree:
    """Tree of a local folder."""

    def scan(folder: str) -> dict[str, bool]:
        """Name → whether it is a folder."""
        try:
            with os.scandir(root / folder) as entries:
                return {
                    entry.name: os.path.isdir(entry.path) for entry in sorted(entries, key=lambda entry: entry.name)
                }
        except (FileNotFoundError, NotADirectoryError):
            return {}

    def broken(folder: str) -> dict[str, str]:
        places = {name: root / folder / name for name, is_folder in scan(folder).items() if not is_folder}
        links = {name: place for name, place in places.items() if not name.startswith(".") and place.is_symlink()}
        return {name: said for name, place in links.items() if (said := link_problem(place)) is not None}

    return Tree(
        Location(root),
        lambda folder: [name for name, is_folder in scan(folder).items() if is_folder and not name.startswith(".")],
        lambda folder: [name for name, is_folder in scan(folder).items() if not is_folder],
        broken,
        lambda file, most: read_regular(root / file, most),
    )


def remote_tree(url: str) -> Tree:
    """Tree of the folders and files below a URL. Raises UsageError where it is empty or the store does not answer."""
    try:
        found = objects_below(listing_of(url), url)
        if not found:
            is_object = object_info(url) is not None
            what = "is an object; name the folder that holds it" if is_object else "holds nothing; is it the right one?"
            raise UsageError(f"no dataset at {url}: it {what}")
    except StoreError as error:
        raise store_usage_error(error) from error
    files, folders = defaultdict(set), defaultdict(set)
    for name in found:
        *above, last = name.split("/")
        files["/".join(above)].add(last)
        for depth, folder in enumerate(above):
            folders["/".join(above[:depth])].add(folder)

    def read(name: str, most: int) -> bytes:
        try:
            return read_object(f"{url}/{name}")[:most]
        except StoreError as error:
            raise store_usage_error(error) from error

    return Tree(
        Location(url),
        lambda folder: sorted(name for name in folders.get(folder, ()) if not name.startswith(".")),
        lambda folder: sorted(files.get(folder, ())),
        lambda folder: {},
        read,
    )
