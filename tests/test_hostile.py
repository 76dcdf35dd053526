"""The study of hostile inputs: that it sees what is wrong, and a part of its cases."""

import sqlite3
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from schemas.errors import MISTAKE
from tests.hostile.case import CANARY, Case
from tests.hostile.commands import Ended
from tests.hostile.left_behind import holding, listing
from tests.hostile.tiny import asset
from tests.hostile.try_cases import _said, cases_of, kind_names, sample, try_kind


def test_there_are_hundreds_of_cases_each_of_a_name_of_its_own() -> None:
    assert {"files", "links", "names", "encodings", "structure", "manifests"} <= set(kind_names())
    assert sum(len(cases_of(kind)) for kind in kind_names()) >= 500


def test_what_leaks_is_found_in_tables_databases_names_and_links(tmp_path: Path) -> None:
    (tmp_path / "clean.txt").write_text("nothing")
    assert holding(tmp_path, CANARY) == []
    pq.write_table(pa.table({"text": [CANARY] * 3}), tmp_path / "table.parquet", compression="zstd")
    with sqlite3.connect(tmp_path / "data.db") as database:
        database.execute("CREATE TABLE t (x TEXT)")
        database.execute("INSERT INTO t VALUES (?)", (CANARY,))
    (tmp_path / CANARY).mkdir()
    (tmp_path / CANARY / f"{CANARY}.txt").write_text("")
    (tmp_path / "link").symlink_to(CANARY)
    assert holding(tmp_path, CANARY) == sorted([f"{CANARY}/{CANARY}.txt", "data.db", "link", "table.parquet"])


def test_every_change_of_the_surroundings_shows(tmp_path: Path) -> None:
    changes: list[Callable[[Path], object]] = [
        lambda path: path.write_text("b"),
        lambda path: path.unlink(),
        lambda path: path.symlink_to("x"),
        lambda path: (path.parent / "new").mkdir(),
    ]
    (tmp_path / "file").write_text("a")
    for change in changes:
        before = listing(tmp_path)
        change(tmp_path / "file")
        assert listing(tmp_path) != before


def test_a_traceback_a_key_and_a_hang_are_problems() -> None:
    assert not _said(Ended(MISTAKE, "", "asset2sim: no dataset\n"))
    for code, said in ((1, "Traceback (most recent call last):\n"), (0, CANARY), (0, "\x1b[31m"), (124, "")):
        assert _said(Ended(code, "", said))


@pytest.fixture
def start(ready: list[str], prefect_server: str, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The first words of commands that are ready, and use the server."""
    monkeypatch.setenv("PREFECT_API_URL", prefect_server)
    return ready


@pytest.mark.system
def test_a_command_that_does_what_it_must_not_is_seen(start: list[str], tmp_path: Path) -> None:
    good = Case("good", asset(), says="nothing says that")
    (outcome,) = try_kind(
        "lines", [Case("no_data", lambda place: place.data.rmdir(), says="no dataset at")], tmp_path / "a", start
    )
    assert not outcome.problems and outcome.ended == "exit 2"
    (outcome,) = try_kind(
        "lines", [Case("no_data", lambda place: place.data.rmdir(), says=good.says)], tmp_path / "b", start
    )
    assert "says: " in outcome.problems[0]


@pytest.mark.system
def test_a_sample_of_all_kinds_is_handled(start: list[str], tmp_path: Path) -> None:
    cases = sample(13)
    assert len(cases) >= 30 and any(not case.modes for case in cases)
    wrong = [outcome for outcome in try_kind("sample", cases, tmp_path / "sample", start) if outcome.problems]
    assert not wrong, "\n".join(map(str, wrong))


@pytest.mark.system
def test_damaged_outputs_and_what_is_not_believed_are_told(
    start: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a terminal that lacks most letters.
    monkeypatch.setenv("PYTHONIOENCODING", "ascii")
    cases = [*cases_of("outputs"), *(case for case in cases_of("numbers") if case.finds)]
    wrong = [outcome for outcome in try_kind("told", cases, tmp_path / "told", start) if outcome.problems]
    assert not wrong, "\n".join(map(str, wrong))
