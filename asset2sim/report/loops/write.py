"""Loops of an object, made in a killable child, and the key by which they are made anew only for another object."""

import hashlib
import json
import logging
import re
from pathlib import Path

from asset2sim.assets.checksums import FILE
from asset2sim.assets.folder import URDF_NAME
from asset2sim.engines.registry import engine_version
from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work, in_child
from asset2sim.report.loops.make import Before, make_loops
from asset2sim.storage.regular_files import write_whole
from schemas.vocabulary import Engine

RECORD = "loops.json"
"""The file beside the loops that says of what they are."""
VERSION = 5
"""Raised when loops are drawn otherwise, so that all are made anew."""
LIMIT_S = 60.0
"""Wall time that one object's loops may take, s: they take one or two of a core that is free."""
SHOWN = re.compile(r"  (mobility\.urdf|overlay\.json|(?!views/).*/.*)\n")
"""The lines of a refined folder's checksums that count: not what was measured of it, nor other forms and pictures."""
REFERENCE = re.compile(r"filename\s*=\s*[\"']([^\"']+)[\"']")

log = logging.getLogger(__name__)


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
    """Whether the pictures in the folder ``to`` are of the object as it is now, with loops where it is to be shown
    ``moving``."""
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
    outcome = in_child(Work(make_loops, (refined, raw_urdf, to, before, moving), LIMIT_S), owner)
    if outcome.ending is not Ending.RETURNED or not isinstance(outcome.value, list):
        log.warning("%s: no loops of it: %s", refined.name, outcome.reason)
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
