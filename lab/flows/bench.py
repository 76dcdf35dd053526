"""``make bench``: DATA WORK [--limit N] [--only PART] [--strict]. Prints the tables, and writes them into WORK.

Each measured run is a fresh process and has a fresh output folder, into which nothing but the warm caches of meshes,
their shapes and their convex pieces, is copied. A run that is not measured fills them; they stay in WORK for the next
bench.
"""

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from asset2sim.assets.meshes.shape_cache import PIECE_CACHE, SHAPE_CACHE
from asset2sim.catalog.read import read_table
from asset2sim.catalog.text import output
from asset2sim.intake.dataset import load_dataset
from asset2sim.models.gateway.environment import checkout_folder, quiet_environment
from asset2sim.runs.request import parse_request as parse_refine
from asset2sim.runs.spread.refine_all import refine_all
from flows import PIPELINE
from lab.flows.bench_loop import run_loop
from lab.flows.bench_night import MODULE as NIGHT
from lab.flows.bench_run import MODULE as RUN
from lab.speed.bench_figures import bench_markdown, figures, missed, stage_seconds
from lab.speed.history_rows import MODULE as QUERY
from lab.speed.history_rows import write_history
from lab.speed.measured import BenchMeasurements, BenchRequest, FlowTimes, QueryTimes, parse_request
from lab.speed.process import evenly_spaced, machine, measure, one_core, time_checker
from lab.speed.replay import leave_records, make_entries, write_samples
from lab.speed.synthetic import make_unchanged
from schemas.asset import AssetRecord
from schemas.errors import DONE, FAILED, exit_code_of
from schemas.vocabulary import Engine, Grouping

ENGINES = {"one": (Engine.PYBULLET,), "both": (Engine.PYBULLET, Engine.MUJOCO), "all": tuple(Engine)}
SAMPLE = "stapler_desk"
"""The sample object whose record and files the synthetic entries have."""


def tell(line: str) -> None:
    """A line of progress."""
    sys.stderr.write(f"bench: {line}\n")
    sys.stderr.flush()


def command(
    request: BenchRequest,
    data: Path,
    out: Path,
    workers: int,
    engines: str = "one",
    ids: Sequence[str] = (),
    views: bool = False,
) -> list[str]:
    """The arguments of an ``asset2sim refine`` command."""
    words = ["refine", str(data), "--out", str(out), "--workers", str(workers), *([] if views else ["--no-views"])]
    words += ["--engines", ",".join(engine.value for engine in ENGINES[engines])]
    ids = ids or (chosen(request) if request.limit is not None and data == request.data else ())
    words += ["--assets", ",".join(ids)] if ids else []
    return [*words, *([] if request.interaction else ["--no-interaction"])]


def chosen(request: BenchRequest) -> tuple[str, ...]:
    """The dataset's assets that are measured, by their ids."""
    ids = [ref.asset_id for ref in load_dataset(request.data)]
    return evenly_spaced(ids, request.limit or len(ids))


def fresh(request: BenchRequest, name: str) -> Path:
    """An output folder that holds only the warm caches of mesh shapes and convex pieces."""
    out = request.work / name
    shutil.rmtree(out, ignore_errors=True)
    for cache in (SHAPE_CACHE, PIECE_CACHE):
        warm = request.work / "warm" / cache
        if warm.is_dir():
            shutil.copytree(warm, out / cache)
    return out


def flow(request: BenchRequest, name: str, words: Sequence[str]) -> FlowTimes:
    """One run of the flow in a process of its own."""
    times = measure(FlowTimes, RUN, words, request.work / "numbers" / name)
    seconds = f"{times.flow_s:.1f} s after {times.startup_s:.1f} s"
    tell(f"{name}: {times.assets} assets, {times.unchanged} unchanged: {seconds}")
    return times


def fill_caches(request: BenchRequest) -> None:
    """Fill the caches of meshes; where an earlier bench did, with the same code and settings, nothing is refined."""
    flow(request, "warm", command(request, request.data, request.work / "warm", 2))


def rates(request: BenchRequest, found: BenchMeasurements) -> BenchMeasurements:
    """Measure one worker, the plain loop over the same assets, and two workers."""
    fill_caches(request)
    outs = {name: fresh(request, name) for name in ("one", "loop", "two")}
    one = flow(request, "one", command(request, request.data, outs["one"], 1))
    loop = run_loop(command(request, request.data, outs["loop"], 1), request.work / "numbers" / "loop")
    tell(f"loop: {loop.assets} assets in {loop.loop_s:.1f} s {loop.problem}")
    two = flow(request, "two", command(request, request.data, outs["two"], 2))
    return found.model_copy(update={"one": one, "loop": loop, "two": two, "stages": stage_seconds(outs["one"])})


def cold(request: BenchRequest, found: BenchMeasurements) -> BenchMeasurements:
    """Measure one object alone, one worker and two, without caches, in every engine, with views and report."""
    ids = chosen(request)
    times = {}
    for name, workers, some in (("alone", 1, ids[:1]), ("cold", 1, ids), ("cold-two", 2, ids)):
        out = request.work / name
        shutil.rmtree(out, ignore_errors=True)
        times[name] = flow(request, name, command(request, request.data, out, workers, "all", some, views=True))
    known = read_table(request.work / "cold", "assets").dropna(subset=["processor_s_total"])
    seconds = {str(kind): tuple(own) for kind, own in known.groupby("category", dropna=False)["processor_s_total"]}
    own = float(read_table(request.work / "alone", "assets")["processor_s_total"].sum())
    update = {"cold": times["cold"], "cold_two": times["cold-two"], "alone": times["alone"], "alone_s": own}
    return found.model_copy(update={**update, "cold_assets_s": seconds})


def unchanged(request: BenchRequest, found: BenchMeasurements) -> BenchMeasurements:
    """Measure a second run into the two workers' output, with nothing changed."""
    words = command(request, request.data, request.work / "two", 2)
    if found.two is None:
        flow(request, "two", words)
    return found.model_copy(update={"again": flow(request, "again", words)})


def synthetic(request: BenchRequest, found: BenchMeasurements) -> BenchMeasurements:
    """Measure runs over few and over many synthetic entries, none of which changed."""
    record = sample_record(request)
    runs = []
    for count in (request.few, request.entries):
        folder = request.work / "synthetic" / str(count)
        shutil.rmtree(folder, ignore_errors=True)
        tell(f"making {count:,} synthetic entries")
        words = command(request, folder / "data", folder / "out", 2)
        data, out = make_unchanged(record, folder, count, parse_refine(words).settings, PIPELINE)
        runs.append(flow(request, f"synthetic-{count}", command(request, data, out, 2)))
    return found.model_copy(update={"synthetic": tuple(runs)})


def night(request: BenchRequest, found: BenchMeasurements) -> BenchMeasurements:
    """Measure nights that refine few and many entries, each of which hands back the record of a real sample object."""
    samples = request.work / "samples"
    if not samples.is_dir():
        tell("refining the sample dataset, whose records the entries have")
        raw = (checkout_folder() or Path()) / "data" / "raw"
        words = command(request, raw, request.work / "sampled", 2, "all")
        refs = load_dataset(raw)
        out = (request.work / "sampled").resolve()
        write_samples(refine_all(refs, out, parse_refine(words).settings, PIPELINE).records, samples)
    runs = []
    for count in (request.few, request.entries):
        folder = request.work / "nights" / str(count)
        shutil.rmtree(folder, ignore_errors=True)
        tell(f"making {count:,} entries")
        refs = make_entries(samples, folder / "data", count)
        words = command(request, folder / "data", folder / "out", 2)
        if request.left:
            leave_records(refs, folder / "out", parse_refine(words).settings)
        runs.append(measure(FlowTimes, NIGHT, words, request.work / "numbers" / f"night-{count}"))
        tell(f"night of {count:,}: {runs[-1].flow_s:.1f} s, {runs[-1].peak_memory_mb:.0f} MB")
    return found.model_copy(update={"nights": tuple(runs)})


def sample_record(request: BenchRequest) -> AssetRecord:
    """The record of a real refinement of a sample object."""
    raw = (checkout_folder() or Path()) / "data" / "raw"
    out = fresh(request, "sample").resolve()
    words = command(request, raw, out, 1, ids=[SAMPLE])
    refs = load_dataset(raw, None, (SAMPLE,), None)
    return refine_all(refs, out, parse_refine(words).settings, PIPELINE).records[0]


def history(request: BenchRequest, found: BenchMeasurements) -> BenchMeasurements:
    """Measure the query that groups failures, over a year of nights."""
    out = request.work / "history"
    shutil.rmtree(out, ignore_errors=True)
    tell(f"writing {request.rows:,} rows of history")
    write_history(out, sample_record(request), request.rows)
    groupings = (Grouping.FAILURE_MODE, Grouping.CATEGORY)
    places = {grouping: request.work / "numbers" / f"query-{grouping.value}" for grouping in groupings}
    queries = [measure(QueryTimes, QUERY, [str(out), grouping.value], place) for grouping, place in places.items()]
    return found.model_copy(update={"queries": tuple(queries)})


def checker(request: BenchRequest, found: BenchMeasurements) -> BenchMeasurements:
    """Measure our refinement, verified in two engines, and the independent checker on its output, on one core."""
    if "rates" not in request.parts:
        fill_caches(request)
    ids = evenly_spaced(chosen(request), request.objects)
    out = fresh(request, "both")
    with one_core():
        both = flow(request, "both", command(request, request.data, out, 1, "both", ids))
        checked = time_checker(checkout_folder() or Path.cwd(), out, ids, tell)
    return found.model_copy(update={"both": both, "checked": checked})


MEASURE = {
    "cold": cold,
    "rates": rates,
    "unchanged": unchanged,
    "synthetic": synthetic,
    "night": night,
    "history": history,
    "checker": checker,
}


def bench(request: BenchRequest) -> BenchMeasurements:
    """Measure what is asked for; raises UsageError for a dataset that cannot be read, before anything is made."""
    load_dataset(request.data)
    found = BenchMeasurements(machine=machine())
    for part in request.parts:
        found = MEASURE[part](request, found)
        write(request, found)
    return found


def write(request: BenchRequest, found: BenchMeasurements) -> str:
    """Write the figures so far. Returns the Markdown."""
    text = bench_markdown(found)
    (request.work / "bench.md").write_text(text, encoding="utf-8")
    (request.work / "bench.json").write_text(found.model_dump_json(indent=2), encoding="utf-8")
    return text


def bench_and_print(request: BenchRequest) -> int:
    """Measure, print tables, name missed targets. Returns the exit code; a miss fails only under ``--strict``."""
    found = bench(request)
    output().print(write(request, found), soft_wrap=True)
    left = missed(figures(found))
    if left:
        tell(f"not met: {'; '.join(left)}")
    return FAILED if left and request.strict else DONE


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    quiet_environment()
    return exit_code_of("bench", lambda: bench_and_print(parse_request(words)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
