"""Views of refined objects by all that they show: what looks as in an earlier run is not drawn again."""

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

import asset2sim.render
from asset2sim.assets.authored import REFINED_NAME
from asset2sim.assets.checksums import file_digest
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.meshes.array_file import read_arrays, write_arrays
from asset2sim.checks.known_reports import sources
from asset2sim.engines.registry import versions_of
from asset2sim.render import VIEW_NAMES, write_views
from asset2sim.storage.regular_files import write_whole
from schemas.settings import ViewSettings
from schemas.source_code import code_digest

VIEW_CACHE = ".cache/views"
"""The views of an earlier run, a file of 80 kB an asset."""
VIEWS = "views"


def write_known_views(folder: Path, positions: Mapping[str, float], settings: ViewSettings, kept: Path | None) -> None:
    """Write the views of a refined folder as ``write_views`` does; those that the file ``kept`` holds of the same are
    taken from there, others are kept there."""
    key = "" if kept is None else digest(folder, positions, settings)
    stored = None if kept is None else read_arrays(kept, VIEW_NAMES)
    if stored is not None and stored[1] == key:
        (folder / VIEWS).mkdir(exist_ok=True)
        for name, picture in stored[0].items():
            write_whole(folder / VIEWS / f"{name}.png", picture.tobytes())
        return
    written = write_views(folder / URDF_NAME, positions, folder / VIEWS, settings)
    if kept is not None:
        write_arrays(kept, {file.stem: np.fromfile(file, dtype=np.uint8) for file in written}, key)


def digest(folder: Path, positions: Mapping[str, float], settings: ViewSettings) -> str:
    """SHA-256 over what decides the views: the URDF, the overlay, which says where the object faces, the files in the
    folders beside them, the state, the size, and the code."""
    whole = hashlib.sha256(f"{drawing()} {settings.width} {settings.height} {json.dumps(dict(positions))}".encode())
    beside = (file for place in folder.iterdir() if place.is_dir() and place.name != VIEWS for file in place.rglob("*"))
    for file in (folder / URDF_NAME, folder / REFINED_NAME, *sorted(file for file in beside if file.is_file())):
        name = file.relative_to(folder).as_posix()
        whole.update(f"{name} {file_digest(file)}\n".encode(errors="surrogateescape"))
    return whole.hexdigest()


@cache
def drawing() -> str:
    """Hash of the sources that read and draw objects, and versions of the packages that do."""
    room = Path(asset2sim.render.__file__).parent
    files = {file.name: file for file in room.glob("*.py")}
    return json.dumps(versions_of(("embreex",))) + sources() + code_digest(files, prose=True)
