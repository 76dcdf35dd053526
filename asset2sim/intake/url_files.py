"""Assets behind URLs: content hashes from listings alone, and local copies of their files, brought up to date."""

import hashlib
import json
import posixpath
import sqlite3
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path, PurePosixPath

from asset2sim.assets.urdf.references import PARENTS_SEARCHED, is_loose, mesh_candidates, outer_references, path_in
from asset2sim.intake.locate import candidates, split_url
from asset2sim.storage.mirror import changed_objects, fetch, remove_others
from asset2sim.storage.objects import (
    Stored,
    StoreError,
    data_root,
    key_of,
    list_objects,
    local_copy_path,
    object_info,
    read_objects,
    scheme_of,
    store_usage_error,
)
from asset2sim.storage.tree import Listing, cached_listing, fetch_listing, is_below, listing_of, objects_below
from schemas.asset import AssetRef
from schemas.inputs import InputSettings
from schemas.location import Location

LOOKS = (".mtl", ".bmp", ".gif", ".jpeg", ".jpg", ".png", ".tga", ".tif", ".tiff")
"""File endings of an OBJ's materials and textures: taken from its own folder, where exporters put them."""

OUTSIDE = "outside"
"""The hash of an asset that is not read, since its folder lies outside the dataset."""

FindObject = Callable[[str], Stored | None]
ListFolder = Callable[[str], Mapping[str, Stored]]


def visible(objects: Mapping[str, Stored]) -> dict[str, Stored]:
    """The objects of an asset's folder, without those in which a part of the name starts with a dot."""
    return {name: stored for name, stored in objects.items() if not any(p.startswith(".") for p in name.split("/"))}


def choose_urdf_name(url: str, names: Mapping[str, Stored]) -> str | None:
    """The file among an asset's objects that describes it: the one that its URL names, else as ``find_source`` chooses
    where no content decides; None where there is none, or more than one."""
    if (stated := split_url(url)[1]) in names:
        return stated
    found = candidates(names)
    return found[0] if len(found) == 1 else None


@dataclass(frozen=True)
class AllowedUrls:
    """The URLs of folders below which an asset's objects may lie, those of packages by name; no ``roots``: the whole
    bucket."""

    roots: tuple[str, ...] = ()
    packages: Mapping[str, str] = field(default_factory=dict)

    def allows(self, url: str) -> bool:
        """Whether an object's URL lies below one of the folders."""
        folders = (*self.roots, *self.packages.values())
        return not self.roots or any(f"{url}/".startswith(f"{folder}/") for folder in folders)


BUCKET = AllowedUrls()


def allowed_urls(ref: AssetRef, inputs: InputSettings) -> AllowedUrls:
    """Where the objects of an asset may lie: as ``allowed_folders`` says of folders, within its bucket."""
    packages = {name: place for name, place in inputs.package_folders.items() if Location(place).is_url}
    return AllowedUrls(() if inputs.allow_outside else (ref.root or split_url(ref.path)[0],), packages)


def outer_objects(
    folder: str,
    inner: Mapping[str, Stored],
    urdf: str,
    references: list[str],
    find: FindObject,
    below: ListFolder,
    reach: AllowedUrls = BUCKET,
) -> dict[str, Stored]:
    """URL → object that a reference names outside the asset's folder, within its bucket and ``reach``.

    ``urdf`` is among the names in ``inner``; ``find`` looks an object up by its URL, ``below`` lists a folder's.
    """
    scheme, _, key = folder.partition("://")
    base = PurePosixPath("/", key, urdf).parent
    above = list(base.parents)[:PARENTS_SEARCHED]
    found: dict[str, Stored] = {}
    for reference in references:
        for candidate in (*_in_package(reference, reach), *mesh_candidates(reference, base, above)):
            path = posixpath.normpath(str(candidate))
            if path.split("/")[1] != key.split("/")[0] or path.count("/") < 2:
                continue
            if path.startswith(f"/{key}/"):
                if path.removeprefix(f"/{key}/") in inner:
                    break
                continue
            url = f"{scheme}:/{path}"
            if not reach.allows(url):
                continue
            stored = find(url)
            if stored is not None:
                found[url] = stored
                found |= _looks(url, below)
                break
    return found


def _in_package(reference: str, reach: AllowedUrls) -> list[PurePosixPath]:
    package, _, rest = path_in(reference).partition("/")
    place = reach.packages.get(package) if is_loose(reference) else None
    return [] if place is None else [PurePosixPath("/", place.partition("://")[2], rest)]


def _looks(mesh: str, below: ListFolder) -> dict[str, Stored]:
    if not mesh.lower().endswith(".obj"):
        return {}
    folder = mesh.rpartition("/")[0]
    return {
        f"{folder}/{name}": stored
        for name, stored in below(folder).items()
        if "/" not in name and name.lower().endswith(LOOKS)
    }


READ_AT_ONCE = 500
"""URDFs that are in memory at once: 50 MB of large ones."""

_TABLE = """
CREATE TABLE IF NOT EXISTS urdfs (url TEXT PRIMARY KEY, version TEXT, outer_references TEXT) WITHOUT ROWID
"""


def remote_content_hashes(state: sqlite3.Connection, folders: Mapping[str, AllowedUrls]) -> dict[str, str]:
    """URL of a folder or file → SHA-256 over the names, sizes and versions of its asset's objects; ``folders`` says of
    each where they may lie. One that lies outside itself has none.

    ``state`` remembers what a URDF of one version refers to outside its folder, so each is read once. Raises StoreError
    where a store does not answer.
    """
    state.execute(_TABLE)
    found: dict[str, str] = {}
    for group in _groups([url for url, reach in folders.items() if reach.allows(url)]):
        homes = {url: split_url(url)[0] for url in group}
        whole = _whole([*homes.values()])
        listings = {url: whole if whole is not None else fetch_listing(home) for url, home in homes.items()}
        inner = {url: visible(objects_below(listings[url], home)) for url, home in homes.items()}
        names = {url: name for url in group if (name := choose_urdf_name(url, inner[url]))}
        urdfs = {f"{homes[url]}/{name}": inner[url][name].version for url, name in names.items()}
        references = _references(state, urdfs)
        for url, home in homes.items():
            objects = dict(inner[url])
            name = names.get(url)
            outer = references.get(f"{home}/{name}", []) if name else []
            if name and outer:
                look_up = partial(_find, listings[url]), partial(_below, listings[url])
                objects |= outer_objects(home, inner[url], name, outer, *look_up, folders[url])
            found[url] = _digest(objects)
    return {url: found.get(url, OUTSIDE) for url in folders}


def _digest(objects: dict[str, Stored]) -> str:
    whole = hashlib.sha256()
    for name, stored in sorted(objects.items()):
        whole.update(f"{name}\0{stored.size}\0{stored.version}\n".encode(errors="surrogateescape"))
    return whole.hexdigest()


def _groups(folders: Sequence[str]) -> list[list[str]]:
    """The URLs, grouped by bucket."""
    groups: dict[str, list[str]] = defaultdict(list)
    for url in folders:
        groups["/".join(url.split("/")[:3])].append(url)
    return list(groups.values())


def _whole(urls: Sequence[str]) -> Listing | None:
    """One listing that covers all of these URLs; None where that would list a whole bucket for a few folders."""
    scheme, _, _ = urls[0].partition("://")
    root = f"{scheme}://{posixpath.commonpath([url.partition('://')[2] for url in urls])}"
    return listing_of(root) if "/" in key_of(root) else cached_listing(root)


def _references(state: sqlite3.Connection, urdfs: dict[str, str]) -> dict[str, list[str]]:
    """URDF's URL → the references in it that may lead outside its folder."""
    known = {url: (version, text) for url, version, text in state.execute("SELECT * FROM urdfs")}
    found = {url: json.loads(known[url][1]) for url in urdfs if known.get(url, ("",))[0] == urdfs[url]}
    unread = [url for url in urdfs if url not in found]
    for start in range(0, len(unread), READ_AT_ONCE):
        texts = read_objects(unread[start : start + READ_AT_ONCE])
        fresh = {url: outer_references(text.decode(errors="replace")) for url, text in texts.items()}
        found |= fresh
        rows = [(url, urdfs[url], json.dumps(references)) for url, references in fresh.items()]
        state.executemany("INSERT OR REPLACE INTO urdfs VALUES (?, ?, ?)", rows)
    return found


def _find(listing: Listing, url: str) -> Stored | None:
    if is_below(listing, url):
        return listing.objects.get(url.removeprefix(f"{listing.url}/"))
    try:
        return object_info(url)
    except StoreError as error:
        if error.refused:
            return None
        raise


def _below(listing: Listing, url: str) -> dict[str, Stored]:
    if url == listing.url or is_below(listing, url):
        return objects_below(listing, url)
    return list_objects(url)


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
