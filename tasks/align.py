"""How well each asset is what was asked for."""

from dataclasses import replace

from prefect import task
from prefect.cache_policies import NO_CACHE

from asset2sim.checks.alignment.align import align_all
from asset2sim.checks.alignment.reference import FILE, Reference, read_references
from asset2sim.runs.remote.fetch_asset import local_file
from asset2sim.runs.spread.refine_all import Refined
from schemas.location import Location, below


@task(name="find-references", cache_policy=NO_CACHE, persist_result=False)
def find_references(data: Location) -> dict[str, Reference]:
    """The experts' choices, as far as the dataset has any."""
    return read_references(local_file(below(data, FILE)))


@task(name="align", cache_policy=NO_CACHE, persist_result=False)
def align(refined: Refined, references: dict[str, Reference]) -> Refined:
    """The records with their alignment; see ``asset2sim.checks.alignment.align.align``."""
    return replace(refined, records=align_all(refined.records, references))
