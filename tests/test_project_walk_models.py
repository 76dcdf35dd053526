"""models.md as a researcher walks through it, and install.md's conversion: see ``tests.walks``."""

from pathlib import Path

import pandas as pd
import pytest

from tests.walks import MODELS, fresh


@pytest.mark.system
def test_asking_models(ready: list[str], prefect_server: str, tmp_path: Path) -> None:
    made = fresh(tmp_path, PREFECT_API_URL=prefect_server).at_hand(ready)
    made.walk(*MODELS)
    folder = made.folder
    assert pd.read_parquet(folder / "asked/catalog/model_calls.parquet")["model"].eq("openai/scripted").all()
    asked, again = (folder / name / "assets/laptop_silver/overlay.json" for name in ("asked", "again"))
    assert again.read_bytes() == asked.read_bytes()
    assert (folder / "mine/questions/laptop_silver/front.png").is_file()
    converted = {path.suffix for path in (folder / "data/converted/assets/box_wooden").iterdir()}
    assert {".urdf", ".xml"} < converted and converted & {".usd", ".usda", ".usdc"}
