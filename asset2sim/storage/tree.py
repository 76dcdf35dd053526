"""A dataset's folders and files behind a URL."""

import os
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from asset2sim.storage.listing import listing_of, objects_below
from asset2sim.storage.objects import StoreError, object_info, read_object, store_usage_error
from asset2sim.storage.regular_files import link_problem, read_regular
from schemas.errors import UsageError
from schemas.location import Location


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
