"""Local folders for copies of what is behind URLs. Deleting them only costs time."""

import hashlib
import os
import re
from pathlib import Path

from asset2sim.storage.objects import key_of, scheme_of
from schemas.location import Location

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
    """The local folder for copies of a URL's tables for read-only use; a run on this machine may be working on
    ``working_folder``."""
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
