"""Where a dataset or an output lies: a folder that this machine sees, or a URL of an object store."""

from pathlib import Path
from typing import Annotated
from urllib.parse import urlsplit

from pydantic import PlainSerializer, PlainValidator, WithJsonSchema
from typing_extensions import TypeIs

from schemas.errors import UsageError

LOCAL_SCHEMES = ("file", "local")
"""Schemes that name a folder of this machine."""


def location_of(value: object) -> Path | str:
    """A local folder as a ``Path``, a URL such as ``s3://bucket/prefix`` as text without a slash at its end.
    ``file://`` URLs are local folders. Raises UsageError for an empty name, and for a URL that names no bucket, chains
    several stores, or holds a password: tables and logs would keep it."""
    if isinstance(value, Path):
        return value
    text = str(value)
    if not text.isascii() and text != text.encode(errors="replace").decode():
        shown = text.encode(errors="surrogateescape").decode(errors="backslashreplace")
        raise UsageError(f"{shown}: a path must be text in UTF-8, which tables can hold; rename the folder")
    if not text.strip():
        raise UsageError("a folder's name is empty; name one, such as data/refined, or '.' for the current folder")
    scheme, separator, rest = text.partition("://")
    if not separator or "/" in scheme:
        return Path(text)
    if scheme.lower() in LOCAL_SCHEMES:
        return Path(rest)
    if "::" in text:
        raise UsageError(f"{scheme}://…: name one store, as s3://bucket/prefix; chained URLs are not supported")
    try:
        password = urlsplit(text).password
    except ValueError as error:
        raise UsageError(f"'{scheme}://…' is not a URL ({error}); write s3://bucket/prefix") from None
    if password is not None:
        raise UsageError(
            f"{scheme}://…: leave the password out of the URL; credentials come from the environment or the "
            "store's own configuration files"
        )
    parts = [part for part in rest.split("/") if part]
    if not parts or any(part in (".", "..") for part in parts):
        raise UsageError(f"'{text}' is not a URL of a folder; write s3://bucket/prefix")
    return f"{scheme.lower()}://{'/'.join(parts)}"


Location = Annotated[
    Path | str,
    PlainValidator(location_of),
    PlainSerializer(str, return_type=str, when_used="json"),
    WithJsonSchema({"type": "string"}),
]
"""A local folder (``Path``) or the URL of one in an object store (``str``), as ``location_of`` makes it."""


def is_url(location: Path | str) -> TypeIs[str]:
    """Whether a location that ``location_of`` made is a URL."""
    return isinstance(location, str)


def local_folder(text: str) -> Path:
    """A local folder, for programs that cannot use an object store. Raises UsageError for a URL."""
    found = location_of(text)
    if is_url(found):
        raise UsageError(f"{text}: only `asset2sim` itself takes URLs; name a folder of this machine")
    return found


def absolute(location: Path | str) -> Path | str:
    """The location as an absolute path; a URL unchanged. Raises UsageError for a path that no file system can have."""
    if is_url(location):
        return location
    try:
        found = Path(location).resolve()
        found.exists()
        return found
    except (OSError, RuntimeError) as error:  # a name that is too long; links that lead back to themselves
        said = error.strerror if isinstance(error, OSError) else "its links lead in a circle"
        raise UsageError(f"{location}: no folder can be there ({said}); name another") from error


def nearest_existing(path: Path) -> Path:
    """The path as absolute, or the nearest folder above it that exists."""
    path = path.absolute()
    return next(place for place in (path, *path.parents) if place.exists())


def below(location: Path | str, *parts: str) -> Path | str:
    """The location of ``parts`` under a location."""
    return "/".join((location, *parts)) if is_url(location) else Path(location, *parts)


def is_within(location: Path | str, folder: Path | str) -> bool:
    """Whether an absolute location is a folder or lies below it."""
    if is_url(location) or is_url(folder):
        return f"{location}/".startswith(f"{folder}/")
    return Path(location).is_relative_to(folder)
