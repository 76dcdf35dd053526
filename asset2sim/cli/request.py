"""What the user asks of ``asset2sim refine`` and ``asset2sim nightly``."""

from pydantic import Field, InstanceOf

from schemas.asset import FoundAssets
from schemas.base import Frozen
from schemas.location import Location
from schemas.settings import Settings


class RefineRequest(Frozen):
    """A dataset, what to take of it, where the result goes, and the settings.

    ``strict`` makes a run that holds a failed asset fail; ``now`` asks for one night at once instead of the schedule.
    ``found`` are the assets, once the request is checked.
    """

    data: Location
    out: Location
    subset: str | None = None
    asset_ids: tuple[str, ...] = ()
    limit: int | None = None
    settings: Settings = Settings()
    strict: bool = False
    now: bool = False
    found: InstanceOf[FoundAssets] | None = Field(default=None, exclude=True)
