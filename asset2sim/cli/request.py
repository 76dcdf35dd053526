"""What the user asks of ``asset2sim refine``."""

from pathlib import Path

from schemas.base import Frozen
from schemas.settings import Settings


class RefineRequest(Frozen):
    """A dataset, what to take of it, where the result goes, and the settings."""

    data: Path
    out: Path
    subset: str | None = None
    asset_ids: tuple[str, ...] = ()
    limit: int | None = None
    settings: Settings = Settings()
    strict: bool = False
