"""Figures of the acceptance, computed from the measured times and compared with their targets. Pure."""

import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from asset2sim.studies.speed.bench_figures import Part, parts
from asset2sim.studies.speed.measured import CheckerTimes, FlowTimes, LoopTimes, Measured, QueryTimes

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
NOT_MEASURED = "not measured"


@dataclass(frozen=True)
class Figure:
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


def figures(found: Measured) -> list[Figure]:
    """The table's lines, in the order of the acceptance."""
    return [
        *_rates(found.one, found.two),
        *_overhead(found.one, found.loop),
        *_around(found.one, found.stages),
        *_unchanged(found.again),
        *_synthetic(found.synthetic),
        *(_query(times) for times in found.queries),
        *_checker(found.both, found.checked),
    ]


def missed(lines: list[Figure]) -> list[str]:
    """The names of the figures that have a target and do not meet it, or were not measured."""
    return [line.name for line in lines if line.met is False or line.measured.startswith(NOT_MEASURED)]


def _rates(one: FlowTimes | None, two: FlowTimes | None) -> Iterator[Figure]:
    for times, bound in ((one, None), (two, MIN_ASSETS_PER_MINUTE)):
        if times is None:
            continue
        workers = f"{times.workers} worker{'s' if times.workers > 1 else ''}"
        name = f"assets a minute, {times.assets} objects ({times.ok} ok), {workers}"
        said = f"{rate(times):.1f} ({times.flow_s:.1f} s)"
        yield Figure(name, f"≥ {bound:g}" if bound else "", said, rate(times) >= bound if bound else None)
        said = f"{rate(times, startup=True):.1f} ({times.startup_s:.1f} s of start-up)"
        yield Figure(f"the same with start-up, {workers}", "", said)
    if one is not None and two is not None:
        share = efficiency(one, two)
        yield Figure("parallel efficiency", f"≥ {MIN_EFFICIENCY:g}", f"{share:.2f}", share >= MIN_EFFICIENCY)


def _overhead(one: FlowTimes | None, loop: LoopTimes | None) -> Iterator[Figure]:
    if one is None or loop is None:
        return
    name, target = "orchestration overhead an asset, 1 worker over a plain loop", f"≤ {100.0 * MAX_OVERHEAD_SHARE:g} %"
    if loop.problem or loop.loop_s <= 0.0:
        where = f" at {loop.died_at}" if loop.died_at else ""
        yield Figure(name, target, f"{NOT_MEASURED}: the loop's process was lost{where}: {loop.problem}")
        return
    share = overhead(one, loop)
    each = 1000.0 * (one.flow_s - loop.loop_s) / one.assets
    said = f"{100.0 * share:.1f} % ({each:.0f} ms an asset; {one.flow_s:.1f} s over {loop.loop_s:.1f} s)"
    yield Figure(name, target, said, share <= MAX_OVERHEAD_SHARE)


def _around(one: FlowTimes | None, stages: Mapping[str, tuple[float, float]]) -> Iterator[Figure]:
    """Orchestration time alone. The rest of the overhead is lost in child processes, which are less warmed up than the
    loop's process."""
    within = sum(seconds for seconds, _ in stages.values())
    if one is not None and within > 0.0:
        said = f"{100.0 * (one.flow_s - within) / within:.1f} % ({one.flow_s:.1f} s over {within:.1f} s)"
        yield Figure("… Prefect, Dask, tables and starting processes, over the assets' own time", "–", said)


def _unchanged(again: FlowTimes | None) -> Iterator[Figure]:
    if again is not None:
        yield _rerun(f"unchanged re-run of {again.assets}", again, MAX_UNCHANGED_S)


def _synthetic(runs: tuple[FlowTimes, ...]) -> Iterator[Figure]:
    if not runs:
        return
    few, many = runs[0], runs[-1]
    yield _rerun(f"unchanged re-run of {many.assets:,} synthetic entries", many, MAX_SYNTHETIC_S)
    if many.assets > few.assets:
        grown, each = memory_growth_mb(few, many)
        yield Figure(
            f"growth of the driver's peak memory from {few.assets:,} to {many.assets:,} entries",
            f"≤ {MAX_MEMORY_GROWTH_MB:g} MB",
            f"{grown:.0f} MB ({few.peak_memory_mb:.0f} to {many.peak_memory_mb:.0f} MB; {each:.1f} MB per 1000)",
            grown <= MAX_MEMORY_GROWTH_MB,
        )


def _rerun(name: str, times: FlowTimes, bound: float) -> Figure:
    said = f"{times.flow_s:.1f} s ({times.startup_s:.1f} s of start-up, {times.cpu_s:.1f} s of processor time in all)"
    left = times.assets - times.unchanged
    if left:
        said += f"; {left} were refined again"
    return Figure(name, f"≤ {bound:g} s", said, times.flow_s <= bound and not left)


def _query(times: QueryTimes) -> Figure:
    median = statistics.median(times.seconds[1:] or times.seconds)
    name = f"breakdown by {times.what.replace('_', ' ')} over {times.rows:,} rows of history in {times.files} files"
    said = f"{median:.3f} s (median; the first {times.seconds[0]:.3f} s)"
    return Figure(name, f"≤ {MAX_QUERY_S:g} s", said, median <= MAX_QUERY_S)


def _checker(both: FlowTimes | None, checked: CheckerTimes | None) -> Iterator[Figure]:
    if both is None or checked is None:
        return
    name, target = "refining and verifying over simcheck's checking alone, one core", f"≤ {MAX_CHECKER_RATIO:.2f}"
    if checked.problem or not checked.seconds:
        yield Figure(name, target, f"{NOT_MEASURED}: {checked.problem or 'no object was checked'}")
        return
    ours, theirs = both.flow_s / both.assets, sum(checked.seconds.values()) / len(checked.seconds)
    said = f"{ours / theirs:.2f} ({ours:.1f} s an object over {theirs:.1f} s, {len(checked.seconds)} objects)"
    if checked.unfinished:
        said += f"; simcheck did not finish {', '.join(checked.unfinished)}"
    yield Figure(name, target, said, ours / theirs <= MAX_CHECKER_RATIO)


NOTHING = "–"
MET = {True: "yes", False: "**no**", None: NOTHING}


def bench_markdown(found: Measured) -> str:
    """Everything: on what machine, the figures, and where the time goes with one worker."""
    text = f"Measured on {found.machine}.\n\n{figure_table(figures(found))}\n"
    if found.one is not None and found.stages:
        text += f"\nWhere the time of {found.one.assets} objects goes with one worker:\n\n"
        text += f"{part_table(parts(found.one, found.stages))}\n"
    return text


def figure_table(lines: Sequence[Figure]) -> str:
    """A line a figure."""
    rows = [(line.name, line.target or NOTHING, line.measured, MET[line.met]) for line in lines]
    return _table(("figure", "target", "measured", "met"), rows, "llll")


def part_table(lines: Sequence[Part]) -> str:
    """A line a part of a run's time."""
    rows = [
        (
            line.name,
            f"{line.seconds:.2f}",
            NOTHING if line.share is None else f"{100.0 * line.share:.1f} %",
            NOTHING if line.median_s is None else f"{1000.0 * line.median_s:.0f}",
        )
        for line in lines
    ]
    return _table(("where", "s in all", "of the run", "ms an asset (median)"), rows, "lrrr")


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]], sides: str) -> str:
    rule = ["---:" if side == "r" else "---" for side in sides]
    lines = [headings, rule, *(tuple(_cell(text) for text in row) for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
