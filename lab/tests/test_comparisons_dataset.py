"""The table of whole datasets: every cell from a catalog whose objects are known."""

from pathlib import Path

import pytest

from asset2sim.catalog.run import start_run
from asset2sim.catalog.write import write_run
from asset2sim.checks.alignment.expectations import met_expectation
from lab.comparisons.dataset_table import BLOCK, dataset_table, main
from lab.pages.blocks import block_of, markers
from schemas.alignment import Expectation
from schemas.asset import AssetRef
from schemas.settings import Settings, Thresholds
from schemas.vocabulary import FailureMode
from tests.factories import make_failure, make_record

ASKED = (
    Expectation(what="size", ranges=((90.0, 99.0),), unit="cm", why="big", lines=(2,)),
    Expectation(what="hinge", ranges=((0.0, 0.2),), unit="rad", why="ajar", lines=(3,)),
    Expectation(what="slider", ranges=((0.0, 0.2),), unit="swings", swings=True, why="loose", lines=(4,)),
)


def write_two_sets(folder: Path) -> dict[str, Path]:
    """Two runs: of three objects, two of them in the subset of the paper's nine, and of one without expectations."""
    asked = make_record("1")
    asked = asked.model_copy(update={"expected": tuple(met_expectation(asked, item) for item in ASKED)})
    other = AssetRef(asset_id="3", path="dataset/3", prompt="a box")
    first = [asked, make_failure("2", FailureMode.DRIFT), make_record("3", ref=other)]
    outs = {"first": folder / "one", "second": folder / "two"}
    for out, records in zip(outs.values(), (first, [make_record("9", ref=other)]), strict=True):
        write_run(out, start_run(Settings(), "data"), records)
    return outs


def test_each_set_has_its_column_and_the_papers_nine_come_first(tmp_path: Path) -> None:
    table = dataset_table(write_two_sets(tmp_path), Thresholds())
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    rows = {cells[0]: cells[1:] for cells in lines}
    assert rows[""] == ["the paper's nine", "first", "second"]
    assert rows["objects"] == ["2", "3", "1"]
    assert rows["ok: every test in mujoco, pybullet"] == ["**1 of 2**", "**2 of 3**", "**1 of 1**"]
    assert rows["size as readers expect it, who wrote it down before any result"] == ["0 of 1", "0 of 1", "–"]
    still = "asked joints at rest as they expect them, in every engine"
    assert rows[still][1].startswith("1 of 1; with those that may swing") and rows[still][2] == "–"
    assert rows["drift within 1 mm and 0.01 rad"][1:] == ["2, 2 of 3", "1, 1 of 1"]
    assert rows["Φ at the start, mean and most"][2] == "0.50 and 0.50 mm"


def test_the_block_is_written_and_a_folder_without_a_run_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.md"
    page.write_text("\n".join(markers(BLOCK)), encoding="utf-8")
    named = [f"{name}={out}" for name, out in write_two_sets(tmp_path).items()]
    assert main([str(page), *named]) == 0
    assert "**2 of 3**" in (block_of(page.read_text(encoding="utf-8"), BLOCK) or "")
    assert main([str(page), f"none={tmp_path / 'none'}"]) == 2
    assert "no catalog in" in capsys.readouterr().err
