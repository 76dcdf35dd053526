"""The bench: its arithmetic and tables, the entries and the history that it makes, and its programs on tiny inputs."""

import json
import os
from collections.abc import Sequence
from pathlib import Path

import pytest

from asset2sim.catalog.history import history_files
from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import start_run
from asset2sim.catalog.write import write_run
from asset2sim.intake.dataset import load_dataset
from asset2sim.runs.plan.plan import make_plan
from flows import PIPELINE
from lab.flows.bench import command, fresh, main
from lab.flows.bench_loop import run_loop
from lab.flows.bench_run import MODULE as RUN
from lab.speed.bench_figures import (
    FigureLine,
    bench_markdown,
    efficiency,
    figure_table,
    figures,
    memory_growth_mb,
    missed,
    overhead,
    rate,
    stage_seconds,
    time_shares,
)
from lab.speed.history_rows import FIRST_NIGHT, night_tables, time_query, write_history
from lab.speed.history_rows import MODULE as QUERY
from lab.speed.measured import PARTS, BenchMeasurements, CheckerTimes, FlowTimes, LoopTimes, QueryTimes, parse_request
from lab.speed.process import BenchError, evenly_spaced, measure, one_core, peak_memory_mb, time_checker
from lab.speed.synthetic import FILES, make_entries, publish_entries
from schemas.asset import AssetRecord, AssetRef
from schemas.tables import HISTORY
from schemas.vocabulary import Grouping
from tests.assets import NO_VIEWS, RAW
from tests.factories import make_record

STAPLER = RAW / "Stapler" / "stapler_desk"


def flow(assets: int = 150, flow_s: float = 100.0, workers: int = 1, **changes: object) -> FlowTimes:
    """A run's numbers."""
    fields: dict[str, object] = {
        "workers": workers, "assets": assets, "ok": assets, "unchanged": 0, "startup_s": 10.0,
        "flow_s": flow_s, "peak_memory_mb": 500.0, "cpu_s": 12.0,
        "tasks_s": {"plan": 1.0, "refine-assets": flow_s - 10.0, "publish": 2.0},
    }  # fmt: skip
    return FlowTimes.model_validate(fields | changes)


def stapler() -> AssetRecord:
    """A complete record that says it is of a real folder."""
    return make_record("stapler", ref=AssetRef(asset_id="stapler", path=str(STAPLER)))


def refine(out: Path, asset_id: str) -> list[str]:
    """The words that refine one sample, in one engine and without interaction tests."""
    return ["refine", str(RAW), "--out", str(out), "--engines", "pybullet", "--no-interaction", "--no-views",
            "--workers", "1", "--assets", asset_id]  # fmt: skip


def test_rate_efficiency_overhead_and_growth() -> None:
    one, two = flow(150, 200.0), flow(150, 110.0, workers=2)
    assert rate(one) == pytest.approx(45.0) and rate(one, startup=True) == pytest.approx(60 * 150 / 210)
    assert efficiency(one, two) == pytest.approx(200 / 220)
    assert efficiency(one, flow(75, 100.0, workers=2)) == pytest.approx(0.5)
    assert overhead(one, LoopTimes(assets=150, ok=150, loop_s=160.0)) == pytest.approx(0.25)
    few, many = flow(1000, peak_memory_mb=500.0), flow(10_000, peak_memory_mb=590.0)
    assert list(memory_growth_mb(few, many)) == pytest.approx([90.0, 10.0])


def test_every_figure_is_held_against_its_target() -> None:
    found = BenchMeasurements(
        machine="a machine",
        one=flow(150, 200.0),
        two=flow(150, 110.0, workers=2),
        loop=LoopTimes(assets=150, ok=150, loop_s=190.0),
        stages={"extract": (40.0, 0.2), "measure": (152.0, 0.9)},
        again=flow(150, 5.1, unchanged=150),
        synthetic=(flow(1000, 9.0, unchanged=1000), flow(10_000, 50.0, unchanged=10_000, peak_memory_mb=601.0)),
        queries=(QueryTimes(rows=1_000_100, files=42, seconds=(0.9, 0.1, 0.3, 0.15, 0.2, 0.19), what="failure_mode"),),
        both=flow(20, 80.0),
        checked=CheckerTimes(seconds={"a": 10.0, "b": 16.0}),
    )
    met = {line.name: line.met for line in figures(found)}
    assert met == {
        "assets a minute, 150 objects (150 ok), 1 worker": None,
        "the same with start-up, 1 worker": None,
        "assets a minute, 150 objects (150 ok), 2 workers": True,
        "the same with start-up, 2 workers": None,
        "parallel efficiency": True,
        "orchestration overhead an asset, 1 worker over a plain loop": True,
        "… Prefect, Dask, tables and starting processes, over the assets' own time": None,
        "unchanged re-run of 150": False,
        "unchanged re-run of 10,000 synthetic entries": True,
        "growth of the driver's peak memory from 1,000 to 10,000 entries": False,
        "breakdown by failure mode over 1,000,100 rows of history in 42 files": True,
        "refining and verifying over simcheck's checking alone, one core": True,
    }
    measured = {line.name.split(",")[0]: line.measured for line in figures(found)}
    assert measured["parallel efficiency"] == "0.91"
    assert measured["orchestration overhead an asset"] == "5.3 % (67 ms an asset; 200.0 s over 190.0 s)"
    assert measured["… Prefect"] == "4.2 % (200.0 s over 192.0 s)"
    assert measured["refining and verifying over simcheck's checking alone"].startswith("0.31 (4.0 s an object")
    assert next(line.measured for line in figures(found) if "breakdown" in line.name).startswith("0.190 s (median")
    assert missed(figures(found)) == [name for name, well in met.items() if well is False]


def test_a_cold_run_is_held_against_its_target_with_all_that_it_started() -> None:
    assets_s = {"Keyboard": (16.0,), "Box": (2.0,) * 8, "Teapot": (2.0,)}
    found = BenchMeasurements(machine="m", cold=flow(10, 50.0, whole_cpu_s=40.0), cold_assets_s=assets_s)
    whole, slowest, night = figures(found)
    assert (whole.met, slowest.met, night.met) == (False, False, False)
    assert whole.measured == "4.00 s, 3.40 s of it the objects' own; 0.0 s for the run's start and end"
    assert slowest.measured == "16.0 s; the slowest tenth takes 47 %"
    # 37 keyboards, 28 boxes, 2,281 others at the mean of 3.4 s; 0.6 s an object is the run's own.
    each = 0.6 + (37 * 16.0 + 28 * 2.0 + 2281 * 3.4) / 2346
    minutes = each * 2346 / 2.0 / 0.9 / 60.0
    assert night.measured == f"{minutes:.0f} min; {each:.2f} s an object, 3 % of them of measured kinds"


def test_a_cold_run_of_a_few_objects_tells_its_start_from_what_each_object_costs() -> None:
    """Three boxes at 2 s of their own and 0.5 s beside it, in runs that take 30 s whatever they refine."""
    found = BenchMeasurements(
        machine="m",
        alone=flow(1, whole_cpu_s=32.5),
        alone_s=2.0,
        cold=flow(3, 8.0, whole_cpu_s=37.5),
        cold_two=flow(3, 5.0, workers=2, largest_mb=700.0),
        cold_assets_s={"Box": (2.0,) * 3},
    )
    whole, _, night, two, memory = figures(found)
    assert whole.measured.startswith("12.50 s, 2.00 s of it") and whole.measured.endswith(
        "30.0 s for the run's start and end"
    )
    assert night.measured.startswith(f"{(30.0 + 2.5 * 2346) / 2.0 / 0.9 / 60.0:.0f} min; 2.50 s an object, 1 %")
    assert (two.met, two.measured[:4], memory.measured[-6:]) == (False, "0.80", "700 MB")


def test_what_was_not_measured_says_so_and_what_was_not_asked_for_is_left_out() -> None:
    assert figures(BenchMeasurements(machine="a machine")) == []
    lost = LoopTimes(assets=0, ok=0, loop_s=0.0, died_at="3558", problem="exit code -11")
    found = BenchMeasurements(
        machine="m", one=flow(), loop=lost, both=flow(1), checked=CheckerTimes(problem="it is not there")
    )
    said = {line.name: line for line in figures(found)}
    (loop,) = (line for name, line in said.items() if "overhead" in name)
    assert loop.met is None and "lost at 3558: exit code -11" in loop.measured
    (checker,) = (line for name, line in said.items() if "simcheck" in name)
    assert checker.measured == "not measured: it is not there"
    assert set(missed(list(said.values()))) == {loop.name, checker.name}


def test_a_re_run_that_refined_something_is_not_an_unchanged_one() -> None:
    (line,) = figures(BenchMeasurements(machine="m", again=flow(150, 1.0, unchanged=149)))
    assert line.met is False and "1 were refined again" in line.measured


def test_the_parts_of_a_run_add_up_to_it(tmp_path: Path) -> None:
    times = flow(2, 20.0)
    write_run(tmp_path, start_run(NO_VIEWS, "data"), [make_record("a"), make_record("b")])
    stages = stage_seconds(tmp_path)
    assert list(stages["extract"]) == pytest.approx([0.2, 0.1]) and "publish" not in stages
    lines = time_shares(times, stages)
    inside = [line for line in lines if line.share is not None]
    assert sum(line.seconds for line in inside) == pytest.approx(20.0)
    assert sum(line.share or 0.0 for line in inside) == pytest.approx(1.0)
    assert lines[-1].seconds == 10.0 and lines[-1].share is None
    text = bench_markdown(BenchMeasurements(machine="m", one=times, stages=stages))
    assert "| asset: extract | 0.20 | 1.0 % | 100 |" in text and "| start-up, before the run | 10.00 | – | – |" in text


def test_the_table_holds_what_would_break_it() -> None:
    text = figure_table([FigureLine("a|b", "", "two\nlines", False)])
    assert text.splitlines()[2] == "| a\\|b | – | two lines | **no** |"
    assert all(line.count("|") - line.count("\\|") == 5 for line in text.splitlines())


@pytest.mark.parametrize(
    ("total", "count", "places"), [(150, 20, range(0, 140, 7)), (3, 20, range(3)), (40, 2, (0, 20))]
)
def test_the_checker_s_objects_are_evenly_spaced(total: int, count: int, places: Sequence[int]) -> None:
    assert evenly_spaced([f"{number}" for number in range(total)], count) == tuple(f"{place}" for place in places)


@pytest.mark.system
def test_synthetic_entries_are_unchanged_until_one_changes(tmp_path: Path) -> None:
    data, out = tmp_path / "data", tmp_path / "out"
    refs = make_entries(STAPLER, data, 30)
    assert [ref.asset_id for ref in refs] == [ref.asset_id for ref in load_dataset(data)] and len(refs) == 30
    assert len(list((data / "entry00003").iterdir())) == FILES
    publish_entries(stapler(), refs, data, out, NO_VIEWS, PIPELINE)
    assets = read_table(out, "assets")
    assert len(assets) == 30 and len(set(assets["content_hash"])) == 30
    assert set(read_table(out, "links")["asset_id"]) == {ref.asset_id for ref in refs}

    def todo() -> list[str]:
        return [ref.asset_id for ref in make_plan(load_dataset(data), out, NO_VIEWS, PIPELINE).todo]

    assert todo() == []
    changed = data / "entry00007" / "mobility.urdf"
    text = changed.read_text(encoding="utf-8")
    changed.unlink()
    changed.write_text(f"{text}<!-- changed -->", encoding="utf-8")
    assert todo() == ["entry00007"]


def test_a_history_of_many_nights_has_real_files_and_rows(tmp_path: Path) -> None:
    assert write_history(tmp_path, stapler(), 401, assets=10) == 410
    names = [path.relative_to(tmp_path / "history").as_posix() for path in history_files(tmp_path)]
    assert names[0] == "month=2025-01/merged.parquet" and len(names) == 1 + 41 - 31
    rows = read_table(tmp_path, "asset_history")
    assert len(rows) == 410 and rows["started_at"].nunique() == 41 and rows["run_id"].nunique() == 41
    assert list(rows.columns) == HISTORY.schema.names
    idle = rows[rows["unchanged"]]
    assert 0 < len(idle) < 410 and (idle["seconds_total"] == 0).all() and (idle["queries"] == 0).all()
    start, first = next(night_tables(1, 200))
    assert start == FIRST_NIGHT and first.equals(next(night_tables(5, 200))[1])
    failed = first.filter([mode != "none" for mode in first["failure_mode"].to_pylist()])
    assert 0 < failed.num_rows < 30 and set(failed["status"].to_pylist()) == {"failed"}
    times = time_query(tmp_path, Grouping.CATEGORY, 2)
    assert times.rows == 410 and times.files == 11 and len(times.seconds) == 2 and min(times.seconds) > 0.0


@pytest.mark.system
def test_a_program_leaves_its_numbers_or_says_why_it_has_none(tmp_path: Path) -> None:
    write_history(tmp_path / "out", stapler(), 20, assets=10)
    times = measure(QueryTimes, QUERY, [str(tmp_path / "out"), "failure_mode"], tmp_path / "numbers" / "query")
    assert times.rows == 20 and times.what == "failure_mode"
    with pytest.raises(BenchError, match=r"(?s)exit code 1 and without numbers: .*no catalog in .*query\.log"):
        measure(QueryTimes, QUERY, [str(tmp_path), "failure_mode"], tmp_path / "numbers" / "query")
    assert not (tmp_path / "numbers" / "query.json").exists()


@pytest.mark.system
def test_the_plain_loop_refines_and_its_loss_is_told(tmp_path: Path) -> None:
    times = run_loop(refine(tmp_path / "out", "stapler_desk"), tmp_path / "loop")
    assert (times.assets, times.ok, times.problem) == (1, 1, "") and times.loop_s > 0.0
    assert (tmp_path / "out" / "assets" / "stapler_desk" / "mobility.urdf").is_file()
    lost = run_loop(refine(tmp_path / "out", "nobody"), tmp_path / "loop")
    assert lost.assets == 0 and lost.died_at is None and "trashcan_pedal" in lost.problem


def test_the_checker_that_is_not_installed_is_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SIMCHECK", "no-such-program")
    found = time_checker(tmp_path, tmp_path, ("a",), lambda line: None)
    assert "no-such-program" in found.problem and not found.seconds


def test_one_core_is_one_and_only_within_the_block() -> None:
    before = os.sched_getaffinity(0)
    with one_core() as pinned:
        assert pinned and len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before and peak_memory_mb() > 20.0


def test_the_request_and_the_commands_it_runs(tmp_path: Path) -> None:
    request = parse_request([str(RAW), str(tmp_path), "--limit", "3", "--only", "history", "--only", "rates"])
    assert request.parts == ("rates", "history") and not request.strict
    assert parse_request([str(RAW), str(tmp_path)]).parts == PARTS
    words = command(request, RAW, tmp_path / "one", 1)
    ids = [ref.asset_id for ref in load_dataset(RAW)]
    assert words[-2:] == ["--assets", ",".join(evenly_spaced(ids, 3))]
    assert words[words.index("--engines") + 1] == "pybullet"
    assert "--assets" not in command(request, tmp_path / "other", tmp_path / "one", 1)
    (tmp_path / "warm" / ".cache" / "pieces").mkdir(parents=True)
    (tmp_path / "warm" / ".cache" / "pieces" / "a.npz").write_bytes(b"pieces")
    (tmp_path / "warm" / ".cache" / "answers").mkdir()
    (tmp_path / "one" / "catalog").mkdir(parents=True)
    out = fresh(request, "one")
    assert sorted(path.name for path in out.rglob("*") if path.is_file()) == ["a.npz"]


@pytest.mark.system
def test_the_bench_runs_and_writes_what_it_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = [str(RAW), str(tmp_path / "a b"), "--rows", "300", "--no-interaction", "--only", "history"]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "| breakdown by failure mode over 2,740 rows of history" in said
    assert (tmp_path / "a b" / "bench.md").read_text(encoding="utf-8").strip() == said.strip()
    written = json.loads((tmp_path / "a b" / "bench.json").read_text(encoding="utf-8"))
    assert [item["what"] for item in written["queries"]] == ["failure_mode", "category"]
    assert main([str(tmp_path / "nothing"), str(tmp_path)]) == 2


@pytest.mark.system
def test_a_run_of_the_flow_is_timed_as_the_command_runs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prefect_server: str
) -> None:
    monkeypatch.setenv("PREFECT_API_URL", prefect_server)
    times = measure(FlowTimes, RUN, refine(tmp_path / "out", "stapler_desk"), tmp_path / "run")
    assert (times.assets, times.ok, times.unchanged) == (1, 1, 0)
    assert {"discover", "plan", "refine-assets", "publish", "report", "log-run"} <= set(times.tasks_s)
    assert 0.0 < sum(times.tasks_s.values()) <= times.flow_s and times.startup_s > 0.0
    assert times.peak_memory_mb > 100.0
    (own,) = read_table(tmp_path / "out", "assets")["processor_s_total"]
    # The object's process, which is nobody's child by then, is counted.
    assert own > 0.05 and times.whole_cpu_s > times.cpu_s + own
