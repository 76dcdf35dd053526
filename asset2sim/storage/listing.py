"""Cached listings of the objects below a URL. One request lists a thousand objects of a dataset."""

import time
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass

from asset2sim.storage.objects import Stored, list_objects

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
    return next((found for found in _fresh() if url == found.url or covers(found, url)), None)


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


def covers(listing: Listing, url: str) -> bool:
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
