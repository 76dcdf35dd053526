"""The five questions: each asks in words, runs on a catalog, answers with rows, and stands in the documentation."""

from pathlib import Path

import pandas as pd
import pytest

from asset2sim.catalog.read import query
from asset2sim.catalog.write import write_run
from lab.pages.blocks import FOLDER, QUESTIONS, frame_table, markers, question, questions_block
from schemas.vocabulary import FailureMode
from tests.assets import ROOT
from tests.factories import make_failure, make_record
from tests.test_catalog_history import night


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two nights: an asset breaks, another is mended, and one takes long to measure."""
    folder = tmp_path_factory.mktemp("out")
    slow = make_record("slow", seconds={"extract": 1.0, "measure": 99.5})
    write_run(folder, night(1), [make_record("breaks"), make_failure("mended", FailureMode.JAM), slow])
    write_run(folder, night(2), [make_failure("breaks", FailureMode.DRIFT), make_record("mended"), slow])
    return folder


def answer(out: Path, name: str) -> list[tuple[object, ...]]:
    return list(query(out, question(name)[1]).itertuples(index=False, name=None))


def test_every_file_is_a_question_and_runs(out: Path) -> None:
    assert {path.stem for path in (ROOT / FOLDER).glob("*.sql")} == set(QUESTIONS)
    for name in QUESTIONS:
        assert question(name)[0].endswith("?")
        assert answer(out, name), name


def test_the_answers_are_right(out: Path) -> None:
    assert [row[:3] for row in answer(out, "modes")] == [("none", 2, 66.7), ("drift", 1, 33.3)]
    assert answer(out, "changes") == [("breaks", "Box", "none", "drift"), ("mended", "Box", "jam", "none")]
    calls = answer(out, "calls")
    assert calls == [("prior", "overlay", 2, 0, 2400, 0.02), ("prior", "state", 2, 2, 0, 0.0)]
    assert answer(out, "slowest")[0] == ("slow", "Box", 100.5, "measure", 99.5, 2)
    assert answer(out, "weak")[0][:3] == ("Box", 3, 1)


def test_the_documentation_asks_them_all_and_names_files_that_exist(out: Path) -> None:
    begin, end = markers("questions")
    block = (ROOT / "docs/catalog.md").read_text(encoding="utf-8").split(begin, 1)[1].split(end, 1)[0]
    columns = questions_block(out)
    for name in QUESTIONS:
        heading, _, _ = frame_table(query(out, question(name)[1])).partition("\n")
        assert question(name)[0] in block and heading in block and heading in columns, "stale: run make questions"
        assert f"(`{FOLDER}/{name}.sql`)" in block


def test_a_cell_is_never_more_than_text() -> None:
    frame = pd.DataFrame({"a": ["x|y", None], "n": [1.5, None]})
    assert frame_table(frame).splitlines() == ["| a | n |", "| --- | ---: |", "| x\\|y | 1.5 |", "| – | – |"]
