"""What the assets of a run consist of, as hashes, wherever they lie."""

import sqlite3
from collections.abc import Sequence
from pathlib import Path

from asset2sim.incremental.state import content_of
from asset2sim.remote.contents import contents_behind
from schemas.asset import AssetRef
from schemas.location import is_url, location_of


def contents_of(state: sqlite3.Connection, refs: Sequence[AssetRef]) -> dict[str, str]:
    """Path of an asset → the hash of what it consists of: local files are read where they changed, and behind a URL it
    comes from what the store says of them."""
    urls = [ref.path for ref in refs if is_url(location_of(ref.path))]
    found = contents_behind(state, urls) if urls else {}
    return found | {ref.path: content_of(state, Path(ref.path)) for ref in refs if ref.path not in found}
