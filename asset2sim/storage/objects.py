"""Object stores through fsspec, and the local folders for copies of what is in them. Credentials and endpoints come
from each store's own environment variables and configuration files (for S3 ``AWS_ENDPOINT_URL`` or
``FSSPEC_S3_ENDPOINT_URL``, among others).

Not obstore 0.12: it would save 34 lines here and in the lock (versions, patterns in names, the race of stores without
conditional writes) and cost about 28 (bulk transfers of one's own, credentials from configuration files through boto3),
and fsspec's other stores (SFTP, HDFS) would be lost. Not universal-pathlib 0.3: it would replace 30 lines of ``tree``,
but takes two requests a folder where a listing takes one for a thousand objects, and tells no object's version.
"""

import hashlib
import os
import posixpath
import re
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from schemas.errors import Asset2SimError, UsageError
from schemas.location import Location
from schemas.secret import redact

VERSION_KEYS = ("ETag", "etag", "md5Hash", "generation", "LastModified", "last_modified", "mtime", "created")
"""Fields of a listing that change whenever an object's content does, the most reliable first."""
AT_ONCE = 16
"""Objects that are read at once: waiting takes longer than reading."""
MAX_ERROR_CHARS = 200
"""Characters of a store's own error text that a message quotes."""

_PATTERN = re.compile(r"[*?\[]")


class StoreError(Asset2SimError):
    """A store failed; ``missing`` (no such object) and ``refused`` (no access) are set where that is known."""

    def __init__(self, message: str, *, missing: bool = False, refused: bool = False) -> None:
        super().__init__(message)
        self.missing = missing
        self.refused = refused


@dataclass(frozen=True)
class Stored:
    """An object: a version that changes whenever its content does, and its size, bytes."""

    version: str
    size: int


def open_store(url: str) -> Any:
    """The fsspec file system of a URL, without a cache of listings. Raises UsageError where none is installed."""
    import fsspec  # late: only URLs need it
    from fsspec.registry import known_implementations

    scheme = scheme_of(url)
    try:
        # A listing that is kept would hide what other machines write.
        return fsspec.filesystem(scheme, use_listings_cache=False)
    except (ImportError, ValueError) as error:
        known = known_implementations.get(scheme)
        if known is None:
            raise UsageError(f"{url}: no store is known by '{scheme}'; use a folder, s3:// or gs://") from error
        # fsspec's own file systems may lack a package that they need: SFTP wants paramiko.
        package = getattr(error, "name", None) or known["class"].partition(".")[0]
        raise UsageError(f"{url}: {scheme}:// needs the package {package}; `pip install {package}`") from error


def scheme_of(url: str) -> str:
    """``s3`` of ``s3://bucket/key``."""
    return url.partition("://")[0]


def key_of(url: str) -> str:
    """``bucket/key`` of ``s3://bucket/key``, as fsspec names an object."""
    return url.partition("://")[2]


@contextmanager
def store_errors(url: str) -> Iterator[None]:
    """Turn errors of a store's library into ``StoreError``, one line that names the URL and holds no secrets."""
    try:
        yield
    except (Asset2SimError, FileExistsError):
        raise
    except FileNotFoundError as error:
        raise StoreError(f"{url}: not there ({_told(error)})", missing=True) from error
    except PermissionError as error:
        raise StoreError(f"{url}: access denied ({_told(error)})", refused=True) from error
    except Exception as error:  # each store's library has errors of its own
        refused = "Credential" in type(error).__name__
        raise StoreError(f"{url}: {_told(error)}", refused=refused) from error


def store_usage_error(error: StoreError) -> UsageError:
    """UsageError for a store's error before a run, which is most likely the user's mistake."""
    return UsageError(
        f"{error}; check the address, the credentials in your environment or configuration files, and the endpoint"
    )


def list_objects(url: str) -> dict[str, Stored]:
    """Name relative to the URL → object, sorted by name; empty where there are none. Names that no local file could
    have are left out, so that no object is ever written outside its folder."""
    store, key = open_store(url), key_of(url)
    with store_errors(url):
        found: Mapping[str, Mapping[str, Any]] = store.find(key, detail=True)
    objects = {}
    for path, info in found.items():
        name = path.removeprefix(f"{key}/")
        if name != path and _is_safe(name) and info.get("type") == "file":
            objects[name] = stored(info)
    return dict(sorted(objects.items()))


def object_info(url: str) -> Stored | None:
    """Version and size of one object; None where there is none."""
    store = open_store(url)
    try:
        with store_errors(url):
            info = store.info(key_of(url))
    except StoreError as error:
        if error.missing:
            return None
        raise
    return stored(info) if info.get("type") == "file" else None


def stored(info: Mapping[str, Any]) -> Stored:
    """Version and size from one entry of a listing."""
    version = next((str(info[name]) for name in VERSION_KEYS if info.get(name) is not None), "")
    return Stored(version.strip('"'), int(info.get("size") or 0))


def digest_of(files: Mapping[str, Stored]) -> str:
    """SHA-256 over the names, sizes and versions of a refined folder's files; 64 hex digits."""
    return hashlib.sha256("\n".join(f"{name} {item}" for name, item in files.items()).encode()).hexdigest()


def read_object(url: str) -> bytes:
    """An object's bytes."""
    store = open_store(url)
    with store_errors(url):
        content: bytes = store.cat_file(key_of(url))
    return content


def write_object(url: str, content: bytes, **conditions: str) -> None:
    """Make an object of bytes. ``conditions`` are the store's own; with ``mode="create"`` FileExistsError says that the
    object is there already."""
    store = open_store(url)
    with store_errors(url):
        store.pipe_file(key_of(url), content, **conditions)


def read_objects(urls: list[str]) -> dict[str, bytes]:
    """URL → bytes of those objects that are there; several at once."""

    def read(url: str) -> bytes | None:
        try:
            return read_object(url)
        except StoreError as error:
            if error.missing or error.refused:
                return None
            raise

    with ThreadPoolExecutor(AT_ONCE) as pool:
        found = zip(urls, pool.map(read, urls), strict=True)
        return {url: content for url, content in found if content is not None}


def fetch_objects(files: Mapping[str, Path]) -> None:
    """Copy objects, by URL, to local files whose folders are there; several at once."""
    if files:
        store = open_store(next(iter(files)))
        with store_errors(_common(files)):
            store.get([key_of(url) for url in files], [str(path) for path in files.values()])


def send_objects(files: Mapping[str, Path]) -> None:
    """Copy local files to objects, by URL; several at once, in no order."""
    if files:
        store = open_store(next(iter(files)))
        with store_errors(_common(files)):
            store.put([str(path) for path in files.values()], [key_of(url) for url in files])


def copy_objects(copies: Mapping[str, str]) -> None:
    """Copy objects within their store, URL → URL; the store moves the bytes."""
    for source, target in copies.items():
        store = open_store(source)
        with store_errors(source):
            store.cp_file(key_of(source), key_of(target))


def remove_objects(urls: list[str]) -> None:
    """Remove objects; one that is not there is no error."""
    if not urls:
        return
    store, keys = open_store(urls[0]), [key_of(url) for url in urls]
    # In a list of keys each is taken as a pattern, which may match other objects.
    plain = [key for key in keys if not _PATTERN.search(key)]
    try:
        with store_errors(_common(urls)):
            if plain:
                store.rm(plain)
            for key in set(keys).difference(plain):
                store.rm_file(key)
    except StoreError as error:
        if not error.missing:
            raise
        # This store stops at the first missing object: remove them one by one.
        for url in urls if len(urls) > 1 else ():
            remove_objects([url])


def _is_safe(name: str) -> bool:
    """Whether a relative name stays below the folder that it is written to."""
    return all(part not in ("", ".", "..") and "\\" not in part and "\0" not in part for part in name.split("/"))


def _common(urls: Mapping[str, Path] | list[str]) -> str:
    keys = [key_of(url) for url in urls]
    return f"{scheme_of(next(iter(urls)))}://{keys[0] if len(keys) == 1 else posixpath.commonpath(keys)}"


def _told(error: BaseException) -> str:
    lines = str(error).strip().splitlines() or [type(error).__name__]
    return redact(lines[0])[:MAX_ERROR_CHARS]


VARIABLE = "ASSET2SIM_CACHE"
"""Environment variable that names another cache folder."""
DIGITS = 16
"""Hexadecimal digits of a URL's hash in its folder's name."""


def cache_root() -> Path:
    """``$ASSET2SIM_CACHE``, else ``asset2sim`` in the user's cache folder."""
    if chosen := os.environ.get(VARIABLE):
        return Path(chosen).expanduser().resolve()
    return Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser().resolve() / "asset2sim"


def working_folder(out: Path | str) -> Path:
    """The local folder in which a run works on OUT: OUT itself, or the one that mirrors its URL."""
    place = Location(out)
    return _folder("out", place) if place.is_url else place.folder


def reading_folder(out: str) -> Path:
    """The local folder for read-only copies of a URL's tables; a run may be working on ``working_folder``."""
    return _folder("read", out)


def data_root() -> Path:
    """The local folder below which objects of datasets lie, as ``<scheme>/<bucket>/<key>``."""
    return cache_root() / "data"


def local_copy_path(url: str) -> Path:
    """Path of the local copy of a dataset's URL; relative paths between objects stay the same."""
    return data_root() / scheme_of(url) / key_of(url)


def _folder(purpose: str, url: str) -> Path:
    word = re.sub(r"[^A-Za-z0-9]+", "-", url.rpartition("/")[2]).strip("-").lower()[:40] or "out"
    return cache_root() / purpose / f"{word}-{hashlib.sha256(url.encode()).hexdigest()[:DIGITS]}"
