"""Setting aside what an earlier run refined behind a URL, where a later one failed: ``plan.set_aside`` for a store."""

from asset2sim.runs.plan.set_aside import FOLDER, Stamp, with_finding
from asset2sim.runs.remote.output import digest_of
from asset2sim.storage.objects import copy_objects, list_objects, remove_objects
from schemas.asset import AssetRecord
from schemas.vocabulary import Status


def set_aside_stored(url: str, record: AssetRecord, before: Stamp | str | None) -> AssetRecord:
    """Move the refined folder of a failed asset that is as it was ``before`` the run (its digest) out of ``assets``,
    and remove what was set aside of an asset that passes and had none. Returns the record, with a finding where the
    folder was moved. Raises StoreError."""
    asset_id = record.ref.asset_id
    folder, place = f"{url}/assets/{asset_id}", f"{url}/{FOLDER}/{asset_id}"
    if record.status is Status.OK:
        if before is None:
            remove_objects([f"{place}/{name}" for name in list_objects(place)])
        return record
    files = list_objects(folder) if before is not None else {}
    if not files or digest_of(files) != before:
        return record
    remove_objects([f"{place}/{name}" for name in list_objects(place)])
    copy_objects({f"{folder}/{name}": f"{place}/{name}" for name in files})
    remove_objects([f"{folder}/{name}" for name in files])
    return with_finding(record)
