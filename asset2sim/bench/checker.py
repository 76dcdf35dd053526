"""How long the independent checker takes over refined objects, one after the other."""

from collections.abc import Callable, Sequence
from pathlib import Path

from asset2sim.bench.measured import CheckerTimes
from asset2sim.judge import check_object, find_simcheck, refined_objects
from schemas.errors import UsageError


def chosen(asset_ids: Sequence[str], count: int) -> tuple[str, ...]:
    """``count`` of a dataset's assets, evenly spaced in its order: of 150, every 7th makes 20."""
    step = max(1, len(asset_ids) // max(1, count))
    return tuple(asset_ids[::step][:count])


def time_checker(root: Path, out: Path, asset_ids: Sequence[str], tell: Callable[[str], None]) -> CheckerTimes:
    """Check each refined object of OUT with its root free, in the checker's two engines; ``tell`` hears of each.

    ``root`` is the checkout, beside whose environment the checker has one of its own. Where it is not installed the
    answer says so.
    """
    try:
        simcheck = find_simcheck(root)
        objects = refined_objects(out, asset_ids)
    except UsageError as error:
        return CheckerTimes(problem=str(error))
    seconds, unfinished = {}, []
    for asset_id, urdf in objects.items():
        report = check_object(simcheck, asset_id, urdf)
        seconds[asset_id] = report.seconds
        if report.problem:
            unfinished.append(asset_id)
        tell(f"simcheck {asset_id}: {report.seconds:.1f} s {report.problem}")
    return CheckerTimes(seconds=seconds, unfinished=tuple(unfinished))
