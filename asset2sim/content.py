"""What an asset's files and the request say, as one hash: an unchanged asset has an unchanged hash."""

import hashlib
from collections.abc import Iterable
from pathlib import Path


def hash_files(files: Iterable[Path], *texts: str) -> str:
    """SHA-256 over file names and bytes, sorted by name, and over ``texts``; 64 hex digits."""
    digest = hashlib.sha256()
    for file in sorted(set(files)):
        digest.update(file.name.encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    for text in texts:
        digest.update(b"\x00" + text.encode())
    return digest.hexdigest()
