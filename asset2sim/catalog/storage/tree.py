"""A dataset's folders and files behind a URL."""

import os
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from asset2sim.catalog.storage.listing import listing_of, objects_below
from asset2sim.catalog.storage.objects import StoreError, object_info, read_object, store_usage_error
from schemas.errors import UsageError
from schemas.location import below


@dataclass(frozen=True)
class Tree:
    """The folders and files below ``place``. ``folders`` (no hidden ones) and ``files`` list the names in a folder,
    sorted; "" is ``place`` itself. ``read`` gives a file's bytes, and raises OSError where there is none."""

    place: Path | str
    folders: Callable[[str], list[str]]
    files: Callable[[str], list[str]]
    read: Callable[[str], bytes]

    def at(self, name: str) -> Path | str:
        """Path or URL of a folder or a file."""
        return below(self.place, name) if name else self.place


def local_tree(root: Path) -> Tree:
    """Tree of a local folder."""

    def names(folder: str, *, folders: bool) -> list[str]:
        try:
            with os.scandir(root / folder) as entries:
                return sorted(entry.name for entry in entries if entry.is_dir() == folders)
        except OSError:
            return []

    return Tree(
        root,
        lambda folder: [name for name in names(folder, folders=True) if not name.startswith(".")],
        lambda folder: names(folder, folders=False),
        lambda file: (root / file).read_bytes(),
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

    def read(name: str) -> bytes:
        try:
            return read_object(f"{url}/{name}")
        except StoreError as error:
            raise store_usage_error(error) from error

    return Tree(
        url,
        lambda folder: sorted(name for name in folders.get(folder, ()) if not name.startswith(".")),
        lambda folder: sorted(files.get(folder, ())),
        read,
    )
