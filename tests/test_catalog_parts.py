"""Rows that go into parts as assets come in: the same tables, in flat memory, whatever happens in between."""

import gc
import tracemalloc
from concurrent.futures import ProcessPoolExecutor
from itertools import count, pairwise
from multiprocessing import get_context
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from asset2sim.catalog import parts
from asset2sim.catalog.enforce import CatalogError
from asset2sim.catalog.parts import FOLDER, Parts, merged_tables, open_parts, whole_assets
from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import RunRow
from asset2sim.catalog.stored_tables import ascends
from asset2sim.catalog.write import write_parts, write_run
from asset2sim.runs.plan.records import KeptRecord, keep_record, record_file
from asset2sim.runs.spread.harvest import Harvest, take_result
from asset2sim.runs.spread.job import Job
from asset2sim.storage.lock import lock_output
from schemas.asset import AssetRecord, AssetSummary
from schemas.settings import Settings
from schemas.tables import TABLES
from schemas.vocabulary import FailureMode, Redo, Severity
from tests.factories import make_call, make_failure, make_finding, make_record
from tests.test_catalog_history import night

SHUFFLED = [f"{(7 * number) % 20:02}" for number in range(20)]


def rich(asset_id: str) -> AssetRecord:
    """A record of about the size of a real one: 30 kB as JSON."""
    return make_record(
        asset_id,
        findings=tuple(make_finding(Severity.WARNING, f"code_{number}") for number in range(150)),
        content_hash=f"{asset_id:0>64}",
    )


def tables_of(out: Path) -> dict[str, pa.Table]:
    return {name: pq.read_table(out / "catalog" / table.file) for name, table in TABLES.items()}


def same(one: Path, other: Path) -> bool:
    """Whether two outputs hold the same tables, in the same order."""
    return all(table.equals(tables_of(other)[name], check_metadata=True) for name, table in tables_of(one).items())


def sample(asset_id: str) -> AssetRecord:
    return make_failure(asset_id, FailureMode.JAM) if asset_id.endswith("3") else make_record(asset_id)


def make_tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts of three assets, read by few rows and merged by twos."""
    monkeypatch.setattr(parts, "PART_ROWS", 60)
    monkeypatch.setattr(parts, "BATCH_ROWS", 7)
    monkeypatch.setattr(parts, "MOST_OPEN", 2)
    monkeypatch.setattr(parts, "ROW_GROUP", 20)


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    make_tiny(monkeypatch)


@pytest.fixture(scope="module")
def calm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tables of one undisturbed run."""
    out = tmp_path_factory.mktemp("calm")
    write_run(out, night(1), [sample(asset_id) for asset_id in SHUFFLED])
    return out


def published(out: Path, run: RunRow, made: list[AssetRecord], again: int | None = None) -> tuple[AssetSummary, ...]:
    with open_parts(out, run) as held:
        refined = tuple(held.add(record) for record in made)
        assert again is None or len(list((out / FOLDER).iterdir())) >= again
        write_parts(out, run, held, refined)
    assert not (out / FOLDER).exists()
    return refined


def test_tables_written_in_parts_are_those_written_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    one, many = tmp_path / "one", tmp_path / "many"
    later = [make_failure("04", FailureMode.DRIFT), make_record("zz"), make_record("05", model="other/model")]
    nights = ((night(1), [sample(asset_id) for asset_id in SHUFFLED]), (night(2), later))
    for run, made in nights:
        write_run(one, run, made)
    make_tiny(monkeypatch)
    for run, made in nights:
        published(many, run, made, again=None if run is nights[1][0] else 5)
    assert same(one, many)
    assert read_table(one, "asset_history").equals(read_table(many, "asset_history"))
    assert pq.ParquetFile(many / "catalog" / "links.parquet").num_row_groups > 1
    for name, table in TABLES.items():
        rows = tables_of(many)[name]
        assert rows.equals(rows.sort_by([(column, "ascending") for column in table.key]))


@pytest.mark.usefixtures("tiny")
def test_an_interruption_anywhere_neither_loses_nor_doubles_rows(
    calm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = [sample(asset_id) for asset_id in SHUFFLED]
    real, stores = Parts._store, count()

    def interrupted(table: pa.Table, path: Path) -> parts.Source:
        stored = real(table, path)
        if next(stores) % 23 == 3:
            raise KeyboardInterrupt
        return stored

    monkeypatch.setattr(Parts, "_store", staticmethod(interrupted))
    with open_parts(tmp_path / "rough", night(1)) as held:
        refined = {}
        for record in made:
            for _ in range(50):
                try:
                    refined[record.ref.asset_id] = held.add(record)
                    break
                except KeyboardInterrupt:
                    continue
        # What had been added already may come once more.
        assert [held.add(record) for record in made] == list(refined.values())
        write_parts(tmp_path / "rough", night(1), held, tuple(refined.values()))
    assert len(refined) == 20 and same(calm, tmp_path / "rough")


@pytest.mark.usefixtures("tiny")
def test_where_there_is_no_room_for_parts_the_rows_stay_in_memory(
    calm: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    made = [sample(asset_id) for asset_id in SHUFFLED]
    (tmp_path / "none" / FOLDER).parent.mkdir(parents=True)
    (tmp_path / "none" / FOLDER).write_text("in the way")
    with open_parts(tmp_path / "none", night(1)) as held:
        refined = tuple(held.add(record) for record in made)
        (tmp_path / "none" / FOLDER).unlink()
        write_parts(tmp_path / "none", night(1), held, refined)
    assert same(calm, tmp_path / "none") and "rows stay in memory" in caplog.text


@pytest.mark.usefixtures("tiny")
def test_rows_that_do_not_fit_are_an_error_at_the_end_and_leave_the_tables(tmp_path: Path) -> None:
    write_run(tmp_path, night(1), [make_record("a")])
    before = tables_of(tmp_path)
    broken = make_record("b", calls=(make_call(attempt=2**63),))  # one more than the column holds
    with open_parts(tmp_path, night(2)) as held:
        refined = tuple(held.add(record) for record in (broken, *(sample(asset_id) for asset_id in SHUFFLED)))
        assert len(refined) == 21
        with pytest.raises(CatalogError, match="table 'model_calls', column 'attempt'"):
            write_parts(tmp_path, night(2), held, refined)
    assert all(rows.equals(before[name]) for name, rows in tables_of(tmp_path).items())


def test_a_table_that_somebody_else_sorted_is_merged_all_the_same(tmp_path: Path) -> None:
    write_run(tmp_path, night(1), [sample(asset_id) for asset_id in SHUFFLED])
    for name in ("links", "findings"):
        path = tmp_path / "catalog" / TABLES[name].file
        rows = pq.read_table(path)
        pq.write_table(rows.take(pa.array(reversed(range(rows.num_rows)))), path)
    write_run(tmp_path, night(2), [make_record("04")])
    rows = tables_of(tmp_path)["links"]
    assert rows.num_rows == 18 * 4 and rows.equals(rows.sort_by([(name, "ascending") for name in TABLES["links"].key]))


@pytest.mark.usefixtures("tiny")
def test_an_asset_that_was_being_added_when_the_run_was_stopped_is_not_published(tmp_path: Path) -> None:
    write_run(tmp_path, night(1), [make_record("07"), make_record("19")])
    before = read_table(tmp_path, "links")
    with open_parts(tmp_path, night(2)) as held:
        refined = [held.add(sample(asset_id)) for asset_id in SHUFFLED]
        write_parts(tmp_path, night(2), held, [item for item in refined if item.ref.asset_id not in ("07", "19")])
    assets = read_table(tmp_path, "assets").set_index("asset_id")["run_id"]
    assert (assets["07"], assets["19"], assets["01"]) == (night(1).run_id, night(1).run_id, night(2).run_id)
    links = read_table(tmp_path, "links")
    assert links[links["asset_id"].isin(["07", "19"])].reset_index(drop=True).equals(before)


def test_what_a_killed_run_left_of_its_parts_is_removed(tmp_path: Path) -> None:
    (tmp_path / FOLDER).mkdir(parents=True)
    (tmp_path / FOLDER / "assets.0").write_bytes(b"half")
    published(tmp_path, night(1), [make_record("a")])
    assert read_table(tmp_path, "assets")["asset_id"].tolist() == ["a"]


def test_streams_are_merged_by_asset() -> None:
    def table(*ids: str) -> pa.Table:
        return pa.table({"asset_id": pa.array(ids, pa.string()), "n": pa.array(range(len(ids)), pa.int64())})

    whole = list(whole_assets([table("a", "b"), table("b"), table(), table("b", "c")]))
    assert [rows["asset_id"].to_pylist() for rows in whole] == [["a"], ["b", "b", "b"], ["c"]]
    one, other = [table("a", "c"), table("c", "d")], [table("b", "c", "e"), table("e", "f")]
    rows = list(merged_tables([one, other, []], ("asset_id", "n")))
    ids = [part["asset_id"].to_pylist() for part in rows]
    assert [name for part in ids for name in part] == list("abcccdeef")
    assert all(set(before).isdisjoint(after) for before, after in pairwise(ids))
    assert ascends([pa.array(["a", "b"]), pa.array([], pa.string()), pa.array(["b"])])
    assert not ascends([pa.array(["a", "c", "b"])]) and not ascends([pa.array(["b"]), pa.array(["a"])])


POOLS: list[pa.MemoryPool] = []
"""What was allocated must be freed where it came from."""


def peaks(out: Path, assets: int, kept: list[AssetRecord] | None = None) -> tuple[float, float]:
    """Peaks of Python's and of Arrow's memory, bytes, while records are read from their files and published; ``kept``
    collects the whole records."""
    run, ids = night(1), [f"{number:05}" for number in range(assets)]
    jobs = {}
    for asset_id in ids:
        record = rich(asset_id)
        keep_record(out, KeptRecord(run_id=run.run_id, redo=Redo.CHANGED, record=record))
        jobs[asset_id] = Job(record.ref, record.content_hash)
    pool = pa.proxy_memory_pool(pa.system_memory_pool())
    POOLS.append(pool)
    before = pa.default_memory_pool()
    pa.set_memory_pool(pool)
    gc.collect()
    tracemalloc.start()
    try:
        with lock_output(out), open_parts(out, run) as held:
            keep = (lambda record: None) if kept is None else kept.append
            harvest = Harvest(out, run.run_id, Settings(), keep, held.add)
            for job in jobs.values():
                take_result(harvest, job, None)
            write_parts(out, run, held, tuple(harvest.records.values()))
        return tracemalloc.get_traced_memory()[1], float(pool.max_memory())
    finally:
        tracemalloc.stop()
        pa.set_memory_pool(before)


def measured_peaks(out: Path) -> dict[str, tuple[tuple[float, float], int]]:
    """Peaks and assets of a few and of many assets, kept as summaries and whole; in small parts."""
    parts.PART_ROWS, parts.BATCH_ROWS, parts.MOST_OPEN, parts.ROW_GROUP = 2_000, 100, 4, 2_000
    peaks(out / "warm", 5)
    measured = {name: (peaks(out / name, assets), assets) for name, assets in (("few", 20), ("many", 80))}
    return measured | {
        name: (peaks(out / name, assets, []), assets) for name, assets in (("whole", 10), ("wholes", 40))
    }


def test_a_night_takes_hardly_more_memory_for_four_times_the_assets(tmp_path: Path) -> None:
    """Python's and Arrow's own counts: they depend on no machine and on no load. In a process of its own, since
    Python counts for all threads, and other tests leave some behind."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        measured = pool.submit(measured_peaks, tmp_path).result()
    size = record_file(tmp_path / "many", f"{1:0>64}").stat().st_size
    assert size > 25_000

    def grown(small: str, large: str) -> list[float]:
        (before, few), (after, many) = measured[small], measured[large]
        return [(more - less) / (many - few) for less, more in zip(before, after, strict=True)]

    assert max(grown("few", "many")) < 0.15 * size, f"{grown('few', 'many')} bytes an asset of {size} bytes"
    assert len(read_table(tmp_path / "many", "findings")) == 150 * 80
    assert grown("whole", "wholes")[0] > 0.5 * size, "whole records are not seen by this test"
