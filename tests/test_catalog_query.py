"""SQL over the tables: from Python, from the command line, and what a mistake in it says."""

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from asset2sim.catalog.query import connect
from asset2sim.catalog.read import query, read_table
from asset2sim.catalog.stored_tables import check_catalog
from asset2sim.catalog.write import write_run
from flows.command import run_command
from schemas.errors import UsageError
from schemas.tables import PUBLISHED, TABLES
from schemas.vocabulary import FailureMode
from tests.factories import make_failure, make_record
from tests.test_catalog_history import night


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two nights of two assets, one of which breaks."""
    folder = tmp_path_factory.mktemp("it's out")
    write_run(folder, night(1), [make_record("a"), make_record("b")])
    write_run(folder, night(2), [make_record("a"), make_failure("b", FailureMode.MISSING_MESH, "[mesh] lost")])
    return folder


def told(arguments: list[str], out: Path, capsys: pytest.CaptureFixture[str], code: int = 0) -> str:
    def never(request: object) -> object:
        raise AssertionError("no flow must start")

    assert run_command([*arguments, "--out", str(out)], refine=never, nightly=never) == code  # type: ignore[arg-type]
    captured = capsys.readouterr()
    return captured.err if code else captured.out


def test_three_lines_of_python(out: Path) -> None:
    tables = connect(str(out))
    found = tables.sql("SELECT asset_id, count(*) AS nights FROM asset_history GROUP BY ALL ORDER BY ALL").fetchall()
    assert found == [("a", 2), ("b", 2)]


def test_every_published_table_goes_by_its_name(out: Path, tmp_path: Path) -> None:
    with connect(out) as tables:
        for name, table in PUBLISHED.items():
            assert tables.sql(f"FROM {name}").columns == table.schema.names
        assert tables.sql("SELECT max(started_at)::VARCHAR FROM asset_history").fetchall() == [
            ("2026-11-02 02:00:00+00",)
        ]
    write_run(tmp_path, night(1), [make_record("a")])
    (tmp_path / "catalog" / "alignment.parquet").unlink()
    (tmp_path / "history" / "month=2026-11" / f"{night(1).run_id}.parquet").unlink()
    with connect(tmp_path) as tables:
        for name in ("alignment", "asset_history"):
            relation = tables.sql(f"FROM {name}")
            assert relation.columns == PUBLISHED[name].schema.names and relation.fetchall() == []


def test_a_new_run_is_seen_by_a_connection_that_is_open(tmp_path: Path) -> None:
    write_run(tmp_path, night(1), [make_record("a")])
    with connect(tmp_path) as tables:
        write_run(tmp_path, night(1, 12), [make_record("a"), make_record("b")])
        assert tables.sql("SELECT count(*) FROM assets").fetchall() == [(2,)]
        assert tables.sql("SELECT count(*) FROM asset_history").fetchall() == [(3,)]


@pytest.mark.parametrize(
    ("sql", "words"),
    [
        ("SELECT colour FROM assets", ['"colour" not found', "category"]),
        ("SELECT * FROM asset", ["Table with name asset does not exist", "choose from: alignment, asset_history"]),
        ("SELECT a.colour FROM assets AS a", ["colour"]),
        ("SELEC 1", ["syntax error"]),
        ("SELECT 1; SELECT colour FROM runs", ["colour"]),
        ("", ["nothing"]),
    ],
)
def test_a_mistake_is_one_line_that_names_what_there_is(
    out: Path, sql: str, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    said = told(["query", sql], out, capsys, code=2)
    assert said.count("\n") == 1 and said.startswith("asset2sim: the query failed: ")
    for word in words:
        assert word in said


def test_the_answer_is_a_table_or_comma_separated(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sql = "SELECT asset_id, scale, reason FROM assets ORDER BY asset_id"
    shown = told(["query", sql], out, capsys)
    assert "0.25" in shown and "[mesh] lost: cannot go on" in shown and "–" in shown
    assert told(["query", sql, "--csv"], out, capsys).splitlines() == [
        "asset_id,scale,reason",
        "a,0.25,within every threshold",
        "b,,[mesh] lost: cannot go on",
    ]
    assert "asset_id" in told(["query", f"{sql} LIMIT 0"], out, capsys)


def test_failures_since_by_and_between_runs(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    since = told(["failures", "--since", "2026-11-01"], out, capsys)
    assert "all runs since 2026-11-01" in since and "missing_mesh" in since and "2026-11-02" in since
    assert "no failures" in told(["failures", "--since", "2026-11-03"], out, capsys)
    assert "Box" in told(["failures", "--by", "category"], out, capsys)
    changed = told(["failures", "--compare", "previous", "latest"], out, capsys)
    assert "1 broke" in changed and "missing_mesh" in changed and "[mesh] lost" in changed
    assert "nothing changed" in told(["failures", "--compare", "latest", "latest"], out, capsys)
    assert "unknown run 'x'" in told(["failures", "--compare", "x", "latest"], out, capsys, code=2)


def test_without_a_catalog_it_is_the_user_s_mistake(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no catalog in"):
        connect(tmp_path)


def test_every_column_can_be_asked_for_without_quotes(out: Path) -> None:
    for name, table in PUBLISHED.items():
        columns = table.schema.names
        assert list(query(out, f"SELECT {', '.join(columns)} FROM {name} LIMIT 1").columns) == columns


def test_a_column_that_an_older_version_did_not_write_is_null_in_its_rows(tmp_path: Path) -> None:
    write_run(tmp_path, night(1), [make_record("a")])
    assets = tmp_path / "catalog" / TABLES["assets"].file
    pq.write_table(pq.read_table(assets).drop_columns(["refined_path"]), assets)
    check_catalog(tmp_path)
    write_run(tmp_path, night(2), [make_failure("b", FailureMode.MISSING_MESH)])
    assert read_table(tmp_path, "assets")["refined_path"].isna().all()
    write_run(tmp_path, night(3), [make_record("a")])
    assert read_table(tmp_path, "assets").set_index("asset_id")["refined_path"].fillna("").to_dict() == {
        "a": "assets/a",
        "b": "",
    }
