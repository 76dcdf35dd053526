"""The comparison's rows, tables and charts, from objects with stated numbers."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from PIL import Image

from asset2sim.catalog.read import query
from asset2sim.catalog.run import start_run
from asset2sim.catalog.write import write_run
from asset2sim.checks.alignment.expectations import met_expectation
from lab.comparisons.charts import growth_chart
from lab.comparisons.comparison import compare, large_set_section, write_comparison, write_page
from lab.comparisons.comparison_rows import OUTCOMES, failure_rows, figure_rows, growth_rows
from lab.comparisons.figure_specs import COST, STABILITY, SUCCESS, TABLE_1, stated
from lab.comparisons.first_table import first_table
from lab.comparisons.markdown import (
    agreement_sentences,
    failure_table,
    fewer_objects,
    figure_table,
    meaning_table,
    stability_tables,
)
from lab.comparisons.meaning import apart_table, experts_apart
from lab.comparisons.method_runs import NO_MODEL, MethodRun
from lab.comparisons.object_rows import NO_REFERENCE, read_objects
from lab.pages.blocks import markers
from schemas.alignment import Expectation
from schemas.asset import AssetRecord, AssetRef
from schemas.model_names import described
from schemas.settings import ModelSettings, Settings, Thresholds
from schemas.table import Row
from schemas.vocabulary import FailureMode, Method
from tests.assets import ROOT
from tests.factories import make_alignment, make_call, make_failure, make_measurement, make_record

MODEL = "prior/noisy"


def one(method: Method, asset_id: str, model: str = MODEL, /, **changes: object) -> dict[str, object]:
    fields: dict[str, object] = {
        "method": method.value, "model": model, "asset_id": asset_id, "category": "Box", "subset": None, "ok": True,
        "failure_mode": "none", "paper_failure_mode": None, "penetration_mm": 0.0, "drift_passes": True,
        "oscillation_passes": True, "paper_tests_pass": True, "alignment": 1.0, "judged": np.nan,
        "scale_deviation": 0.1, "joint_deviation_rad": 0.2, "calls": 1, "tokens": 100, "cost_usd": 0.01, "seconds": 2.0,
        "meaning": np.nan, "size_met": None, "joints_asked": None, "joints_met_at_start": None, "joints_met": None,
    }  # fmt: skip
    return fields | changes


def failed(mode: str, paper: str) -> dict[str, object]:
    return {"ok": False, "failure_mode": mode, "paper_failure_mode": paper, "paper_tests_pass": False}


OBJECTS = pd.DataFrame(
    [
        one(Method.DIRECT, "1", penetration_mm=4.0, scale_deviation=0.5, alignment=0.5),
        one(Method.DIRECT, "2", penetration_mm=2.0, category="Stapler", joint_deviation_rad=np.nan, calls=3,
            **failed("penetration", "invalid penetration state")),
        one(Method.DIRECT, "3", penetration_mm=np.nan, scale_deviation=np.nan, alignment=np.nan, drift_passes=False,
            **failed("model_error", "no valid parameter estimate")),
        one(Method.ASSET2SIM, "1", penetration_mm=1e-9), one(Method.ASSET2SIM, "2", category="Stapler"),
        one(Method.ASSET2SIM, "3", penetration_mm=0.5, seconds=8.0),
        one(Method.RAW, "1", NO_MODEL, calls=0, scale_deviation=3.0, penetration_mm=9.0),
    ]
)  # fmt: skip


MODEL_NAME = described(MODEL)


def found(rows: list[Row], method: Method, figure: str) -> Row:
    return next(row for row in rows if row["method"] == method.value and row["figure"] == figure)


def test_figures_by_hand() -> None:
    rows = figure_rows(OBJECTS, (*STABILITY, *SUCCESS, *COST), "paper9")
    direct = {str(row["figure"]): row for row in rows if row["method"] == "direct"}
    assert direct["penetration"]["value"] == pytest.approx(3.0) and direct["penetration"]["n"] == 2
    assert direct["penetration_others"]["value"] == pytest.approx(4.0)
    assert direct["scale"]["value"] == pytest.approx(30.0) and direct["joint"]["n"] == 2
    # What never came to an overlay is aligned with nothing; what was not measured passes nothing.
    assert direct["rubric"]["value"] == pytest.approx(50.0) and direct["drift"]["value"] == pytest.approx(200 / 3)
    assert direct["success"]["value"] == pytest.approx(100 / 3) and direct["calls"]["value"] == pytest.approx(5 / 3)
    ours = found(rows, Method.ASSET2SIM, "penetration_nonzero")
    assert ours["value"] == pytest.approx(0.5), "what is rounding counts as zero"
    assert (ours["paper"], ours["paper_spread"]) == (12.83, 18.14)


def test_those_of_the_papers_large_set_stand_for_themselves() -> None:
    objects = OBJECTS.assign(subset=["paper93", "extra", "", "paper93", "extra", "", "paper93"])
    section = large_set_section(compare(objects, None, "pybullet"), MODEL)
    assert section[0] == "Of these, the 1 that are of the paper's 93:"
    direct = next(line for line in section[1].splitlines() if line.startswith("| direct VLM"))
    assert direct.split("|")[2].strip().startswith("100.0") and "paper 97.5" in section[1], "object 1 alone passed"
    for alone in (compare(objects, "paper93", "pybullet"), compare(OBJECTS, None, "pybullet")):
        assert large_set_section(alone, MODEL) == []


def expected(meaning: float, size: bool | None, asked: int, start: int, rest: int) -> dict[str, object]:
    counts = {"joints_asked": asked, "joints_met_at_start": start, "joints_met": rest}
    return {"meaning": meaning, "size_met": size, **counts}


def test_the_rubric_speaks_only_where_nobody_wrote_what_to_expect() -> None:
    objects = pd.DataFrame(
        [
            one(Method.ASSET2SIM, "1", alignment=1.0, **expected(0.75, True, 4, 3, 2)),
            one(Method.ASSET2SIM, "2", alignment=1.0, **expected(0.0, False, 1, 1, 0)),
            one(Method.ASSET2SIM, "3", alignment=0.6), one(Method.ASSET2SIM, "4", alignment=np.nan),
            one(Method.RAW, "1", NO_MODEL, **expected(0.0, False, 4, 0, 0)),
        ]
    )  # fmt: skip
    rows = figure_rows(objects, STABILITY, None)
    alignment, rubric = (found(rows, Method.ASSET2SIM, key) for key in ("alignment", "rubric"))
    assert (alignment["value"], alignment["n"]) == (pytest.approx(37.5), 2)
    assert (rubric["value"], rubric["n"]) == (pytest.approx(30.0), 2)
    table = meaning_table(objects, MODEL).splitlines()
    assert table[2:] == ["| **ours** | 1 of 2 | 4 of 5 | 2 of 5 | 2 |", "| as it came | 0 of 1 | 0 of 4 | 0 of 4 | 1 |"]
    assert meaning_table(OBJECTS, MODEL) == ""


def test_the_first_table_says_who_proposed_and_what_readers_expect() -> None:
    objects = pd.DataFrame(
        [
            one(Method.ASSET2SIM, "1", **expected(0.75, True, 2, 2, 1)),
            one(Method.ASSET2SIM, "2", scale_deviation=0.5, **failed("drift", "x")),
            one(Method.ASSET2SIM, "1", "recorded/answers", joint_deviation_rad=0.404, calls=3, penetration_mm=2.0),
            one(Method.CONSTANT, "1", NO_MODEL, calls=0),
        ]
    )  # fmt: skip
    tables = [
        [[cell.strip() for cell in line.strip("|").split("|")] for line in part.splitlines()[2:]]
        for part in first_table(objects, "paper9", "pybullet").split("\n\n")[1::2]
    ]
    first, beside = tables
    assert first[0][1:] == [MODEL_NAME, "1 of 2", "1", "1 of 1", "2 of 2", "1 of 2"]
    assert first[1][1:3] == ["recorded/answers", "1 of 1"] and first[1][4:] == ["–", "–", "–"]
    assert first[2][:2] == ["one constant scale, a tenth open", "–"] and len(first) == 3
    assert beside[0][1:] == [MODEL_NAME, "0", "100.0", "100.0", "30.0", "0.20", "**75.0 of 1**", "1.00"]
    assert beside[1][2:] == ["2.00 of 1", "100.0", "100.0", "10.0", "0.40", "–", "**3.00**"], "0.404 is 0.40 as shown"
    papers = {row[0]: row[1:] for row in beside[3:]}
    assert papers["ours, the paper"] == ["Gemini 2.5 Flash", "12.83", "100.0", "100.0", "32.7", "0.40", "97.2", "2.26"]
    assert papers["ours, the paper's 80 of 93"][1:4] == ["11.65", "97.5", "98.8"]
    assert len(papers) == 9 and papers["human reference, the paper"][0] == "–"
    said = first_table(objects, "paper9", "pybullet").split("\n\n")[2]
    assert said.endswith("the paper's own: alignment %, as readers expect; calls.")
    assert "Gemini" not in first_table(objects, None, "pybullet"), "the paper's figures are of its nine"


def test_an_agent_without_a_model_is_called_scripted() -> None:
    for model, name in ((MODEL, "scripted agent"), ("gemini/x", "coding agent")):
        objects = pd.DataFrame([one(method, "1", model) for method in (Method.ASSET2SIM, Method.AGENT)])
        text = stability_tables(figure_rows(objects, STABILITY, None), model)
        assert text.count(f"| {name} |") == 2


def test_differences_are_over_the_objects_that_both_have() -> None:
    rows = figure_rows(OBJECTS, STABILITY, None)
    direct = found(rows, Method.DIRECT, "penetration")
    assert direct["difference"] == pytest.approx(3.0) and direct["n_paired"] == 2
    assert found(rows, Method.ASSET2SIM, "penetration")["difference"] is None
    raw = found(rows, Method.RAW, "penetration")
    assert raw["difference"] == pytest.approx(9.0) and raw["n_paired"] == 1, "without a model: beside the first one"


def test_first_is_whom_nobody_beats_and_cost_is_no_race() -> None:
    rows = figure_rows(OBJECTS, (*STABILITY, *COST), None)
    assert found(rows, Method.ASSET2SIM, "penetration")["first"] and not found(rows, Method.DIRECT, "scale")["first"]
    assert found(rows, Method.ASSET2SIM, "oscillation")["first"] and found(rows, Method.DIRECT, "oscillation")["first"]
    assert not any(row["first"] for row in rows if row["figure"] in {figure.key for figure in COST})
    worse = OBJECTS.assign(penetration_mm=np.where(OBJECTS["method"] == "raw", 0.0, OBJECTS["penetration_mm"]))
    assert not found(figure_rows(worse, STABILITY, None), Method.ASSET2SIM, "penetration")["first"]


def test_what_an_expert_gave_is_not_measured_against_the_expert() -> None:
    objects = pd.concat([OBJECTS, pd.DataFrame([one(Method.REFERENCE, "1", NO_MODEL, scale_deviation=0.0)])])
    rows = figure_rows(objects, STABILITY, None)
    assert found(rows, Method.REFERENCE, "scale")["value"] is None
    assert found(rows, Method.REFERENCE, "drift")["value"] == 100.0
    assert found(rows, Method.ASSET2SIM, "scale")["first"]


def test_outcomes_go_by_the_paper_s_names_and_add_up() -> None:
    rows = [row for row in failure_rows(OBJECTS) if row["method"] == "direct"]
    assert [row["outcome"] for row in rows] == list(OUTCOMES)
    counts = {row["outcome"]: row["assets"] for row in rows if row["assets"]}
    assert counts == {"ok": 1, "invalid penetration state": 1, "no valid parameter estimate": 1}
    assert sum(float(str(row["share_percent"])) for row in rows) == pytest.approx(100.0)
    assert [json.loads(str(row["failure_modes"])) for row in rows if row["outcome"] == "invalid penetration state"] == [
        {"penetration": 1}
    ]


def test_the_paper_s_figures_are_of_the_set_that_was_run() -> None:
    nine, large = (stated(subset, Method.ASSET2SIM, "penetration_nonzero") for subset in ("paper9", None))
    assert nine is not None and large is not None and (nine.value, large.value) == (12.83, 11.65)
    assert stated("paper9", Method.RAW, "drift") is None and stated(None, Method.IVW, "calls") is not None
    keys = {figure.key for figure in STABILITY}
    assert all(keys.issuperset(figures) for figures in TABLE_1.values())


# Markdown


def test_cells_hold_value_interval_and_the_paper_s_figure_and_ours_is_bold_where_first() -> None:
    lines = figure_table(figure_rows(OBJECTS, STABILITY, "paper9"), STABILITY, MODEL).splitlines()
    assert [line.split("|")[1].strip() for line in lines[2:]] == ["direct VLM", "**ours**", "as it came"]
    ours = [cell.strip() for cell in lines[3].split("|")]
    assert ours[2].startswith("**0.17**<br><sub>[0.00, 0.50]</sub>")
    assert ours[3] == "**0.50**<br><sub>[0.00, 0.50]</sub><br><sub>paper 12.83 ± 18.14</sub>"
    assert len({line.count("|") for line in lines}) == 1
    many = OBJECTS.assign(tokens=2593)
    assert "| 2\u202f593<br>" in figure_table(figure_rows(many, COST, None), COST, MODEL), "no line break in a number"


def test_differences_that_leave_zero_out_are_bold_and_signed() -> None:
    text = stability_tables(figure_rows(OBJECTS, STABILITY, None), MODEL)
    assert "| +3.00<br><sub>[2.00, 4.00]</sub>" in text and "| −33.3<br>" in text, "two objects make nobody sure"
    more = [one(method, f"more{n}", penetration_mm=deep) for n in range(3)
            for method, deep in ((Method.DIRECT, 3.0), (Method.ASSET2SIM, 0.0))]  # fmt: skip
    rows = figure_rows(pd.concat([OBJECTS, pd.DataFrame(more)]), STABILITY, None)
    assert "**+3.00**<br>" in stability_tables(rows, MODEL)


def test_the_table_of_outcomes_has_a_column_for_each_way_to_fail() -> None:
    lines = failure_table(failure_rows(OBJECTS), figure_rows(OBJECTS, SUCCESS, None), MODEL).splitlines()
    row = dict(zip(*([cell.strip() for cell in line.split("|")] for line in (lines[0], lines[2])), strict=True))
    assert row["success %"].startswith("33.3") and row["invalid penetration state %"] == "33.3"
    assert row["segmentation problem %"] == "0"


def test_agreement_is_told_where_there_was_a_judge() -> None:
    assert agreement_sentences(OBJECTS) == []
    judged = OBJECTS.assign(judged=[0.5, 0.9, 0.1, 1.0, 1.0, 0.8, np.nan])
    (sentence,) = agreement_sentences(judged)
    assert sentence.startswith("Rubric and judge differ by 0.06 on average over 5 assets (Pearson ")


# Growth


def growing() -> pd.DataFrame:
    models = ("prior/noisy@4", "prior/noisy", "prior/noisy@0")
    rows = [
        one(
            method, str(number), model, ok=not (method is Method.DIRECT and number < place), scale_deviation=0.1 * place
        )
        for method in (Method.DIRECT, Method.ASSET2SIM)
        for place, model in zip((2, 1, 0), models, strict=True)
        for number in range(4)
    ]
    return pd.DataFrame([*rows, *(one(Method.RAW, str(number), NO_MODEL, ok=number == 0) for number in range(4))])


def test_growth_goes_by_level_and_what_asks_no_model_stays() -> None:
    rows = growth_rows(growing())
    success = {
        method: [(row["level"], row["value"]) for row in rows if row["method"] == method and row["figure"] == "success"]
        for method in ("direct", "raw")
    }
    assert success["direct"] == [(0.0, 100.0), (1.0, 75.0), (4.0, 50.0)]
    assert success["raw"] == [(0.0, 25.0), (1.0, 25.0), (4.0, 25.0)]
    assert growth_rows(OBJECTS) == []


# Everything, from catalogs


def refined(method: Method, record: AssetRecord) -> AssetRecord:
    return record.model_copy(update={"method": method, "model": MODEL})


def test_objects_are_read_from_the_latest_run_of_each_folder(tmp_path: Path) -> None:
    run = MethodRun(Method.ASSET2SIM, MODEL, tmp_path)
    settings = Settings(model=ModelSettings(model=MODEL))
    ref = AssetRef(asset_id="1", path="x")
    calls = (make_call(), make_call(cached=True, outcome="cached"), make_call(purpose="judge"))
    exploded = make_measurement(finite=False, drift_m=0.0, drift_rad=0.0)
    records = [
        make_record("1", ref=ref, calls=calls),
        make_record("2", measurement=exploded, alignment=make_alignment(reference_states_scale=False)),
        make_failure("3", FailureMode.MODEL_ERROR),
    ]
    write_run(tmp_path, start_run(settings, "data"), [refined(Method.ASSET2SIM, make_record("old"))])
    write_run(tmp_path, start_run(settings, "data"), [refined(Method.ASSET2SIM, record) for record in records])
    rows = read_objects([run], Thresholds()).set_index("asset_id")
    assert list(rows.index) == ["1", "2", "3"]
    assert rows["calls"].tolist() == [2, 2, 0], "cached calls count, the judge's do not"
    assert rows["tokens"].tolist() == [2400, 2400, 0]
    assert rows["drift_passes"].tolist() == [True, False, False] == rows["oscillation_passes"].tolist()
    assert rows["alignment"].tolist()[:2] == [0.75, 0.75] and rows["alignment"].isna()["3"]
    assert rows.loc["1", "scale_deviation"] == 0.25 and rows["scale_deviation"].isna()["2"]
    assert rows.loc["3", "paper_failure_mode"] == "no valid parameter estimate"


def test_an_object_for_which_no_expert_chose_is_left_out_and_not_failed(tmp_path: Path) -> None:
    run = MethodRun(Method.REFERENCE, NO_MODEL, tmp_path)
    failures = [make_failure("2", FailureMode.NO_VALID_ESTIMATE, NO_REFERENCE), make_failure("3", FailureMode.DRIFT)]
    records = [refined(Method.REFERENCE, record) for record in (make_record("1"), *failures)]
    write_run(tmp_path, start_run(Settings(), "data"), records)
    rows = read_objects([run], Thresholds())
    assert rows["asset_id"].tolist() == ["1", "3"]
    both = pd.concat([rows, pd.DataFrame([one(Method.DIRECT, name) for name in ("1", "2", "3")])])
    assert fewer_objects(both).endswith("left out: human reference 2 of 3.") and fewer_objects(rows) == ""


def test_exemptions_of_the_reset_check_are_counted_by_the_words_of_its_verdicts(tmp_path: Path) -> None:
    sql = (ROOT / "lab/comparisons/exempt.sql").read_text(encoding="utf-8")
    verdicts = (ROOT / "asset2sim/checks/reset.py").read_text(encoding="utf-8")
    words = set(re.findall(r"LIKE '%(.+?)%'", sql))
    assert len(words) == 2 and all(word in verdicts for word in words)
    write_run(tmp_path, start_run(Settings(), "data"), [make_record("1")])
    assert query(tmp_path, sql).empty


def expecting(record: AssetRecord, *wanted: Expectation) -> AssetRecord:
    return record.model_copy(update={"expected": tuple(met_expectation(record, item) for item in wanted)})


def test_expectations_are_read_from_every_run_and_experts_are_held_to_them(tmp_path: Path) -> None:
    size = Expectation(what="size", ranges=((90.0, 99.0),), unit="cm", why="a big box", lines=(2,))
    hinge = Expectation(what="hinge", ranges=((0.0, 0.2), (2.0, 2.1)), unit="rad", why="ajar", lines=(3,))
    slider = hinge.model_copy(update={"what": "slider", "ranges": ((3.0, 4.0),), "unit": "m"})
    swings = hinge.model_copy(update={"unit": "swings", "swings": True})
    base = make_record("1")
    assert base.overlay is not None
    joints = tuple(joint.model_copy(update={"asked_position": None}) for joint in base.overlay.joints)
    expert = base.model_copy(update={"overlay": base.overlay.model_copy(update={"joints": joints})})
    records = {
        "1": expecting(expert, size, hinge, slider),
        "2": expecting(make_record("2"), swings),
        "3": expecting(make_failure("3", FailureMode.MODEL_ERROR), size, hinge),
        "4": expecting(make_record("4"), Expectation(what="none", lines=(9,))),
        "5": make_record("5"),
    }
    run = MethodRun(Method.REFERENCE, MODEL, tmp_path)
    settings = Settings(method=Method.REFERENCE, model=ModelSettings(model=MODEL))
    write_run(tmp_path, start_run(settings, "data"), [refined(Method.REFERENCE, item) for item in records.values()])
    rows = read_objects([run], Thresholds()).set_index("asset_id")
    assert rows["meaning"].fillna(-1.0).to_dict() == {"1": 0.25, "2": 1.0, "3": 0.0, "4": -1.0, "5": -1.0}
    counts = rows[["joints_asked", "joints_met_at_start", "joints_met"]].fillna(-1)
    assert counts.loc[["1", "2", "3", "5"]].to_numpy().tolist() == [[2, 1, 1], [1, 1, 1], [1, 0, 0], [-1, -1, -1]]
    assert rows["size_met"].fillna(True).to_dict() == {"1": False, "2": True, "3": False, "4": True, "5": True}
    # The expert gave a scale alone: of the joints none is an expert's choice.
    (apart,) = experts_apart([run])
    assert (apart["asset_id"], apart["what"], apart["start"]) == ("1", "size", 25.0)
    assert apart_table([apart]).splitlines()[2] == "| 1 | size | 25 | 90 to 99 | cm | a big box |"
    assert experts_apart([MethodRun(Method.ASSET2SIM, MODEL, tmp_path)]) == [] and apart_table([]) == ""


def test_a_comparison_leaves_tables_charts_a_report_and_the_readme_s_section(tmp_path: Path) -> None:
    objects = growing()
    run = MethodRun(Method.RAW, MODEL, tmp_path / "raw" / NO_MODEL)
    comparison = compare(objects, None, "pybullet")
    report = write_comparison(tmp_path, [run], comparison).read_text(encoding="utf-8")
    for name in ("objects", "stability", "success", "failures", "cost", "growth"):
        table = pq.read_table(tmp_path / "tables" / f"{name}.parquet")
        assert (table.num_rows and "value" in table.column_names) or name in ("objects", "failures")
    assert report.count("simulation of a fallible model") >= 4 and "`raw/none`" in report
    page = tmp_path / "README.md"
    page.write_text("\nstale\n".join(markers("compare")).join(["before\n", "\nafter\n"]), encoding="utf-8")
    write_page(page, tmp_path, comparison)
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before\n") and text.endswith("after\n") and "stale" not in text
    assert "simulation of a fallible model" in text
    for name in ("failures", "growth"):
        picture = tmp_path / f"compare_{name}.png"
        assert f"(compare_{name}.png)" in text and picture.stat().st_size < 300_000
        assert Image.open(picture).size[0] == 1600


def test_a_scale_error_that_dwarfs_the_others_is_drawn_by_factors(tmp_path: Path) -> None:
    objects = growing()
    objects["scale_deviation"] = np.where(objects["model"] == "prior/noisy@4", 50.0, objects["scale_deviation"] + 0.1)
    assert growth_chart(growth_rows(objects), tmp_path / "growth.png", "growth").stat().st_size > 10_000
