"""What lies in the place of a file: nothing, a pipe, a socket, a device, a folder, a link, or noise."""

import os
import socket
import stat
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.hostile.case import HANDLED, REFUSED, Case, Place
from tests.hostile.tiny import BODY, LID, MESHES, URDF, Write, asset

SPARSE_BYTES = 300 * 1024**2
"""More than a mesh may have, and little enough to be read in seconds."""


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _socket(path: Path) -> None:
    # Paths of sockets are short; the name is given from within the folder.
    here = os.getcwd()
    os.chdir(path.parent)
    try:
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(path.name)
    finally:
        os.chdir(here)


def _device(path: Path) -> None:
    try:
        os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 5))
    except PermissionError:  # only root may; a link to one then
        path.symlink_to("/dev/zero")


def _folder(path: Path) -> None:
    path.mkdir()


def _nowhere(path: Path) -> None:
    path.symlink_to("nowhere")


def _itself(path: Path) -> None:
    path.symlink_to(path.name)


def _zero(path: Path) -> None:
    path.symlink_to("/dev/zero")


def _terminal(path: Path) -> None:
    path.symlink_to("/dev/tty")


def _standard_input(path: Path) -> None:
    path.symlink_to("/proc/self/fd/0")


def _sparse(path: Path) -> None:
    with path.open("wb") as stream:
        stream.truncate(SPARSE_BYTES)


def _of(content: bytes) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        path.write_bytes(content)

    return write


def _nothing(path: Path) -> None:
    pass


INSTEAD: dict[str, Callable[[Path], None]] = {
    "nothing": _nothing, "pipe": _pipe, "socket": _socket, "device": _device, "folder": _folder,
    "link_nowhere": _nowhere, "link_itself": _itself, "link_zero": _zero, "link_tty": _terminal,
    "link_stdin": _standard_input, "sparse": _sparse, "empty": _of(b""), "nuls": _of(b"\0" * 4096),
    "noise": _of(bytes(range(256)) * 16),
}  # fmt: skip
"""What is there → a function that makes it."""
OPTIONAL = ("meta.json", "semantics.txt", f"{MESHES}/look.mtl", f"{MESHES}/red.png")


def cases() -> Sequence[Case]:
    """Every file of an asset with each of these in its place."""
    found = []
    for name in (URDF, BODY, LID, *OPTIONAL):
        stem = Path(name).name.replace(".", "_")
        modes = REFUSED if name == URDF else HANDLED
        found += [Case(f"{stem}_{kind}", _replaced(name, make), modes) for kind, make in INSTEAD.items()]
    for kind in ("pipe", "device", "link_itself", "link_nowhere", "empty"):
        found.append(Case(f"meshes_{kind}", _replaced_folder(INSTEAD[kind]), HANDLED))
        found.append(Case(f"beside_{kind}", _beside(INSTEAD[kind]), HANDLED))
    return found


def _replaced(name: str, make: Callable[[Path], None]) -> Write:
    def then(place: Place) -> None:
        make(place.asset / name)

    return asset({name: None}, then)


def _replaced_folder(make: Callable[[Path], None]) -> Write:
    def then(place: Place) -> None:
        (place.asset / MESHES).rename(place.asset / "elsewhere")
        make(place.asset / MESHES)

    return asset(then=then)


def _beside(make: Callable[[Path], None]) -> Write:
    return asset(then=lambda place: make(place.asset / "model.xml"))
