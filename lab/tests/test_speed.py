"""The bench: its arithmetic and tables, and its program on one sample."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
import pytest

from lab.flows import bench
from lab.flows.bench import BenchRequest, evenly_spaced
from lab.speed.bench_figures import BenchRun, Used, beyond, efficiency, figures, stage_table
from schemas.vocabulary import Stage
from tests.assets import RAW


def run(
    own_s: Mapping[str, Sequence[float]],
    processor_s: float = 0.0,
    seconds: float = 50.0,
    workers: int = 1,
    **row: object,
) -> BenchRun:
    """A run over objects of these categories, each with its processor time."""
    assets = pd.DataFrame(
        [{"category": kind, "processor_s_total": value} for kind, own in own_s.items() for value in own]
    )
    count = len(assets)
    numbers = {"seconds": seconds, "assets": count, "ok": count, "unchanged": 0} | row
    used = Used(processor_s=processor_s, driver_mb=500.0, largest_mb=700.0)
    return BenchRun(workers, used, pd.Series(numbers, dtype=object), assets)


MIXED = {"Keyboard": (16.0,), "Box": (2.0,) * 8, "Teapot": (2.0,)}


def test_efficiency_is_the_speed_up_over_the_number_of_workers() -> None:
    assert efficiency(run(MIXED, seconds=200.0), run(MIXED, seconds=110.0, workers=2)) == pytest.approx(200 / 220)


def test_a_cold_run_is_held_against_its_targets_with_all_that_it_started() -> None:
    one = run(MIXED, processor_s=40.0)
    alone = run({"Keyboard": (16.0,)}, processor_s=16.6)
    lines = list(figures(alone, one, run(MIXED, seconds=31.0, workers=2), run(MIXED, seconds=4.0, unchanged=9)))
    assert [line.met for line in lines] == [False, False, False, False, None, False]
    whole, slowest, night, two, memory, again = (line.measured for line in lines)
    assert whole == "4.00 s, 3.40 s of it the objects' own; 0.0 s for the run's start and end"
    assert slowest == "16.0 s; the slowest tenth takes 47 %"
    # 37 keyboards, 28 boxes, 2,281 others at the mean of 3.4 s; 0.6 s an object is the run's own.
    each = 0.6 + (37 * 16.0 + 28 * 2.0 + 2281 * 3.4) / 2346
    assert night == f"{each * 2346 / 2.0 / 0.9 / 60.0:.0f} min; {each:.2f} s an object, 3 % of them of measured kinds"
    assert two.startswith("0.81") and memory.endswith("700 MB") and again == "4.0 s; 1 were refined again"


def test_a_run_of_a_few_objects_tells_its_start_from_what_each_object_costs() -> None:
    """Three boxes at 2 s of their own and 0.5 s beside it, in runs that take 30 s whatever they refine."""
    alone, one = run({"Box": (2.0,)}, processor_s=32.5), run({"Box": (2.0,) * 3}, processor_s=37.5)
    assert list(beyond(alone, one)) == pytest.approx([30.0, 0.5])
    assert list(beyond(alone, alone)) == pytest.approx([30.5, 0.0])


@pytest.mark.parametrize(
    ("total", "count", "places"), [(150, 20, range(0, 140, 7)), (3, 20, range(3)), (40, 2, (0, 20))]
)
def test_objects_are_evenly_spaced(total: int, count: int, places: Sequence[int]) -> None:
    assert evenly_spaced([f"{number}" for number in range(total)], count) == tuple(f"{place}" for place in places)


@pytest.mark.system
def test_a_run_is_measured_with_all_that_it_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prefect_server: str
) -> None:
    monkeypatch.setenv("PREFECT_API_URL", prefect_server)
    found = bench.run(BenchRequest(data=RAW, work=tmp_path), tmp_path / "one", 1, ["stapler_desk"])
    assert (found.row["assets"], found.row["ok"], found.row["unchanged"]) == (1, 1, 0)
    # The process that refined the object is counted, though the one that started it has ended.
    assert found.own_s.sum() > 0.05 and found.used.processor_s > 1.0 + found.own_s.sum()
    assert found.used.driver_mb > 100.0 and found.used.largest_mb > 100.0 and "| extract |" in stage_table(found)


def test_the_bench_writes_what_it_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[tuple[str, int, int]] = []

    def told(request: BenchRequest, out: Path, workers: int, ids: Sequence[str]) -> BenchRun:
        asked.append((out.name, workers, len(ids)))
        found = run({"Box": (2.0,) * len(ids)}, processor_s=30.0, workers=workers)
        columns = {f"processor_s_{stage.value}": [0.5] * len(ids) for stage in Stage}
        return BenchRun(workers, found.used, found.row, found.assets.assign(**columns))

    monkeypatch.setattr(bench, "run", told)
    assert bench.main([str(RAW), str(tmp_path / "a b"), "--limit", "3"]) == 0
    assert asked == [("alone", 1, 1), ("one", 1, 3), ("two", 2, 3), ("two", 2, 3)]
    said = capsys.readouterr().out
    assert "| processor time an object, 3 cold, 3 ok, everything |" in said and "| extract | 1.50 | 25.0 % |" in said
    assert (tmp_path / "a b" / "bench.md").read_text(encoding="utf-8").strip() == said.strip()
    assert bench.main([str(tmp_path / "nothing"), str(tmp_path)]) == 2


def test_each_stage_of_a_run_has_its_share() -> None:
    found = run({"Box": (2.0, 2.0)})
    columns = {f"processor_s_{stage.value}": [None, None] for stage in Stage} | {"processor_s_extract": [0.5, 0.7]}
    assets = pd.concat([found.assets, pd.DataFrame(columns)], axis=1)
    assert "| extract | 1.20 | 30.0 % | 0.600 |" in stage_table(BenchRun(1, found.used, found.row, assets))
