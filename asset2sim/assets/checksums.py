"""``SHA256SUMS`` in a refined folder: what was written, in the format of ``sha256sum -c``."""

import hashlib
from pathlib import Path

FILE = "SHA256SUMS"


def write_checksums(folder: Path) -> None:
    """List every file below the folder with its SHA-256."""
    lines = []
    for path in sorted(path for path in folder.rglob("*") if path.is_file() and path.name != FILE):
        name = path.relative_to(folder).as_posix()
        # The format has escapes for such names, which no mesh has.
        if not {"\n", "\\"} & set(name):
            lines.append(f"{file_digest(path)}  {name}\n")
    (folder / FILE).write_text("".join(lines), encoding="utf-8", errors="surrogateescape")


def changed_files(folder: Path) -> tuple[str, ...] | None:
    """The files of a refined folder that are not as they were written, each with what became of it: "mobility.urdf
    changed". None where nothing says how they were. What was added, as pictures are later, is no change."""
    try:
        text = (folder / FILE).read_text(encoding="utf-8", errors="surrogateescape")
    except OSError:
        return None
    entries = [line.partition("  ") for line in text.splitlines()]
    if not entries or any(len(digest) != 64 or not name for digest, _, name in entries):
        return (f"{FILE} damaged",)
    return tuple(found for digest, _, name in entries if (found := _change(folder / name, name, digest)))


def _change(path: Path, name: str, digest: str) -> str:
    try:
        if path.is_file() and file_digest(path) == digest:
            return ""
        return f"{name} {'changed' if path.exists() else 'removed'}"
    except OSError as error:
        return f"{name} unreadable ({error.strerror})"


def file_digest(path: Path) -> str:
    """A file's SHA-256, in hexadecimal."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
