"""The pictures of an object's page: the refined object as its run drew it, and the same object as it came."""

import logging
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

from PIL import Image

from asset2sim.assets.urdf.references import AllowedFolders, outer_references
from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work, in_child
from asset2sim.intake.locate import find_source
from asset2sim.report.loops.make import Before, draw_before
from asset2sim.report.loops.write import REFERENCE, is_current, write_loops
from asset2sim.storage.objects import fetch_objects, list_objects
from schemas.errors import AssetError

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
"""Time in which an object as it came is drawn, s: the largest real ones take 3."""

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
        if (refined / "overlay.json").is_file() and not is_current(refined, urdf, folder, moving):
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
