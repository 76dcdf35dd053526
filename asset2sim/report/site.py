"""Writing the report: ``OUT/report/``, of which only the pages of what changed are made anew."""

import hashlib
import json
import logging
import shutil
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from glob import escape
from pathlib import Path

from markupsafe import Markup

from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.catalog.index import ASSETS_FOLDER, local_files
from asset2sim.catalog.read import FrameRow, rows
from asset2sim.catalog.read_remote import PARTS, repair_history
from asset2sim.experiments.isolation.supervise import each_in_threads
from asset2sim.intake.dataset import root_of
from asset2sim.report.index_page import index_page
from asset2sim.report.object_page import Beside, object_page
from asset2sim.report.page_files import FOLDER, render, source, write_text
from asset2sim.report.pictures import (
    AFTER,
    AXES,
    BEFORE,
    LOOPS,
    PICTURES,
    RECORD,
    SIZE,
    THUMB,
    write_after,
    write_pictures,
)
from asset2sim.report.snapshot import Snapshot, exchanges_of, newest_rows, read_snapshot, rows_of
from asset2sim.storage.lock import lock_output
from asset2sim.storage.mirror import pull, push
from asset2sim.storage.objects import (
    StoreError,
    list_objects,
    local_copy_path,
    remove_objects,
    store_usage_error,
    working_folder,
)
from schemas.inputs import InputSettings
from schemas.location import Location
from schemas.table import ASSET_KEY

OBJECTS, INDEX = "objects", "index.html"
STATE = "pages.json"
"""Asset id → what its pictures and its page were made of."""
STYLE, SCRIPT = "report.css", "index.js"
VIEW = "views/perspective.png"
AT_ONCE = 200
"""Objects whose rows are in memory at once."""
FURTHER = "+"
"""Ending of the key of pictures among which is the object as it came; twice where there are loops, too."""

MOTIONS = "motions"
"""Folder of recorded interactions, relative to OUT."""
Near = tuple[str | None, str | None]
"""The ids of the objects before and after one, by name."""

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Site:
    """A report: its index, and how many pages of objects were made anew and are there in all."""

    index: Path
    written: int
    pages: int


def write_report_of(out: Path | str, *, workers: int = 1, anew: bool = False) -> Site:
    """Write the report of OUT, a folder or a URL, into it. Raises UsageError without a catalog or store."""
    place = Location(out)
    if not place.is_url:
        return write_site(place.folder, workers=workers, anew=anew)
    # The folder in which runs of this machine work: there the answers of its models are.
    folder = working_folder(place)
    try:
        with lock_output(folder, shown=place):
            pull(place, folder, PARTS)
            repair_history(folder)
            return write_site(folder, place, workers=workers, anew=anew)
    except StoreError as error:
        raise store_usage_error(error) from error


def write_site(
    out: Path, url: str | None = None, *, workers: int = 1, before: bool = True, loops: bool = True, anew: bool = False
) -> Site:
    """Write the report of OUT; ``out`` is the folder of this machine with its tables, ``url`` the URL that this
    mirrors, if it does. ``before`` draws objects as they came, where their files are here, and ``loops``
    then all of them moving, else what failed; ``anew`` makes every page
    anew. Raises UsageError where there is no catalog, OSError and StoreError where files cannot be written."""
    found = read_snapshot(out)
    folder = out / FOLDER
    # A run and a command, or two commands, may write the same report.
    with lock_output(folder, wait=True):
        if url is not None:
            pull(url, out, (f"{FOLDER}/{STATE}",))
        state = {} if anew else _read_state(folder)
        assets = newest_rows(found)
        drawn = _draw(found, assets, out, url, state, workers, before, loops)
        ids = sorted(assets)
        near = dict(zip(ids, zip([None, *ids[:-1]], [*ids[1:], None], strict=True), strict=True))
        pages = {name: _page_key(row, None if url else folder, near[name]) for name, row in assets.items()}
        changed = [name for name, key in pages.items() if state.get(name, ["", ""])[1] != key]
        for first in range(0, len(changed), AT_ONCE):
            _write_pages({name: assets[name] for name in changed[first : first + AT_ONCE]}, near, out, url)
        for gone in state.keys() - assets.keys():
            shutil.rmtree(_object_folder(folder, gone), ignore_errors=True)
        # Behind a URL, another machine may have drawn it.
        here = {
            name
            for name in assets
            if _object_folder(folder, name).joinpath(THUMB).is_file() or (url and state.get(name, [""])[-1] == "thumb")
        }
        # The index holds all that it needs but pictures: it is sent alone, too.
        whole = {"style": Markup(source(STYLE)), "script": Markup(source(SCRIPT))}
        write_text(folder / INDEX, render("index.html.jinja", index_page(found, here) | whole, ""))
        write_text(folder / STYLE, source(STYLE))
        thumbs = {name: "thumb" if name in here else "" for name in assets}
        write_text(folder / STATE, json.dumps({name: [drawn[name], pages[name], thumbs[name]] for name in assets}))
        if url is not None:
            _send(url, out, changed, state.keys() - assets.keys())
    return Site(folder / INDEX, len(changed), len(assets))


def _draw(
    found: Snapshot,
    assets: Mapping[str, FrameRow],
    out: Path,
    url: str | None,
    state: Mapping[str, Sequence[str]],
    workers: int,
    before: bool,
    loops: bool,
) -> dict[str, str]:
    """Draw the pictures of what changed; asset id → what its pictures are made of now."""
    moving = {name: before and (loops or row["status"] != "ok") for name, row in assets.items()}
    keys = {
        name: _digest(_identity(row), _stamp(None if url else out / "assets" / name / VIEW))
        + FURTHER * (before + moving[name])
        for name, row in assets.items()
    }
    had = {name: state[name][0] for name in assets if name in state}
    # A run with fewer pictures leaves those that there are.
    kept = {name: had[name] for name, key in keys.items() if had.get(name, "").startswith(key)}
    # What takes longest comes first, so that no worker has it left at the end.
    todo = sorted((name for name in assets if name not in kept), key=lambda name: -assets[name]["seconds_total"])
    reaches = {row["run_id"]: allowed_folders_of_run(row) for row in rows(found.tables["runs"])}

    def draw(name: str) -> None:
        asset, folder = assets[name], _object_folder(out / FOLDER, name)
        folder.mkdir(parents=True, exist_ok=True)
        view = out / "assets" / name / VIEW
        if url is not None and asset["refined_path"]:
            pull(url, out, (f"assets/{name}/{VIEW}",))
        seen = write_after(view, folder)
        raw = _here(asset["source_path"])
        if not before or not seen:
            (folder / BEFORE).unlink(missing_ok=True)
        else:
            refined = out / "assets" / name if url is None else f"{url}/assets/{name}"
            log = out / "logs" / f"{name}.report.log"
            write_pictures(refined, raw, reaches[asset["run_id"]], folder, log, str(out), moving[name])

    each_in_threads(draw, todo, str(out), max(1, workers))
    return keys | kept


def allowed_folders_of_run(run: FrameRow) -> AllowedFolders:
    """Where the files of a run's assets may lie: below its dataset, and as its settings say."""
    try:
        inputs = InputSettings.model_validate(json.loads(run["settings_json"])["inputs"])
    except (KeyError, TypeError, ValueError):
        inputs = InputSettings()
    packages = {name: Path(place).resolve() for name, place in inputs.package_folders.items()}
    return AllowedFolders(
        (root_of(Location(_here(run["dataset"]))),), packages, inputs.allow_outside, macro=inputs.macro
    )


def _here(place: str) -> Path:
    """A folder of a dataset on this machine: the copy that runs made, where it is a URL's."""
    found = Location(place)
    return local_copy_path(found) if found.is_url else found.folder


def _page_key(asset: FrameRow, folder: Path | None, near: Near) -> str:
    """Key of an object's page, the pictures that are there among it, and its neighbours; behind a URL pictures may be
    on another machine, and do not count."""
    place = folder and _object_folder(folder, asset["asset_id"])
    shown = [name for name in (*PICTURES, *LOOPS, SIZE, AXES) if place and place.joinpath(name).is_file()]
    films = films_of(folder.parent, asset["asset_id"]) if folder else []
    return _digest(_identity(asset), _code(), *map(str, near), *shown, *films)


def films_of(out: Path, asset_id: str) -> list[str]:
    """Recorded interactions with an object that were filmed (``asset2sim record-motion``), relative to OUT."""
    return sorted(path.relative_to(out).as_posix() for path in out.glob(f"{MOTIONS}/{escape(asset_id)}/*/motion.mp4"))


def _identity(asset: FrameRow) -> str:
    return "\n".join(str(asset[name]) for name in (*ASSET_KEY, "run_id", "content_hash"))


def _stamp(file: Path | None) -> str:
    try:
        return "" if file is None else str(file.stat().st_mtime_ns)
    except OSError:
        return ""


@cache
def _code() -> str:
    """Digest of all that decides what a page looks like: another version makes the pages anew."""
    sources = sorted(path for path in Path(__file__).parent.rglob("*") if path.suffix in (".py", ".jinja"))
    return _digest(*(path.read_text(encoding="utf-8") for path in sources))


def _digest(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode("utf-8", "replace")).hexdigest()[:16]


def _write_pages(assets: Mapping[str, FrameRow], near: Mapping[str, Near], out: Path, url: str | None) -> None:
    """Write the pages of these assets; ``out`` is the folder in which the answers are kept too."""
    own = rows_of(out, list(assets))
    systems: set[str] = set()
    for name, shown in assets.items():
        folder = _object_folder(out / FOLDER, name)
        folder.mkdir(parents=True, exist_ok=True)
        mine = {table: [row for row in of.get(name, ()) if _same(row, shown)] for table, of in own.items()}
        if not mine["assets"]:  # a run that has published since has it by another method
            continue
        asset = mine["assets"][0]
        others = [row for row in own["assets"].get(name, ()) if not _same(row, asset)]
        calls = exchanges_of(out, mine["model_calls"])
        systems |= {call.question.system for call in calls if call.question is not None}
        files = {path.name for path in folder.iterdir()}
        if url is not None and AFTER not in files:
            # Drawn by another machine.
            files |= set(list_objects(f"{url}/{FOLDER}/{OBJECTS}/{name}"))
        refined = f"{ASSETS_FOLDER}/{name}"
        loadable = [f"{refined}/{file}" for file in local_files(out / refined)] if url is None else []
        films = films_of(out, name) if url is None else []
        beside = Beside(files, *near[name], loadable, url or str(out), films)
        values = object_page(asset, mine, others, beside, calls)
        write_text(folder / INDEX, render("object.html.jinja", values, "../../"))
    _copy_systems(out, systems)


def _copy_systems(out: Path, names: Collection[str]) -> None:
    """Copy the questions' system parts, which many objects share, into the report."""
    from asset2sim.models.gateway.questions import FOLDER as QUESTIONS

    for name in sorted(names):
        source, place = out / QUESTIONS / f"{name}.txt", out / FOLDER / "prompts" / f"{name}.txt"
        if source.is_file() and not place.is_file():
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, place)


def _same(row: FrameRow, asset: FrameRow) -> bool:
    return all(row[name] == asset[name] for name in ASSET_KEY)


def _object_folder(folder: Path, asset_id: str) -> Path:
    return folder / OBJECTS / asset_id


def _read_state(folder: Path) -> dict[str, list[str]]:
    try:
        state: dict[str, list[str]] = json.loads((folder / STATE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return state


def _send(url: str, out: Path, changed: Sequence[str], gone: Collection[str]) -> None:
    """Upload what changed of the report, its index last."""
    folder = out / FOLDER
    names = [path for asset in changed for path in sorted(_object_folder(folder, asset).iterdir())]
    names += sorted((folder / "prompts").glob("*.txt"))
    names += [folder / name for name in (STYLE, INDEX, STATE)]
    push(url, out, [path.relative_to(out).as_posix() for path in names])
    remove_objects(
        [
            f"{url}/{FOLDER}/{OBJECTS}/{name}/{file}"
            for name in gone
            for file in (INDEX, *PICTURES, *LOOPS, SIZE, AXES, RECORD)
        ]
    )
