"""Everything that lies below a URL, asked for once: of a dataset, which one request lists a thousand objects of."""

import time
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass

from asset2sim.catalog.storage.objects import Stored, list_objects

FRESH_S = 60.0
"""Age up to which a dataset's listing is taken once more, s: checking a request, finding the assets and hashing them
come within seconds. What changes meanwhile is found by the next run."""
KEPT = 4
"""Listings that are kept at once: a few hundred bytes an object."""


@dataclass(frozen=True)
class Listing:
    """The objects below ``url``, and their names, sorted."""

    url: str
    objects: Mapping[str, Stored]
    names: tuple[str, ...]


_kept: dict[str, tuple[float, Listing]] = {}


def listing_of(url: str) -> Listing:
    """What lies below a URL, or a folder above it, as it was at most ``FRESH_S`` ago. Raises StoreError."""
    known = kept_listing(url)
    if known is not None:
        return known
    listing = look_below(url)
    while len(_kept) >= KEPT:
        _kept.pop(next(iter(_kept)), None)
    _kept[url] = (time.monotonic(), listing)
    return listing


def look_below(url: str) -> Listing:
    """What lies below a URL now."""
    objects = list_objects(url)
    return Listing(url, objects, tuple(objects))


def kept_listing(url: str) -> Listing | None:
    """A fresh listing that holds what lies below a URL, if there is one."""
    return next((found for found in _fresh() if url == found.url or covers(found, url)), None)


def objects_below(listing: Listing, url: str) -> dict[str, Stored]:
    """Name relative to ``url`` → object, of a folder that is the listing's or below it."""
    prefix = prefix_in(listing, url)
    start = bisect_left(listing.names, prefix)
    found: dict[str, Stored] = {}
    for name in listing.names[start:]:
        if not name.startswith(prefix):
            break
        found[name[len(prefix) :]] = listing.objects[name]
    return found


def covers(listing: Listing, url: str) -> bool:
    """Whether the listing would hold what lies at a URL."""
    return url.startswith(f"{listing.url}/")


def prefix_in(listing: Listing, url: str) -> str:
    """What the names of a folder's objects begin with in the listing."""
    inner = url.removeprefix(listing.url).strip("/")
    return f"{inner}/" if inner else ""


def _fresh() -> list[Listing]:
    for url, (asked, _) in list(_kept.items()):
        if time.monotonic() - asked > FRESH_S:
            _kept.pop(url, None)
    return [listing for _, listing in _kept.values()]
