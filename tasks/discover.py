"""What there is to do, and whether it can be done as asked."""

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.runs.check_request import check_request
from schemas.asset import AssetRef
from schemas.location import Location
from schemas.settings import Settings


@task(name="discover", cache_policy=NO_CACHE, persist_result=False)
def discover(
    data: Location,
    out: Location,
    settings: Settings,
    subset: str | None,
    asset_ids: tuple[str, ...],
    limit: int | None,
) -> list[AssetRef]:
    """The assets to refine; see ``asset2sim.runs.check_request.check_request``."""
    return check_request(data, out, settings, subset, asset_ids, limit)
