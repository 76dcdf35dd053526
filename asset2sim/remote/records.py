"""Records of finished assets, by way of the store: whoever refines sends, whoever runs fetches."""

from pathlib import Path

from asset2sim.catalog.storage.cache import working_folder
from asset2sim.catalog.storage.mirror import fetch
from asset2sim.catalog.storage.objects import object_info, send_objects
from asset2sim.incremental.records import FOLDER as RECORDS
from asset2sim.incremental.records import read_record
from schemas.location import is_url


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
