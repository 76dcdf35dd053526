"""The pictures of an object's page, made in killable children, anew only for another object: the refined object as its
run drew it, the same as it came, and loops."""

import hashlib
import json
import logging
import re
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

from PIL import Image

from asset2sim.assets.checksums import FILE
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.references import AllowedFolders, outer_references
from asset2sim.engines.registry import engine_version
from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work, in_child
from asset2sim.intake.locate import find_source
from asset2sim.report.loops.make import Before, draw_before, make_loops
from asset2sim.storage.objects import fetch_objects, list_objects
from asset2sim.storage.regular_files import write_whole
from schemas.errors import AssetError
from schemas.vocabulary import Engine

RECORD = "loops.json"
"""The file beside the loops that says of what they are."""
VERSION = 7
"""Raised when loops, or what came, are drawn otherwise, so that all are made anew."""
SHOWN = re.compile(r"  (mobility\.urdf|overlay\.json|(?!views/).*/.*)\n")
"""The lines of a refined folder's checksums that count: not what was measured of it, nor other forms and pictures."""
REFERENCE = re.compile(r"filename\s*=\s*[\"']([^\"']+)[\"']")


def loops_key(refined: Path, raw_urdf: Path | None) -> str:
    """SHA-256 over what an object's loops show: the refined files by their checksums, the raw URDF and the sizes of the
    files that it names, and the engine's version; 64 hex digits. No file's time counts."""
    digest = hashlib.sha256(f"{VERSION} {engine_version(Engine.PYBULLET)}\n".encode())
    try:
        sums = (refined / FILE).read_text(encoding="utf-8", errors="surrogateescape")
        digest.update("".join(line for line in sums.splitlines(True) if SHOWN.search(line)).encode(errors="replace"))
    except OSError:  # written by hand, or by an earlier version
        for name in (URDF_NAME, "overlay.json"):
            digest.update(content_of(refined / name))
    if raw_urdf is not None:
        content = content_of(raw_urdf)
        digest.update(b"\nraw\n" + content)
        for name in sorted(set(REFERENCE.findall(content.decode(errors="replace")))):
            digest.update(f"{name} {size_of(raw_urdf.parent / name)}\n".encode(errors="replace"))
    return digest.hexdigest()


def is_current(refined: Path, raw_urdf: Path | None, to: Path, moving: bool = True) -> bool:
    """Whether the pictures in ``to`` are of the object as it is now, with loops where it is to be ``moving``."""
    try:
        record = json.loads((to / RECORD).read_text(encoding="utf-8"))
        current = record["key"] == loops_key(refined, raw_urdf) and record.get("moving", True) >= moving
        return bool(current) and all((to / name).is_file() for name in record["files"])
    except (OSError, ValueError, KeyError, TypeError):
        return False


def write_loops(
    refined: Path, raw_urdf: Path | None, to: Path, owner: str = "", before: Before | None = None, moving: bool = True
) -> list[str]:
    """Write an object's size picture, and its loops where it is to be shown ``moving``, into the folder ``to``, in a
    child process that may crash or hang; the names of the files, none where that failed, which is a warning in the log.
    ``raw_urdf``: the URDF that it was refined from, None where it is no longer at hand. The picture of it ``before`` is
    drawn there too, if it can be. ``stop_children(owner)`` ends it."""
    to.mkdir(parents=True, exist_ok=True)
    key = loops_key(refined, raw_urdf)
    outcome = in_child(Work(make_loops, (refined, raw_urdf, to, before, moving), TIME_LIMIT_S), owner)
    if outcome.ending is not Ending.RETURNED or not isinstance(outcome.value, list):
        logger.warning("%s: no loops of it: %s", refined.name, outcome.reason)
        return []
    names = [str(name) for name in outcome.value]
    write_whole(to / RECORD, (json.dumps({"key": key, "files": names, "moving": moving}) + "\n").encode())
    return names


def content_of(file: Path) -> bytes:
    """A file's content; empty where there is none."""
    try:
        return file.read_bytes()
    except OSError:
        return b""


def size_of(file: Path) -> int:
    """A file's size; -1 where there is none."""
    try:
        return file.stat().st_size
    except (OSError, ValueError):
        return -1


BEFORE, AFTER, THUMB = "before.webp", "after.webp", "thumb.webp"
PICTURES = (BEFORE, AFTER, THUMB)
LOOPS: Mapping[str, str] = {
    "sweep.webp": "every joint swept over its range",
    "drop.webp": "let fall 2 cm, tilted by 2°",
    "release.webp": "every joint pushed and let go, the base held",
}
"""Loops that may lie beside an object's page, and what they show."""
SIZE, AXES = "size.webp", "axes.webp"
"""Both at their true relative size, and the refined one's joints."""
THUMB_PX = 96
QUALITY, METHOD = 82, 2
"""WebP's quality and effort: at Pillow's own 4 a picture takes twice as long."""
TIME_LIMIT_S = 60.0
"""Time that one object's loops may take, or its picture as it came, s: one or two of a core that is free, 3 at most."""

logger = logging.getLogger(__name__)


def write_after(view: Path, folder: Path) -> bool:
    """Write ``after.webp`` and ``thumb.webp`` of a view that a run drew; returns whether there is one."""
    try:
        with Image.open(view) as image:
            picture = image.convert("RGB")
    except (OSError, ValueError, Image.DecompressionBombError):
        return False
    picture.save(folder / AFTER, quality=QUALITY, method=METHOD)
    picture.resize((THUMB_PX, THUMB_PX), Image.Resampling.LANCZOS).save(folder / THUMB, quality=QUALITY)
    return True


def write_before(before: Before, log: Path) -> bool:
    """Draw an asset as it came, every joint at zero, in a child process that may crash or hang: whether that went
    well. What went wrong is a line in the log."""
    start = time.monotonic()
    outcome = in_child(Work(draw_before, (before,), TIME_LIMIT_S), log_path=log)
    if outcome.ending is not Ending.RETURNED:
        logger.warning("no picture of %s as it came: %s", before.raw, outcome.reason)
    logger.debug("%s drawn in %.2f s", before.raw, time.monotonic() - start)
    return outcome.ending is Ending.RETURNED


def write_pictures(
    refined: Path | str, raw: Path, reach: AllowedFolders, folder: Path, log: Path, owner: str, moving: bool
) -> None:
    """Write the picture of an object as it came, where its files are here, and the size picture of the refined one, and
    loops where it is to be shown ``moving``, into ``folder``, where those there are of another. ``refined`` is its
    folder, or the URL of one, which is fetched. The object as it came is in the loops where its files name none
    outside. What goes wrong is a line in the log. ``stop_children(owner)`` ends it. Raises StoreError."""
    before = Before(raw, reach, folder / BEFORE, QUALITY, METHOD) if raw.exists() else None
    with tempfile.TemporaryDirectory(prefix="asset2sim-report-") as place:
        if isinstance(refined, str):
            here = Path(place, refined.rpartition("/")[2])
            files = {f"{refined}/{name}": here / name for name in list_objects(refined)}
            for file in files.values():
                file.parent.mkdir(parents=True, exist_ok=True)
            fetch_objects(files)
            refined = here
        urdf = raw_file(raw, reach)
        current = is_current(refined, urdf, folder, moving)
        if urdf is None or not current:
            (folder / BEFORE).unlink(missing_ok=True)
        if (refined / "overlay.json").is_file() and not current:
            # One process for all: it reads the meshes once.
            write_loops(refined, urdf, folder, owner, before, moving)
    if before is not None and not before.to.is_file():
        write_before(before, log)


def raw_file(raw: Path, reach: AllowedFolders) -> Path | None:
    """The file of an asset as it came; None where it is not here, or names files outside that are out of reach."""
    try:
        file = find_source(raw)
        text = file.read_text(encoding="utf-8", errors="replace")
    except (AssetError, OSError):
        return None
    # Links are followed.
    inside = not outer_references(text) and all(reach.allows(file.parent / name) for name in REFERENCE.findall(text))
    return file if inside or reach.anywhere else None
