"""nightly.md as an engineer walks through it, on a server that stays: see ``tests.walks``."""

from pathlib import Path

import pandas as pd
import pytest

from tests.walks import ENGINEER, SAMPLES, fresh


@pytest.mark.system
def test_the_engineer(ready: list[str], prefect_server: str, tmp_path: Path) -> None:
    made = fresh(tmp_path, PREFECT_API_URL=prefect_server).at_hand(ready)
    folder, said = made.folder, made.walk(*ENGINEER)
    assert (folder / "alert.txt").read_text(encoding="utf-8").startswith("done") or "ok" in said[0]
    assert "exit code 3" in said[1] and "exit code 130" in said[1]
    assets = pd.read_parquet(folder / "nights/catalog/assets.parquet")
    assert set(assets["asset_id"]) == set(SAMPLES)
