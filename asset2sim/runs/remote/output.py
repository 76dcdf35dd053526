"""An output behind a URL: the run works in a local folder and uploads its results.

The store is authoritative. A run first makes its local folder equal to the store, so a folder that is out of date or
that a killed run left does no harm; it only saves downloads. Stores replace one object at a time, not a folder, so the
order of the uploads protects readers:

1. during the run, each finished asset: its folder ``assets/<id>``, its logs, and then its record (``.cache/records``);
2. ``history/month=…/<run>.parquet``, then every table but ``runs``, all at once;
3. ``catalog/runs.parquet``: from here on the run counts;
4. the removal of history that was too old to keep;
5. ``.cache/files.db``, and the removal of the records that the tables now hold.

Between 2 and 3 (about a second), a reader of the objects themselves may see an asset's new row beside another table's
old one, and rows whose run is not in ``runs`` yet. Our own commands wait for the end of it (``catalog.read_remote``). A
run that is killed there leaves it so until the next run, which starts from the records and finishes.
"""

import shutil
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from asset2sim.catalog.history import HISTORY_FOLDER
from asset2sim.catalog.own_files import EMPTY
from asset2sim.catalog.read_remote import repair_history
from asset2sim.catalog.switch import CATALOG, OLD, READY, STAGING
from asset2sim.runs.plan.plan import Plan
from asset2sim.runs.plan.records import RECORDS_FOLDER, read_record
from asset2sim.runs.plan.state import FILE as STATE
from asset2sim.storage.lock import lock_output, lock_url
from asset2sim.storage.mirror import INCOMING_PREFIX, fetch, local_names, look_below, pull, push
from asset2sim.storage.objects import (
    Stored,
    StoreError,
    digest_of,
    list_objects,
    object_info,
    reading_folder,
    remove_objects,
    send_objects,
    store_usage_error,
    working_folder,
)
from schemas.location import Location
from schemas.tables import REVIEWS
from schemas.tables import TABLES as CATALOG_TABLES

TABLES = f"{CATALOG}/"
RUNS = f"{CATALOG}/{CATALOG_TABLES['runs'].file}"
HISTORY = f"{HISTORY_FOLDER}/"
LOCK_TOKEN_FILE = ".held"
"""File in the local folder with the token of the lock that its last run took in the store."""
SHARED = (TABLES, HISTORY, f"{RECORDS_FOLDER}/", STATE)
"""State of earlier runs that is downloaded; folders and logs are only sent, caches and MLflow's store stay."""


@dataclass(frozen=True)
class Output:
    """An output locked by this process: ``place`` as the user named it, ``folder`` where the run works, and ``check``,
    which raises LostLockError where another run has taken the place over."""

    place: Location
    folder: Path
    check: Callable[[], None] = lambda: None

    @property
    def url(self) -> str | None:
        """The URL that ``folder`` mirrors, if it does."""
        return self.place if self.place.is_url else None


@contextmanager
def open_output(out: Path | str) -> Iterator[Output]:
    """Lock OUT, and download its state to the local folder. Raises UsageError where another run holds it."""
    place = Location(out)
    folder = working_folder(place)
    if not place.is_url:
        with lock_output(folder):
            yield Output(place, folder)
        return
    with lock_output(folder, shown=place), lock_url(place, folder / LOCK_TOKEN_FILE) as check:
        for left in (STAGING, READY, OLD, *(path.name for path in folder.glob(f"{INCOMING_PREFIX}*"))):
            shutil.rmtree(folder / left, ignore_errors=True)
        pull(place, folder, SHARED)
        repair_history(folder)
        yield Output(place, folder, check)


def check_store(out: str) -> None:
    """Raise UsageError where a URL's store cannot be read: no such bucket, no access, no answer."""
    try:
        list_objects(f"{out}/{CATALOG}")
    except StoreError as error:
        raise store_usage_error(error) from error


def view_output(url: str, *, views: bool) -> tuple[Path, dict[str, str]]:
    """A local copy of the state behind a URL, for who writes nothing there, and ``stored_ids`` of it."""
    folder = reading_folder(url)
    with lock_output(folder, wait=True):
        pull(url, folder, SHARED)
        repair_history(folder)
    return folder, stored_ids(url, views=views)


def stored_asset_ids(output: Output, *, views: bool) -> dict[str, str] | None:
    """``stored_ids`` of an output behind a URL; None for a local one, where the caller looks for the folders itself."""
    return None if output.url is None else stored_ids(output.url, views=views)


def stored_ids(url: str, *, views: bool) -> dict[str, str]:
    """Ids of the assets whose refined folder, with pictures if ``views``, is in the store, each with a digest of its
    files' names, sizes and versions."""
    folders: dict[str, dict[str, Stored]] = defaultdict(dict)
    for name, stored in list_objects(f"{url}/assets").items():
        asset_id, inside, inner = name.partition("/")
        if inside:
            folders[asset_id][inner] = stored
    return {
        asset_id: digest_of(files)
        for asset_id, files in folders.items()
        if not views or any(name.startswith("views/") for name in files)
    }


def send_plan(output: Output, plan: Plan) -> None:
    """Upload the state file without the folders about to be rewritten: if this run is killed, the next redoes them."""
    if output.url is not None and plan.todo:
        output.check()
        push(output.url, output.folder, [STATE])


def send_tables(output: Output) -> None:
    """Upload the run's tables and history (steps 2 to 4)."""
    url, folder = output.url, output.folder
    if url is None:
        return
    output.check()
    push(url, folder, local_names(folder, [HISTORY]))
    push(url, folder, [name for name in local_names(folder, [TABLES]) if name != RUNS])
    push(url, folder, [RUNS])
    _remove_gone(url, folder, [HISTORY])


def send_rest(output: Output) -> None:
    """Upload state and the file of reviews that has none, and remove records that the tables hold (step 5)."""
    url, folder = output.url, output.folder
    if url is None:
        return
    output.check()
    push(url, folder, local_names(folder, [STATE, f"{REVIEWS.name}/{EMPTY}"]))
    _remove_gone(url, folder, [f"{RECORDS_FOLDER}/"])


def _remove_gone(url: str, folder: Path, parts: list[str]) -> None:
    here = set(local_names(folder, parts))
    remove_objects([f"{url}/{name}" for name in look_below(url, parts) if name not in here])


def send_record(out: Path | str, content_hash: str) -> None:
    """Upload a record from the working folder: from here on the asset counts as finished."""
    if Location(out).is_url:
        name = _record_name(content_hash)
        send_objects({f"{out}/{name}": working_folder(out) / name})


def fetch_record(out: Path | str, content_hash: str, run_id: str, attempt: int) -> None:
    """Download the record that a worker uploaded in this run, at this attempt or a later one, to the working folder.
    A record that is there already, or is not in the store, is not downloaded."""
    if not Location(out).is_url:
        return
    folder, name = working_folder(out), _record_name(content_hash)
    here = read_record(folder, content_hash)
    if here is not None and here.run_id == run_id and here.attempt >= attempt:
        return
    stored = object_info(f"{out}/{name}")
    if stored is not None:
        fetch(str(out), folder, {name: stored})


def _record_name(content_hash: str) -> str:
    return f"{RECORDS_FOLDER}/{content_hash}.json"
