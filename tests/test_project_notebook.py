"""The notebook of the documentation runs from top to bottom, and shows what it says."""

import shutil
from ast import literal_eval
from pathlib import Path

import pytest

from lab.pages.notebook import run_notebook
from tests.assets import ROOT
from tests.walks import command_at_hand

PAGE = ROOT / "docs/try.ipynb"


@pytest.mark.system
def test_the_notebook_runs_and_the_drawer_is_pulled(
    tmp_path: Path, prefect_server: str, ready: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PREFECT_API_URL", prefect_server)
    shutil.copytree(ROOT / "data/raw/Table", tmp_path / "data/raw/Table")
    ran = run_notebook(PAGE, tmp_path, command_at_hand(tmp_path / "programs", ready))
    results = [output for cell in ran.cells for output in cell.get("outputs", ())]
    printed = "".join(output.text for output in results if output.output_type == "stream")
    assert "0 of 1 ok" in printed and "1 of 1 ok" in printed, "as it came, and as refined"
    assert str(tmp_path) not in printed and "\x1b" not in printed
    assert any("image/png" in output.get("data", {}) for output in results)
    alone, less_than_friction, more = literal_eval(results[-1].data["text/plain"]).values()
    assert alone == less_than_friction == 0.0 < 0.05 < more
