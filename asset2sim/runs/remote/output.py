"""An output behind a URL: the run works in a local folder, and what it makes is sent.

The store is the truth. A run begins by making its local folder what the store has, so it makes no difference whether
the folder is there from yesterday, is another machine's, or was left by a killed run; a folder that is there only saves
the journey. Stores switch one object at a time, not a folder, so the order is what protects readers:

1. during the run, each finished asset: its folder ``assets/<id>``, its logs, and then its record (``.cache/records``);
2. ``history/month=…/<run>.parquet``, then every table but ``runs``, all at once;
3. ``catalog/runs.parquet``: from here on the run counts;
4. a month's merged history, and then the removal of what was merged into it;
5. reports, ``.cache/files.db``, and the removal of the records that the tables now hold.

Whoever reads the objects themselves between 2 and 3 (a second or so) may see an asset's new row beside another table's
old one, and rows whose run is not in ``runs`` yet; between 4's two halves, a month's rows twice. Our own commands wait
for the end of it (``catalog.read_remote``). A run that is killed there leaves it so until the next run, which starts
from the records and finishes.
"""

import shutil
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from asset2sim.catalog.compact import MERGED, compact_history
from asset2sim.catalog.read_remote import mend_history
from asset2sim.catalog.storage.cache import working_folder
from asset2sim.catalog.storage.lock import lock_output
from asset2sim.catalog.storage.lock_url import lock_url
from asset2sim.catalog.storage.mirror import COMING, fetch, local_names, look, pull, push
from asset2sim.catalog.storage.objects import (
    StoreError,
    list_objects,
    object_info,
    remove_objects,
    send_objects,
    usage_error,
)
from asset2sim.catalog.switch import CATALOG, OLD, READY, STAGING
from asset2sim.runs.plan.plan import Plan
from asset2sim.runs.plan.records import FOLDER as RECORDS
from asset2sim.runs.plan.records import read_record
from asset2sim.runs.plan.state import FILE as STATE
from schemas.errors import UsageError
from schemas.location import is_url

TABLES = f"{CATALOG}/"
RUNS = f"{CATALOG}/runs.parquet"
HISTORY = "history/"
REPORTS = "reports/"
HELD = ".held"
"""File in the local folder that says which lock in the store is, or was, its run's."""
SHARED = (TABLES, HISTORY, REPORTS, f"{RECORDS}/", STATE)
"""What a run must know of earlier ones. Refined folders and logs are only sent; caches, budgets and MLflow's store stay
on the machine."""


@dataclass(frozen=True)
class Output:
    """An output that this process holds: ``place`` as the user named it, ``folder`` where the run works, and ``check``,
    which raises LostLockError where another run has taken the place over."""

    place: Path | str
    folder: Path
    check: Callable[[], None] = lambda: None

    @property
    def url(self) -> str | None:
        """The URL that ``folder`` mirrors, if it does."""
        return self.place if is_url(self.place) else None


@contextmanager
def open_output(out: Path | str) -> Iterator[Output]:
    """Hold OUT, and have its state in the local folder. Raises UsageError where another run holds it."""
    folder = working_folder(out)
    if not is_url(out):
        with lock_output(folder):
            yield Output(out, folder)
        return
    with _lock_folder(out, folder), lock_url(out, folder / HELD) as check:
        for left in (STAGING, READY, OLD, *(path.name for path in folder.glob(f"{COMING}*"))):
            shutil.rmtree(folder / left, ignore_errors=True)
        pull(out, folder, SHARED)
        mend_history(folder)
        yield Output(out, folder, check)


@contextmanager
def _lock_folder(out: str, folder: Path) -> Iterator[None]:
    with ExitStack() as held:
        try:
            held.enter_context(lock_output(folder))
        except UsageError as error:
            raise UsageError(str(error).replace(str(folder), out)) from error
        yield


def check_store(out: str) -> None:
    """Raise UsageError where a URL's store cannot be read: no such bucket, no access, nobody there."""
    try:
        list_objects(f"{out}/{CATALOG}")
    except StoreError as error:
        raise usage_error(error) from error


def folders_there(output: Output, *, views: bool) -> frozenset[str] | None:
    """The ids of the assets whose refined folder, with pictures if ``views``, lies in the store; None for a folder of
    this machine, where whoever wants to know looks."""
    if output.url is None:
        return None
    names = (name.split("/") for name in list_objects(f"{output.url}/assets"))
    return frozenset(parts[0] for parts in names if len(parts) > 1 and (not views or parts[1] == "views"))


def send_plan(output: Output, plan: Plan) -> None:
    """What is about to be refined is nobody's any more: the next run must know it even if this one is killed."""
    if output.url is not None and plan.todo:
        output.check()
        push(output.url, output.folder, [STATE])


def send_tables(output: Output, now: datetime) -> None:
    """Steps 2 to 4: the run's tables and history. Call it with the history not compacted yet."""
    url, folder = output.url, output.folder
    if url is None:
        return
    output.check()
    history, tables = local_names(folder, [HISTORY]), local_names(folder, [TABLES])
    push(url, folder, [name for name in history if not name.endswith(f"/{MERGED}")])
    push(url, folder, [name for name in tables if name != RUNS])
    push(url, folder, [RUNS])
    compact_history(folder, now)
    history = local_names(folder, [HISTORY])
    push(url, folder, history)
    _remove_gone(url, folder, [HISTORY])


def send_rest(output: Output) -> None:
    """Step 5."""
    url, folder = output.url, output.folder
    if url is None:
        return
    output.check()
    push(url, folder, local_names(folder, [REPORTS, STATE]))
    _remove_gone(url, folder, [f"{RECORDS}/"])


def _remove_gone(url: str, folder: Path, parts: list[str]) -> None:
    here = set(local_names(folder, parts))
    remove_objects([f"{url}/{name}" for name in look(url, parts) if name not in here])


def send_record(out: Path | str, content_hash: str) -> None:
    """Send a record that was written to the working folder: from here on the asset counts as finished."""
    if is_url(out):
        name = _record_name(content_hash)
        send_objects({f"{out}/{name}": working_folder(out) / name})


def fetch_record(out: Path | str, content_hash: str, run_id: str, attempt: int) -> None:
    """Have the record in the working folder that a worker, maybe on another machine, has sent in this run, at this
    attempt or a later one; what is not there is not fetched."""
    if not is_url(out):
        return
    folder, name = working_folder(out), _record_name(content_hash)
    here = read_record(folder, content_hash)
    if here is not None and here.run_id == run_id and here.attempt >= attempt:
        return
    stored = object_info(f"{out}/{name}")
    if stored is not None:
        fetch(out, folder, {name: stored})


def _record_name(content_hash: str) -> str:
    return f"{RECORDS}/{content_hash}.json"
