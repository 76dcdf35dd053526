"""The failure-mode breakdown."""

import io
from pathlib import Path

import pytest
from rich.console import Console

from asset2sim.catalog.failures import failure_breakdown, render_failures
from asset2sim.catalog.run import start_run
from asset2sim.catalog.write import write_run
from schemas.errors import UsageError
from schemas.settings import Settings
from schemas.vocabulary import FailureMode
from tests.factories import MODEL, make_failure, make_record


def rendered(out: Path) -> str:
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(render_failures(failure_breakdown(out)))
    return console.export_text()


def test_counts_shares_causes_and_examples(tmp_path: Path) -> None:
    records = [make_record(f"{i}") for i in range(6)]
    records += [make_failure(f"m{i}", FailureMode.MISSING_MESH, "mesh_absent") for i in range(3)]
    records += [make_failure("t", FailureMode.TIMEOUT, "time_limit")]
    write_run(tmp_path, start_run(Settings(), "data"), records)
    found = failure_breakdown(tmp_path).set_index("failure_mode")
    assert found.index.tolist() == ["none", "missing_mesh", "timeout"]
    assert found["assets"].tolist() == [6, 3, 1]
    assert found["share_percent"].tolist() == pytest.approx([60.0, 30.0, 10.0])
    assert found.loc["missing_mesh", "causes"] == "mesh_absent ×3"
    assert found.loc["missing_mesh", "paper_failure_mode"] == "segmentation problem"
    assert found["example_asset_ids"].iloc[0].tolist() == ["0", "1", "2", "3", "4"]
    text = rendered(tmp_path)
    assert "none (ok)" in text and "60.0" in text and "time_limit ×1" in text and MODEL in text
    assert found.loc["missing_mesh", "reason"] == "mesh_absent: cannot go on"
    assert "reason of the" in text and "mesh_absent: cannot" in text and "time_limit: cannot" in text
    assert not isinstance(found.loc["timeout", "paper_failure_mode"], str), "the paper has no name for it"


def test_models_are_counted_apart(tmp_path: Path) -> None:
    write_run(tmp_path, start_run(Settings(), "data"), [make_record("1"), make_record("2")])
    write_run(tmp_path, start_run(Settings(), "data"), [make_failure("1", FailureMode.DRIFT, model="other/model")])
    found = failure_breakdown(tmp_path)
    assert found[["model", "failure_mode", "assets", "share_percent"]].values.tolist() == [
        ["other/model", "drift", 1, 100.0],
        [MODEL, "none", 2, 100.0],
    ]
    assert "other/model" in rendered(tmp_path)


def test_without_a_catalog_it_is_the_user_s_mistake(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no catalog"):
        failure_breakdown(tmp_path)
