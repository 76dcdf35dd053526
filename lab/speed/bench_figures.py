"""Figures of the acceptance, computed from the measured times and compared with their targets, and the shares of a
run's time: the stages of its assets, and what the run does around them."""

import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from asset2sim.catalog.read import read_table
from asset2sim.catalog.text import NOTHING, markdown_table
from lab.speed.dataset_mix import NIGHT, weighted_mean
from lab.speed.measured import BenchMeasurements, CheckerTimes, FlowTimes, LoopTimes, QueryTimes
from schemas.vocabulary import Stage

MIN_ASSETS_PER_MINUTE = 60.0
"""Assets a minute with two workers on two cores, at least."""
MIN_EFFICIENCY = 0.85
"""Rate with two workers over twice the rate with one, at least."""
MAX_OVERHEAD_SHARE = 0.10
"""Largest orchestration time of an asset, as a share of the plain loop's time."""
MAX_UNCHANGED_S = 5.0
"""Wall time of a night in which no asset of a dataset of 150 changed, after start-up, s."""
MAX_SYNTHETIC_S = 60.0
"""The same for 10,000 entries, s."""
MAX_MEMORY_GROWTH_MB = 100.0
"""Growth of the driver's peak memory from few synthetic entries to many that still counts as flat, MB."""
MAX_QUERY_S = 0.2
"""Time of the breakdown over 1,000,000 rows of history, s."""
MAX_CHECKER_RATIO = 1.0 / 3.0
"""Largest ratio of our time for refining and verifying to simcheck's time for checking alone."""
MAX_COLD_S, MAX_SLOWEST_S = 2.3, 15.0
"""Processor time of an object without caches in three engines, report and driver included, and of the slowest, s."""
MIN_COLD_EFFICIENCY, MAX_NIGHT_MIN = 0.9, 60.0
"""The efficiency of two workers on two cores, and the longest night over PartNet-Mobility, min."""
NOT_MEASURED = "not measured"
COLUMN = "seconds_"
REFINE = "refine-assets"
"""The Prefect task within which all assets are refined."""


@dataclass(frozen=True)
class FigureLine:
    """One line of the bench's table. ``met`` is None where there is no target, or nothing was measured."""

    name: str
    target: str
    measured: str
    met: bool | None = None


def rate(times: FlowTimes, *, startup: bool = False) -> float:
    """Assets a minute, without the start-up or with it."""
    seconds = times.flow_s + (times.startup_s if startup else 0.0)
    return 60.0 * times.assets / seconds if seconds > 0.0 else 0.0


def efficiency(one: FlowTimes, two: FlowTimes) -> float:
    """Parallel efficiency: the speed-up of several workers over one, divided by their number; 1 is linear."""
    return rate(two) / (two.workers / one.workers * rate(one))


def overhead(flow: FlowTimes, loop: LoopTimes) -> float:
    """Extra time of a run over the plain loop for the same assets, as a share of the loop's time."""
    return (flow.flow_s - loop.loop_s) / loop.loop_s


def memory_growth_mb(few: FlowTimes, many: FlowTimes) -> tuple[float, float]:
    """(MB that the driver's peak memory grew, MB for each 1000 entries more)."""
    grown = many.peak_memory_mb - few.peak_memory_mb
    return grown, 1000.0 * grown / (many.assets - few.assets)


def figures(found: BenchMeasurements) -> list[FigureLine]:
    """The table's lines, in the order of the acceptance."""
    return [
        *_cold(found),
        *_rates(found.one, found.two),
        *_overhead(found.one, found.loop),
        *_around(found.one, found.stages),
        *([_rerun(f"unchanged re-run of {found.again.assets}", found.again, MAX_UNCHANGED_S)] if found.again else []),
        *_synthetic(found.synthetic),
        *_growth(found.nights, "refined in one night"),
        *(_query(times) for times in found.queries),
        *_checker(found.both, found.checked),
    ]


def missed(lines: list[FigureLine]) -> list[str]:
    """The names of the figures that have a target and do not meet it, or were not measured."""
    return [line.name for line in lines if line.met is False or line.measured.startswith(NOT_MEASURED)]


def beyond(found: BenchMeasurements) -> tuple[float, float]:
    """(processor time of a cold run whatever it refines, s; that of each object beside its own, s): two runs, of one
    object and of many, tell them apart."""
    if found.cold is None:
        return 0.0, 0.0
    rest = found.cold.whole_cpu_s - sum(value for values in found.cold_assets_s.values() for value in values)
    if found.alone is None or found.cold.assets <= found.alone.assets:
        return 0.0, rest / found.cold.assets
    first = found.alone.whole_cpu_s - found.alone_s
    each = max(0.0, (rest - first) / (found.cold.assets - found.alone.assets))
    return first - each * found.alone.assets, each


def _cold(found: BenchMeasurements) -> Iterator[FigureLine]:
    """Processor time an object, of the slowest, and of a night over PartNet-Mobility with its
    own mix of categories; the efficiency of two workers, and their memory."""
    times, by_category = found.cold, found.cold_assets_s
    assets_s = sorted((value for values in by_category.values() for value in values), reverse=True)
    if times is None or not assets_s:
        return
    slowest, tenth, (startup, around) = max(assets_s), -(-len(assets_s) // 10), beyond(found)
    own, share = sum(assets_s) / times.assets, sum(assets_s[:tenth]) / max(sum(assets_s), 1e-9)
    whole = times.whole_cpu_s / times.assets
    said = f"{whole:.2f} s, {own:.2f} s of it the objects' own; {startup:.1f} s for the run's start and end"
    name = f"processor time an object, {times.assets} cold, {times.ok} ok, everything"
    yield FigureLine(name, f"≤ {MAX_COLD_S:g} s", said, whole <= MAX_COLD_S)
    said = f"{slowest:.1f} s; the slowest tenth takes {100.0 * share:.0f} %"
    yield FigureLine("… of the slowest object", f"≤ {MAX_SLOWEST_S:g} s", said, slowest <= MAX_SLOWEST_S)
    mixed, covered = weighted_mean(by_category)
    minutes = (startup + (around + mixed) * NIGHT) / 2.0 / MIN_COLD_EFFICIENCY / 60.0
    said = f"{minutes:.0f} min; {around + mixed:.2f} s an object, {100.0 * covered:.0f} % of them of measured kinds"
    name = f"… of a night of PartNet-Mobility's {NIGHT:,}, two cores at an efficiency of {MIN_COLD_EFFICIENCY:g}"
    yield FigureLine(name, f"≤ {MAX_NIGHT_MIN:g} min", said, minutes <= MAX_NIGHT_MIN)
    if found.cold_two is not None:
        both, bound = efficiency(times, found.cold_two), MIN_COLD_EFFICIENCY
        said = f"{both:.2f} ({times.flow_s:.1f} s and {found.cold_two.flow_s:.1f} s of wall time)"
        yield FigureLine("… efficiency of two workers, cold", f"≥ {bound:g}", said, both >= bound)
        driver, largest = found.cold_two.peak_memory_mb, found.cold_two.largest_mb
        said = f"driver {driver:.0f} MB, the largest other process {largest:.0f} MB"
        yield FigureLine("… memory with two workers, cold", "", said)


def _rates(one: FlowTimes | None, two: FlowTimes | None) -> Iterator[FigureLine]:
    for times, bound in ((one, None), (two, MIN_ASSETS_PER_MINUTE)):
        if times is None:
            continue
        workers = f"{times.workers} worker{'s' if times.workers > 1 else ''}"
        name = f"assets a minute, {times.assets} objects ({times.ok} ok), {workers}"
        said = f"{rate(times):.1f} ({times.flow_s:.1f} s)"
        yield FigureLine(name, f"≥ {bound:g}" if bound else "", said, rate(times) >= bound if bound else None)
        said = f"{rate(times, startup=True):.1f} ({times.startup_s:.1f} s of start-up)"
        yield FigureLine(f"the same with start-up, {workers}", "", said)
    if one is not None and two is not None:
        share = efficiency(one, two)
        yield FigureLine("parallel efficiency", f"≥ {MIN_EFFICIENCY:g}", f"{share:.2f}", share >= MIN_EFFICIENCY)


def _overhead(one: FlowTimes | None, loop: LoopTimes | None) -> Iterator[FigureLine]:
    if one is None or loop is None:
        return
    name, target = "orchestration overhead an asset, 1 worker over a plain loop", f"≤ {100.0 * MAX_OVERHEAD_SHARE:g} %"
    if loop.problem or loop.loop_s <= 0.0:
        where = f" at {loop.died_at}" if loop.died_at else ""
        yield FigureLine(name, target, f"{NOT_MEASURED}: the loop's process was lost{where}: {loop.problem}")
        return
    share = overhead(one, loop)
    each = 1000.0 * (one.flow_s - loop.loop_s) / one.assets
    said = f"{100.0 * share:.1f} % ({each:.0f} ms an asset; {one.flow_s:.1f} s over {loop.loop_s:.1f} s)"
    yield FigureLine(name, target, said, share <= MAX_OVERHEAD_SHARE)


def _around(one: FlowTimes | None, stages: Mapping[str, tuple[float, float]]) -> Iterator[FigureLine]:
    """Orchestration time alone; child processes, less warmed up than the loop's, lose the rest of the overhead."""
    within = sum(seconds for seconds, _ in stages.values())
    if one is not None and within > 0.0:
        said = f"{100.0 * (one.flow_s - within) / within:.1f} % ({one.flow_s:.1f} s over {within:.1f} s)"
        yield FigureLine("… Prefect, Dask, tables and starting processes, over the assets' own time", "–", said)


def _synthetic(runs: tuple[FlowTimes, ...]) -> Iterator[FigureLine]:
    if not runs:
        return
    yield _rerun(f"unchanged re-run of {runs[-1].assets:,} synthetic entries", runs[-1], MAX_SYNTHETIC_S)
    yield from _growth(runs, "entries")


def _growth(runs: tuple[FlowTimes, ...], what: str) -> Iterator[FigureLine]:
    if runs and runs[-1].assets > runs[0].assets:
        few, many = runs[0], runs[-1]
        grown, each = memory_growth_mb(few, many)
        name = f"growth of the driver's peak memory from {few.assets:,} to {many.assets:,} {what}"
        said = f"{grown:.0f} MB ({few.peak_memory_mb:.0f} to {many.peak_memory_mb:.0f} MB; {each:.1f} MB per 1000)"
        yield FigureLine(name, f"≤ {MAX_MEMORY_GROWTH_MB:g} MB", said, grown <= MAX_MEMORY_GROWTH_MB)


def _rerun(name: str, times: FlowTimes, bound: float) -> FigureLine:
    said = f"{times.flow_s:.1f} s ({times.startup_s:.1f} s of start-up, {times.cpu_s:.1f} s of processor time in all)"
    left = times.assets - times.unchanged
    if left:
        said += f"; {left} were refined again"
    return FigureLine(name, f"≤ {bound:g} s", said, times.flow_s <= bound and not left)


def _query(times: QueryTimes) -> FigureLine:
    median = statistics.median(times.seconds[1:] or times.seconds)
    name = f"breakdown by {times.what.replace('_', ' ')} over {times.rows:,} rows of history in {times.files} files"
    said = f"{median:.3f} s (median; the first {times.seconds[0]:.3f} s)"
    return FigureLine(name, f"≤ {MAX_QUERY_S:g} s", said, median <= MAX_QUERY_S)


def _checker(both: FlowTimes | None, checked: CheckerTimes | None) -> Iterator[FigureLine]:
    if both is None or checked is None:
        return
    name, target = "refining and verifying over simcheck's checking alone, one core", f"≤ {MAX_CHECKER_RATIO:.2f}"
    if checked.problem or not checked.seconds:
        yield FigureLine(name, target, f"{NOT_MEASURED}: {checked.problem or 'no object was checked'}")
        return
    ours, theirs = both.flow_s / both.assets, sum(checked.seconds.values()) / len(checked.seconds)
    said = f"{ours / theirs:.2f} ({ours:.1f} s an object over {theirs:.1f} s, {len(checked.seconds)} objects)"
    if checked.unfinished:
        said += f"; simcheck did not finish {', '.join(checked.unfinished)}"
    yield FigureLine(name, target, said, ours / theirs <= MAX_CHECKER_RATIO)


@dataclass(frozen=True)
class TimeShare:
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
        name = f"{COLUMN}{stage.value}"
        seconds = [float(value) for value in assets[name].dropna()] if name in assets else []
        if seconds:
            found[stage.value] = (sum(seconds), statistics.median(seconds))
    return found


def time_shares(times: FlowTimes, stages: Mapping[str, tuple[float, float]]) -> list[TimeShare]:
    """The parts of a run with one worker: they add up to its wall time. The time of Dask, processes and model calls is
    that of the refining task less that of the stages."""
    whole = times.flow_s

    def part(name: str, seconds: float, median: float | None = None) -> TimeShare:
        return TimeShare(name, seconds, seconds / whole if whole > 0.0 else None, median)

    lines = [part(f"asset: {name}", seconds, median) for name, (seconds, median) in stages.items()]
    staged = sum(seconds for seconds, _ in stages.values())
    lines.append(part("asset: process, Dask, waiting", times.tasks_s.get(REFINE, staged) - staged))
    lines += [part(f"run: {name}", seconds) for name, seconds in times.tasks_s.items() if name != REFINE]
    lines.append(part("run: Prefect around its tasks", whole - sum(times.tasks_s.values())))
    return [*lines, TimeShare("start-up, before the run", times.startup_s, None)]


MET = {True: "yes", False: "**no**", None: NOTHING}


def bench_markdown(found: BenchMeasurements) -> str:
    """Everything: on what machine, the figures, and where the time goes with one worker."""
    text = f"Measured on {found.machine}.\n\n{figure_table(figures(found))}\n"
    if found.one is not None and found.stages:
        text += f"\nWhere the time of {found.one.assets} objects goes with one worker:\n\n"
        text += f"{share_table(time_shares(found.one, found.stages))}\n"
    return text


def figure_table(lines: Sequence[FigureLine]) -> str:
    """A line a figure."""
    rows = [(line.name, line.target or NOTHING, line.measured, MET[line.met]) for line in lines]
    return markdown_table(("figure", "target", "measured", "met"), rows)


def share_table(lines: Sequence[TimeShare]) -> str:
    """A line a part of a run's time."""
    rows = []
    for line in lines:
        part = NOTHING if line.share is None else f"{100.0 * line.share:.1f} %"
        median = NOTHING if line.median_s is None else f"{1000.0 * line.median_s:.0f}"
        rows.append((line.name, f"{line.seconds:.2f}", part, median))
    return markdown_table(("where", "s in all", "of the run", "ms an asset (median)"), rows, right=(1, 2, 3))
