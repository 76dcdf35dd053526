"""The lists that published figures rest on: whoever has the meshes can measure the same objects by the same words."""

import csv
from pathlib import Path

import pytest

from asset2sim.checks.alignment.expectations import read_expectations
from asset2sim.models.answers import strict_fit
from asset2sim.models.gateway.recorded import check_recorded
from asset2sim.models.lenient_json import parse_json
from schemas.overlay import Overlay
from tests.assets import ROOT, SHARED

LISTS = ROOT / "lab" / "lists"
MEASURED = SHARED / "partnet_mobility"


def objects() -> list[dict[str, str]]:
    with (LISTS / "objects.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_150_objects_each_once_with_the_words_that_were_asked() -> None:
    rows = objects()
    assert len(rows) == len({row["asset_id"] for row in rows}) == 150 and all(row["prompt"] for row in rows)
    assert sum(row["subset"] == "paper9" for row in rows) == 9
    assert all(row["path"] == f"{row['category']}/{row['asset_id']}" for row in rows)


def test_what_readers_expect_is_of_60_of_them_and_each_line_says_why() -> None:
    expected = read_expectations(LISTS / "expectations.csv")
    assert len(expected) == 60 and set(expected) <= {row["asset_id"] for row in objects()}
    assert all(item.why for items in expected.values() for item in items)


def test_the_answers_are_of_the_papers_nine_and_a_recorded_model() -> None:
    files = {file.stem: file for file in (LISTS / "answers").glob("*.json") if file.stem != "recording"}
    assert set(files) == {row["asset_id"] for row in objects() if row["subset"] == "paper9"}
    for file in files.values():
        assert strict_fit(Overlay, parse_json(file.read_text(encoding="utf-8"))).scale > 0.0
    assert check_recorded(f"recorded/{LISTS / 'answers'}").startswith("9 recorded answers")


@pytest.mark.skipif(not MEASURED.is_dir(), reason="../shared/partnet_mobility is absent")
@pytest.mark.parametrize(
    ("listed", "measured"),
    [("objects.csv", "manifest.csv"), ("expectations.csv", "expectations.csv"), ("answers", "../vlm_answers")],
)
def test_the_lists_are_those_of_the_objects_that_are_measured(listed: str, measured: str) -> None:
    def content(place: Path) -> dict[str, list[bytes]]:
        files = place.glob("[0-9]*.json") if place.is_dir() else [place]
        return {file.name if place.is_dir() else "": file.read_bytes().splitlines() for file in files}

    assert content(LISTS / listed) == content(MEASURED / measured)
