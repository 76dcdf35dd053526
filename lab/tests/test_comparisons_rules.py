from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from asset2sim.catalog.text import percent
from lab.comparisons.rules import OURS, PAPER, RAW, engine_results, rules_table, settings_of
from lab.flows.compare import main
from lab.pages.blocks import markers, with_block
from schemas.errors import UsageError
from schemas.settings import Settings, Thresholds
from schemas.vocabulary import CollisionMode, DynamicsRule, Method


def measured(asset_id: str, /, engine: str = "pybullet", **changes: object) -> dict[str, object]:
    fields: dict[str, object] = {
        "asset_id": asset_id, "engine": engine, "penetration_mm": 0.0, "drift_m": 1e-4, "drift_rad": 1e-3,
        "oscillating_joints": 0, "finite": True, "passed": True,
    }  # fmt: skip
    return fields | changes


def verdict_of(asset_id: str, test: str, passed: bool | None, engine: str = "pybullet") -> dict[str, object]:
    return {"asset_id": asset_id, "engine": engine, "test": test, "passed": passed}


def of(assets: list[str], rows: list[dict[str, object]], tests: list[dict[str, object]] | None = None) -> pd.DataFrame:
    columns = ["asset_id", "engine", "test", "passed"]
    frame = pd.DataFrame(tests or [], columns=columns)
    return engine_results(pd.DataFrame({"asset_id": assets}), pd.DataFrame(rows), frame, Thresholds())


def row_of(table: str, engine: str, rules: str) -> dict[str, str]:
    """One row of the table by its headings."""
    split = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    return next(dict(zip(split[0], cells, strict=True)) for cells in split[2:] if cells[:2] == [engine, rules])


def test_what_an_engine_refuses_or_nobody_measured_passes_nothing() -> None:
    found = of(["1", "2", "3"], [measured("1"), measured("2", penetration_mm=None, drift_m=None, passed=False)])
    assert list(found["loaded"]) == [True, False, False]
    row = row_of(rules_table({RAW: found}), "pybullet", RAW)
    assert (row["objects"], row["loads"], row["drift"], row["oscillation"]) == ("3", "33.3 %", "33.3 %", "33.3 %")
    assert row["every test"] == "33.3 %" and row["Φ mm"] == "0" and row["drop"] == "–"


def test_penetration_is_the_mean_over_those_not_zero() -> None:
    found = of(["1", "2", "3"], [measured("1", penetration_mm=2.0), measured("2", penetration_mm=1.0), measured("3")])
    assert row_of(rules_table({RAW: found}), "pybullet", RAW)["Φ mm"] == "1.5"


@pytest.mark.parametrize(
    ("changes", "heading"),
    [
        ({"drift_m": 1.1e-3}, "drift"), ({"drift_rad": 1.1e-2}, "drift"), ({"drift_m": None}, "drift"),
        ({"oscillating_joints": 1}, "oscillation"), ({"finite": False}, "oscillation"),
        ({"passed": False}, "every test"),
    ],
)  # fmt: skip
def test_each_figure_fails_by_its_own_bound(changes: dict[str, Any], heading: str) -> None:
    row = row_of(rules_table({OURS: of(["1"], [measured("1", **changes)])}), "pybullet", OURS)
    assert {key for key in ("drift", "oscillation", "every test") if row[key] == "0 %"} == {heading}


def test_a_test_passes_where_all_its_subjects_do_or_none_applies() -> None:
    tests = [
        verdict_of("1", "drop", True), verdict_of("1", "drop", False), verdict_of("1", "jam", True),
        verdict_of("1", "opening", None),
        verdict_of("2", "drop", True),
    ]  # fmt: skip
    row = row_of(rules_table({OURS: of(["1", "2"], [measured("1"), measured("2")], tests)}), "pybullet", OURS)
    assert (row["drop"], row["sweep"], row["hold"]) == ("50.0 %", "100 %", "100 %")


def test_an_object_whose_interaction_was_not_run_does_not_pass_where_others_were() -> None:
    tests = [verdict_of("1", "drop", True)]
    row = row_of(rules_table({OURS: of(["1", "2"], [measured("1"), measured("2")], tests)}), "pybullet", OURS)
    assert (row["drop"], row["nudge"]) == ("50.0 %", "50.0 %")


def test_engines_and_rules_keep_their_order() -> None:
    both = [measured("1", "mujoco"), measured("1", "pybullet")]
    table = rules_table({RAW: of(["1"], both[:1]), OURS: of(["1"], both)})
    assert [line.split("|")[1:3] for line in table.splitlines()[2:]] == [
        [" pybullet ", " ours "], [" mujoco ", " raw "], [" mujoco ", " ours "]
    ]  # fmt: skip


def test_shares_are_whole_only_where_they_are() -> None:
    assert [percent(3, 3), percent(0, 1), percent(2999, 3000), percent(1, 3000), percent(0, 0)] == [
        "100 %", "0 %", "99.9 %", "0.1 %", "0 %"
    ]  # fmt: skip


def test_the_three_ways_differ_in_what_they_say() -> None:
    ways = settings_of(Settings())
    assert list(ways) == [RAW, PAPER, OURS]
    assert ways[RAW].method is Method.RAW and ways[OURS] == Settings()
    paper = ways[PAPER]
    assert paper.physics.dynamics is DynamicsRule.PAPER and paper.collision.mode is CollisionMode.KEEP
    assert paper.search.mend_rounds == 0 and paper.thresholds == Settings().thresholds


def test_the_table_goes_between_the_markers() -> None:
    begin, end = markers("rules")
    text = f"before\n{begin}\nold\n{end}\nafter\n"
    assert with_block(text, "rules", "| a |") == f"before\n{begin}\n\n| a |\n\n{end}\nafter\n"
    with pytest.raises(UsageError, match="lacks the lines"):
        with_block("nothing", "rules", "")


def test_mistakes_end_with_two(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["rules", "raw"]) == 2 and "required: OUT" in capsys.readouterr().err
    assert main(["rules", str(tmp_path), str(tmp_path / "out"), str(tmp_path / "README.md")]) == 2
    assert "no page at" in capsys.readouterr().err
    assert main(["rules", str(tmp_path), str(tmp_path / "out")]) == 2 and not (tmp_path / "out").exists()
