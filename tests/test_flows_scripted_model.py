"""The command with a model behind a real server: labelled views in every question, and an object that passes."""

import json
from pathlib import Path

import pytest

from asset2sim.catalog.read import read_table
from tests.commands import one_after_the_other
from tests.marks import OBJECTS, needs_objects
from tests.scripted_server import scripted

pytestmark = [pytest.mark.system, needs_objects]

CHOSEN = "19179"
"""A cabinet, whose drawers overlap what is around them as they are drawn: a model is asked for its state as well."""
VIEWS = ["perspective", "front", "left", "back", "parts", "parts_open"]
STATE_VIEWS = ["perspective", "front", "right", "top"]


def test_an_object_of_the_paper_with_a_model_that_looks(
    tmp_path: Path, prefect_server: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, out = tmp_path / "requests.jsonl", tmp_path / "out"
    for name in ("OPENAI_API_KEY", "OPENAI_API_BASE"):
        monkeypatch.delenv(name, raising=False)
    with scripted(log=log) as server:
        words = [
            "refine", str(OBJECTS), "--out", str(out), "--subset", "paper9", "--assets", CHOSEN,
            "--model", "openai/scripted", "--api-base", server.api_base, "--engines", "pybullet",
            "--proposer", "model", "--no-interaction", "--no-views", "--workers", "1", "--strict",
        ]  # fmt: skip
        one_after_the_other([words], prefect_server)
    rows = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    purposes = [row["purpose"] for row in rows if row["asset_id"] == CHOSEN]
    assert purposes == ["synthesis", *["refinement"] * (len(rows) - 1)] and len(rows) >= 2
    for row in rows:
        labels = VIEWS if row["purpose"] == "synthesis" else STATE_VIEWS
        assert [image["label"] for image in row["images"]] == labels, row["purpose"]
        assert all(200 <= image["width"] <= 512 and image["bytes"] > 1000 for image in row["images"])
    calls = read_table(out, "model_calls")
    assert len(calls) == len(rows) and set(calls["outcome"]) == {"ok"}
    assets = read_table(out, "assets").set_index("asset_id")
    assert dict(assets["status"]) == {CHOSEN: "ok"} and set(assets["model"]) == {"openai/scripted"}
