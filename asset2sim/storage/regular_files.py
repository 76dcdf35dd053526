"""Reading regular files only (pipes and devices block, links lead nowhere), and writing whole files or none."""

import errno
import os
import stat
import tempfile
from pathlib import Path

NOT_THERE = "is not there"
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def file_problem(path: Path) -> str | None:
    """Why a path is no file that can be read, in words that follow its name ("is a pipe, not a file"); None where it is
    a regular file, whether it may be opened or not."""
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError) as error:
        return path_problem(path, error)
    return None if stat.S_ISREG(mode) else f"is {_KINDS.get(stat.S_IFMT(mode), 'special')}, not a file"


def is_file(path: Path) -> bool:
    """Whether there is a file at a path; False for what cannot be asked, such as a name that is too long."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def folder_problem(path: Path) -> str | None:
    """Why a path is no folder that can be listed, in words that follow its name; None where it is one."""
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            os.scandir(path).close()
            return None
    except (OSError, ValueError) as error:
        return path_problem(path, error)
    return f"is {_KINDS.get(stat.S_IFMT(mode), 'a file')}, not a folder"


def link_problem(path: Path) -> str | None:
    """Why nothing can be found behind a link, in words that follow its name; None where there is something."""
    try:
        path.stat()
    except OSError as error:
        return path_problem(path, error)
    return None


def path_problem(path: Path, error: OSError | RuntimeError | ValueError) -> str:
    """The text of an error about a path, in words that follow its name."""
    code = error.errno if isinstance(error, OSError) else None
    try:
        if code == errno.ENOENT:
            return f"is a link to {os.readlink(path)}, which is not there" if path.is_symlink() else NOT_THERE
    except OSError:
        return NOT_THERE
    # ``Path.resolve`` raises RuntimeError for a circle of links.
    if code == errno.ELOOP or isinstance(error, RuntimeError):
        return "is a link that leads back to itself"
    if code == errno.ENAMETOOLONG and os.path.islink(path):
        return "is a link to a name that is too long"
    if code in (errno.EINVAL, errno.EISDIR, errno.ENXIO):
        return file_problem(path) or f"cannot be read ({error})"
    if isinstance(error, OSError):
        return f"cannot be read ({error.strerror})"
    return f"cannot be a path ({error})"


def read_regular(path: Path, most: int | None = None) -> bytes:
    """The bytes of a regular file, the first ``most`` of them. Raises OSError, also where it is no regular file."""
    # Without O_NONBLOCK, opening a pipe waits for somebody who writes.
    handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with open(handle, "rb") as stream:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "no regular file", str(path))
        return stream.read() if most is None else stream.read(most)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file and its folder in one step, also beside other processes. Raises OSError, and leaves no part."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".new")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
        os.chmod(name, 0o644)
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def printable(path: Path | str) -> str:
    """The path for a message or a table: bytes that are no UTF-8, and control characters, are written as escapes."""
    text = str(path).encode(errors="surrogateescape").decode(errors="backslashreplace")
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
