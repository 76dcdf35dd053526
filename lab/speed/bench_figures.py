"""Figures of the bench, computed from what its runs used and from their tables, and compared with their targets."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean

import pandas as pd

from asset2sim.catalog.text import NOTHING, markdown_table
from schemas.base import Frozen
from schemas.vocabulary import Stage

MAX_PROCESSOR_S, MAX_SLOWEST_S = 2.3, 15.0
"""Processor time of an object without caches in three engines, report and driver included, and of the slowest, s."""
MIN_EFFICIENCY, MAX_NIGHT_MIN = 0.9, 60.0
"""Speed of two workers over twice that of one, and the longest night over PartNet-Mobility, min."""
MAX_UNCHANGED_S = 5.0
"""Wall time of a night in which no asset of a dataset of 150 changed, after start-up, s."""
MET = {True: "yes", False: "**no**", None: NOTHING}

with Path(__file__).with_name("partnet_mobility.csv").open(encoding="utf-8", newline="") as file:
    OBJECTS = {row["category"]: int(row["objects"]) for row in csv.DictReader(file)}
"""Objects of each category in PartNet-Mobility."""
NIGHT = sum(OBJECTS.values())


class Used(Frozen):
    """Processor time of a run with all its processes, s, and the most memory of its driver and of any other, MB."""

    processor_s: float
    driver_mb: float
    largest_mb: float


@dataclass(frozen=True)
class BenchRun:
    """One run: what it used, its row of the table ``runs``, and the rows of the assets that it refined."""

    workers: int
    used: Used
    row: "pd.Series[float]"
    assets: pd.DataFrame

    @property
    def own_s(self) -> "pd.Series[float]":
        """Processor time of each of its objects, s."""
        return self.assets["processor_s_total"].dropna().astype(float)


@dataclass(frozen=True)
class FigureLine:
    """One line of the bench's table. ``met`` is None where there is no target."""

    name: str
    target: str
    measured: str
    met: bool | None = None


def efficiency(one: BenchRun, two: BenchRun) -> float:
    """Parallel efficiency: the speed-up of several workers over one, divided by their number; 1 is linear."""
    return float(one.row["seconds"] / two.row["seconds"] * one.workers / two.workers)


def beyond(alone: BenchRun, one: BenchRun) -> tuple[float, float]:
    """(processor time of a run whatever it refines, s; that of each object beside its own, s): two runs, of one object
    and of many, tell them apart."""
    few, many = len(alone.assets), len(one.assets)
    first, rest = (run.used.processor_s - float(run.own_s.sum()) for run in (alone, one))
    each = max(0.0, (rest - first) / (many - few)) if many > few else 0.0
    return first - each * few, each


def weighted_mean(measured: Mapping[str, Sequence[float]]) -> tuple[float, float]:
    """(mean over the dataset of a figure that was measured of some objects of each category, share of the dataset whose
    categories were measured); a category of which none was has the mean of all that were."""
    known = {category: mean(values) for category, values in measured.items() if values and category in OBJECTS}
    other = mean(value for values in measured.values() for value in values)
    whole = sum(count * known.get(category, other) for category, count in OBJECTS.items())
    return whole / NIGHT, sum(OBJECTS[category] for category in known) / NIGHT


def figures(alone: BenchRun, one: BenchRun, two: BenchRun, again: BenchRun) -> Iterator[FigureLine]:
    """Processor time an object, of the slowest, and of a night over PartNet-Mobility with its own mix of categories;
    the efficiency of two workers and their memory; and a run with nothing to do."""
    count, own, (startup, around) = len(one.assets), one.own_s, beyond(alone, one)
    whole, slowest, tenth = one.used.processor_s / count, own.max(), -(-len(own) // 10)
    said = (
        f"{whole:.2f} s, {own.sum() / count:.2f} s of it the objects' own; {startup:.1f} s for the run's start and end"
    )
    name = f"processor time an object, {count} cold, {one.row['ok']} ok, everything"
    yield FigureLine(name, f"≤ {MAX_PROCESSOR_S:g} s", said, whole <= MAX_PROCESSOR_S)
    said = f"{slowest:.1f} s; the slowest tenth takes {100.0 * own.nlargest(tenth).sum() / own.sum():.0f} %"
    yield FigureLine("… of the slowest object", f"≤ {MAX_SLOWEST_S:g} s", said, bool(slowest <= MAX_SLOWEST_S))
    mixed, covered = weighted_mean({str(kind): tuple(some) for kind, some in own.groupby(one.assets["category"])})
    minutes = (startup + (around + mixed) * NIGHT) / 2.0 / MIN_EFFICIENCY / 60.0
    said = f"{minutes:.0f} min; {around + mixed:.2f} s an object, {100.0 * covered:.0f} % of them of measured kinds"
    name = f"… of a night of PartNet-Mobility's {NIGHT:,}, two cores at an efficiency of {MIN_EFFICIENCY:g}"
    yield FigureLine(name, f"≤ {MAX_NIGHT_MIN:g} min", said, minutes <= MAX_NIGHT_MIN)
    both = efficiency(one, two)
    said = f"{both:.2f} ({one.row['seconds']:.1f} s and {two.row['seconds']:.1f} s of wall time)"
    yield FigureLine("efficiency of two workers", f"≥ {MIN_EFFICIENCY:g}", said, both >= MIN_EFFICIENCY)
    said = f"driver {two.used.driver_mb:.0f} MB, the largest other process {two.used.largest_mb:.0f} MB"
    yield FigureLine("memory with two workers", "", said)
    seconds, left = again.row["seconds"], again.row["assets"] - again.row["unchanged"]
    said = f"{seconds:.1f} s" + (f"; {left} were refined again" if left else "")
    met = bool(seconds <= MAX_UNCHANGED_S and not left)
    yield FigureLine(f"once more, nothing changed of {again.row['assets']}", f"≤ {MAX_UNCHANGED_S:g} s", said, met)


def stage_table(run: BenchRun) -> str:
    """Markdown: each stage's processor time over all objects of a run, its share, and its median."""
    rows, whole = [], float(run.own_s.sum())
    for stage in Stage:
        seconds = run.assets[f"processor_s_{stage.value}"].dropna().astype(float)
        if len(seconds):
            spent = float(seconds.sum())
            rows.append((stage.value, f"{spent:.2f}", f"{100.0 * spent / whole:.1f} %", f"{seconds.median():.3f}"))
    return markdown_table(("stage", "s in all", "of the objects' own", "s an object (median)"), rows, right=(1, 2, 3))


def bench_markdown(alone: BenchRun, one: BenchRun, two: BenchRun, again: BenchRun) -> str:
    """Markdown: the figures, and where the objects' own processor time goes."""
    lines = figures(alone, one, two, again)
    rows = [(line.name, line.target or NOTHING, line.measured, MET[line.met]) for line in lines]
    table = markdown_table(("figure", "target", "measured", "met"), rows)
    return f"{table}\n\nThe objects' own processor time by stage:\n\n{stage_table(one)}"
