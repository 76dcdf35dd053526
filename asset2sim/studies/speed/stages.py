"""Where a run's time goes: the stages of its assets, and what the run does around them."""

import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from asset2sim.catalog.read import read_table
from asset2sim.studies.speed.measured import FlowTimes
from schemas.vocabulary import Stage

COLUMN = "seconds_"
REFINE = "refine-assets"
"""The Prefect task within which all assets are refined."""


@dataclass(frozen=True)
class Part:
    """One line of the table: total seconds, their share of the flow's time (None outside the flow), and the median of
    an asset (None for parts that are not of single assets)."""

    name: str
    seconds: float
    share: float | None
    median_s: float | None = None


def stage_seconds(out: Path) -> dict[str, tuple[float, float]]:
    """Stage → (seconds over all assets of OUT's table, the median over the assets that reached it)."""
    assets = read_table(out, "assets")
    found = {}
    for stage in Stage:
        seconds = [float(value) for value in assets[f"{COLUMN}{stage.value}"].dropna()]
        if seconds:
            found[stage.value] = (sum(seconds), statistics.median(seconds))
    return found


def parts(times: FlowTimes, stages: Mapping[str, tuple[float, float]]) -> list[Part]:
    """The parts of a run with one worker: they add up to its wall time.

    The time of Dask, processes and model calls is that of the refining task less that of the stages.
    """
    whole = times.flow_s

    def part(name: str, seconds: float, median: float | None = None) -> Part:
        return Part(name, seconds, seconds / whole if whole > 0.0 else None, median)

    lines = [part(f"asset: {name}", seconds, median) for name, (seconds, median) in stages.items()]
    staged = sum(seconds for seconds, _ in stages.values())
    lines.append(part("asset: process, Dask, waiting", times.tasks_s.get(REFINE, staged) - staged))
    lines += [part(f"run: {name}", seconds) for name, seconds in times.tasks_s.items() if name != REFINE]
    lines.append(part("run: Prefect around its tasks", whole - sum(times.tasks_s.values())))
    return [*lines, Part("start-up, before the run", times.startup_s, None)]
