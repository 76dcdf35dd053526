"""A dataset's folders and files by name, alike on this machine and behind a URL. Names have forward slashes."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from schemas.location import below


@dataclass(frozen=True)
class Tree:
    """What lies below ``place``. ``folders`` and ``files`` list the names in a folder, by name, folders that are not
    hidden; "" is ``place`` itself. ``read`` gives a file's bytes, and raises OSError where there is none."""

    place: Path | str
    folders: Callable[[str], list[str]]
    files: Callable[[str], list[str]]
    read: Callable[[str], bytes]

    def at(self, name: str) -> Path | str:
        """Where a folder or a file is."""
        return below(self.place, name) if name else self.place


def local_tree(root: Path) -> Tree:
    """A folder of this machine."""

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
