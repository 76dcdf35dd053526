"""Empty databases of other programs: kept once, copied as they were made, and never half or over another."""

import sqlite3
from contextlib import closing
from functools import partial
from pathlib import Path

import pytest
from mlflow.version import VERSION

from asset2sim.catalog.mlflow_log import DATABASE, open_mlflow
from asset2sim.storage.empty_databases import copy_empty, keep_empty
from flows.server.server import temporary_server
from tests.prefect_server import answers
from tests.processes import wait_until


def shape(file: Path) -> list[tuple[str, ...]]:
    """The schema of a database and the version of its migrations."""
    with closing(sqlite3.connect(file)) as opened:
        made = opened.execute("SELECT type, name, sql FROM sqlite_master ORDER BY type, name").fetchall()
        return made + opened.execute("SELECT version_num FROM alembic_version").fetchall()


def test_a_copied_store_is_as_the_one_that_was_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    monkeypatch.setenv("ASSET2SIM_CACHE", str(tmp_path / "my cache"))
    kept = tmp_path / "my cache" / "empty" / f"mlflow-{VERSION}.db"
    shapes, places, moments = [], [], []
    for name in ("first", "second one"):
        out = tmp_path / name
        out.mkdir()
        monkeypatch.chdir(out)
        with open_mlflow(out) as client:
            places.append([(found.name, found.artifact_location) for found in client.search_experiments()])
        shapes.append(shape(out / DATABASE))
        moments.append(kept.stat().st_mtime_ns)
    assert shapes[0] == shapes[1] and moments[0] == moments[1]
    assert places == [[("Default", str(tmp_path / name / "mlruns" / "0"))] for name in ("first", "second one")]


def test_what_is_not_whole_is_made_anew_and_nothing_is_written_over(tmp_path: Path) -> None:
    made, kept, copy = tmp_path / "made.db", tmp_path / "cache" / "kept.db", tmp_path / "copy.db"
    with closing(sqlite3.connect(made)) as opened:
        opened.execute("CREATE TABLE t (x)")
        opened.execute("INSERT INTO t VALUES (1)")
        opened.commit()
    assert not copy_empty(kept, copy)
    keep_empty(made, kept, "DELETE FROM t")
    assert not copy_empty(kept, made), "another run's database was written over"
    assert copy_empty(kept, copy)
    with closing(sqlite3.connect(copy)) as opened:
        assert opened.execute("SELECT count(*) FROM t").fetchone() == (0,)
    copy.unlink()
    for broken in (b"", b"half"):
        kept.write_bytes(broken * 2000)
        assert not copy_empty(kept, copy) and not copy.exists()
    keep_empty(made, kept)
    assert copy_empty(kept, copy)


def test_a_cache_that_cannot_be_written_costs_only_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    (tmp_path / "file").touch()
    monkeypatch.setenv("ASSET2SIM_CACHE", str(tmp_path / "file"))
    with open_mlflow(tmp_path) as client:
        assert [found.name for found in client.search_experiments()] == ["Default"]


@pytest.mark.system
def test_a_second_prefect_server_begins_with_a_copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    monkeypatch.setenv("ASSET2SIM_CACHE", str(tmp_path / "my cache"))
    shapes = []
    for name in ("first", "second one"):
        monkeypatch.setenv("PREFECT_HOME", str(tmp_path / name))
        with temporary_server() as address:
            assert address is not None and wait_until(partial(answers, address), 300.0)
        shapes.append(shape(tmp_path / name / "prefect.db"))
    (kept,) = (tmp_path / "my cache" / "empty").iterdir()
    assert shapes == [shape(kept)] * 2
    with closing(sqlite3.connect(kept)) as opened:
        assert opened.execute("SELECT count(*) FROM configuration").fetchone() == (0,)
