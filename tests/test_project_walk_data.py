"""data.md as a researcher walks through it with objects of their own: see ``tests.walks``."""

import json
from pathlib import Path

import pytest

from tests.walks import RESEARCHER, fresh


@pytest.mark.system
def test_the_researcher(ready: list[str], prefect_server: str, tmp_path: Path) -> None:
    made = fresh(tmp_path, PREFECT_API_URL=prefect_server).at_hand(ready)
    made.walk(*RESEARCHER)
    overlay = json.loads((made.folder / "one/assets/laptop_silver/overlay.json").read_text(encoding="utf-8"))
    assert "0.3" in json.dumps(overlay), "30 cm wide"
