"""What a worker does for one asset behind URLs: fetch its files, send what came of them."""

import shutil
from collections.abc import Iterator
from pathlib import Path

from asset2sim.methods.reference import LEVELS
from asset2sim.metrics.reference import FILE as REFERENCE
from asset2sim.remote.cache import data_root
from asset2sim.remote.listing import Listing, files_of
from asset2sim.remote.mirror import fetch, send_folder
from asset2sim.remote.store import StoreError, key_of, scheme_of, send_objects
from schemas.asset import AssetRecord, AssetRef
from schemas.location import is_url
