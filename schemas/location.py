"""Where a dataset or an output lies: a folder that this machine sees, or one of an object store, named by a URL."""

from pathlib import Path
from typing import Self
from urllib.parse import urlsplit

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from schemas.errors import UsageError

LOCAL_SCHEMES = ("file", "local")
"""Schemes that name a folder of this machine."""


class Location(str):
    """A folder of this machine by its path, or one of an object store by its URL, such as ``s3://bucket/prefix``, as
    text. Made of a path or of text, once, where a user names it; a ``Location`` of a ``Location`` is the same."""

    __slots__ = ()

    def __new__(cls, value: Path | str) -> Self:
        """Raises UsageError for an empty name, and for a URL that names no bucket, chains several stores, or holds a
        password: tables and logs would keep it. ``file://`` URLs are local folders."""
        return super().__new__(cls, value if isinstance(value, Path | Location) else _parsed(str(value)))

    @classmethod
    def __get_pydantic_core_schema__(cls, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """The schema of a string."""
        serialized = core_schema.plain_serializer_function_ser_schema(
            str, return_schema=core_schema.str_schema(), when_used="json"
        )
        parsed = core_schema.no_info_plain_validator_function(cls, serialization=serialized)
        return core_schema.json_or_python_schema(core_schema.chain_schema([core_schema.str_schema(), parsed]), parsed)

    @property
    def is_url(self) -> bool:
        """Whether it is in an object store; a path has no two slashes in a row."""
        return "://" in self

    @property
    def folder(self) -> Path:
        """The folder of this machine. Raises UsageError for a URL."""
        if self.is_url:
            raise UsageError(f"{self}: only `asset2sim` itself takes URLs; name a folder of this machine")
        return Path(self)

    def absolute(self) -> "Location":
        """The location as an absolute path; a URL unchanged. Raises UsageError for a path that no file system has."""
        if self.is_url:
            return self
        try:
            found = self.folder.resolve()
            found.exists()
            return Location(found)
        except (OSError, RuntimeError) as error:  # a name that is too long; links that lead back to themselves
            said = error.strerror if isinstance(error, OSError) else "its links lead in a circle"
            raise UsageError(f"{self}: no folder can be there ({said}); name another") from error

    def below(self, *parts: str) -> "Location":
        """The location of ``parts`` under this one."""
        return str.__new__(Location, "/".join((self, *parts)) if self.is_url else Path(self, *parts))

    def is_within(self, folder: Path | str) -> bool:
        """Whether this absolute location is a folder or lies below it."""
        other = Location(folder)
        if self.is_url or other.is_url:
            return f"{self}/".startswith(f"{other}/")
        return self.folder.is_relative_to(other.folder)


def _parsed(text: str) -> Path | str:
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


def nearest_existing(path: Path) -> Path:
    """The path as absolute, or the nearest folder above it that exists."""
    path = path.absolute()
    return next(place for place in (path, *path.parents) if place.exists())
