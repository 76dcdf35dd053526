"""What a Dask worker answers with: that an asset is done. Its record goes through the output folder."""

from dataclasses import dataclass

from schemas.asset import AssetRecord
from schemas.vocabulary import Status


@dataclass(frozen=True)
class Done:
    """An asset that is done. ``died`` says how its process died, and is empty where it came back with a record.

    ``record`` is there only where the record could not be written to the output folder, so that it is not lost.
    """

    asset_id: str
    status: Status
    died: str = ""
    record: AssetRecord | None = None
