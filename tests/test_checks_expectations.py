"""Expectations by hand: reading, either-or, swings, units, and what never came to an overlay."""

import math
import shutil
from pathlib import Path

import pytest

from asset2sim.catalog.rows_engines import expectation_rows
from asset2sim.catalog.run_figures import expected_counts, run_figures
from asset2sim.catalog.summarize import summarize_all
from asset2sim.catalog.summary import alignment_line, expected_line
from asset2sim.checks.alignment.expectations import FILE, met_expectation, read_expectations, unknown_assets
from schemas.alignment import Expectation, Expected
from schemas.asset import AssetRecord
from schemas.errors import UsageError
from schemas.settings import Thresholds
from schemas.vocabulary import Engine, FailureMode, Method
from tests.assets import RAW, sample
from tests.factories import held, make_failure, make_measurement, make_motion, make_record, make_report
from tests.methods_runs import run, settings_of

HEADER = "asset_id,what,low,high,unit,why\n"
TURN = 2.0 * math.pi


def written(folder: Path, *lines: str, header: str = HEADER) -> Path:
    file = folder / FILE
    file.write_text(header + "".join(f"{line}\n" for line in lines), encoding="utf-8")
    return file


def stated(what: str, low: float, high: float, unit: str) -> Expectation:
    return Expectation(what=what, ranges=((low, high),), unit=unit, swings=unit == "swings", lines=(2,))


def placed(hinge: float, slider: float = 0.0, rests: tuple[float, ...] = ()) -> AssetRecord:
    """A cube of 1 m at scale 0.25, whose hinge settles at ``rests`` in PyBullet and MuJoCo, its slider at 0.1 m."""
    record = make_record("1")
    assert record.overlay is not None
    at = {"hinge": hinge, "slider": slider}
    joints = tuple(joint.model_copy(update={"initial_position": at[joint.name]}) for joint in record.overlay.joints)
    reports = []
    for engine, rest in zip((Engine.PYBULLET, Engine.MUJOCO), rests, strict=False):
        motions = (make_motion("hinge").model_copy(update={"final_position": rest}), make_motion("slider"))
        reports.append(make_report(engine, measurement=make_measurement(engine=engine.value, joints=motions)))
    overlay = record.overlay.model_copy(update={"joints": joints})
    return record.model_copy(update={"overlay": overlay, "reports": tuple(reports)})


def verdicts(found: Expected) -> tuple[bool | None, bool | None]:
    return found.at_start, found.at_rest


# Reading


def test_a_dataset_without_expectations_has_none(tmp_path: Path) -> None:
    assert read_expectations(tmp_path / FILE) == {}


def test_lines_for_the_same_joint_are_either_or(tmp_path: Path) -> None:
    lines = ["bag,handle,-1.6,-1,swings,left", "box,none,,,,flaps", "bag,handle,1,1.6,swings,right", "bag,size,8,9,cm,"]
    found = read_expectations(written(tmp_path, *lines))
    handle, size = found["bag"]
    assert handle.ranges == ((-1.6, -1.0), (1.0, 1.6)) and handle.swings and handle.why == "left; right"
    assert handle.lines == (2, 4) and (size.what, size.unit) == ("size", "cm")
    assert found["box"] == (Expectation(what="none", why="flaps", lines=(3,)),)


@pytest.mark.parametrize(
    ("lines", "header", "message"),
    [
        (["1,lid,0,1,rad,"], HEADER.replace("what", "waht"), "line 1: no column 'what'; did you mean 'waht'?"),
        (["1,size,5,9,cn,"], HEADER, "line 2: unit 'cn' of size; did you mean 'cm'?"),
        (["1,lid,0,1,deg,"], HEADER, "line 2: unit 'deg' of lid; choose from: m, rad, swings"),
        (["1,size,5,9,cm,", "1,lid,some,1,rad,"], HEADER, "line 3: low 'some' is no number"),
        (["1,lid,nan,1,rad,"], HEADER, "low 'nan' is no number"),
        (["1,lid,1,0,rad,"], HEADER, "low 1 is above high 0"),
        (["1,,0,1,rad,"], HEADER, "line 2: no what"), ([",lid,0,1,rad,"], HEADER, "line 2: no asset_id"),
        (["1,lid,0,1,rad,wide, open"], HEADER, "more cells than columns"),
        (["1,lid,0,1,rad,", "1,lid,0,1,swings,"], HEADER, "line 3: unit 'swings' of lid, which line 2 has in rad"),
        (["1,none,0,1,rad,"], HEADER, "unit 'rad' of none"),
    ],
)  # fmt: skip
def test_a_mistake_names_file_line_and_the_nearest_name(
    tmp_path: Path, lines: list[str], header: str, message: str
) -> None:
    file = written(tmp_path, *lines, header=header)
    with pytest.raises(UsageError) as caught:
        read_expectations(file)
    assert str(file) in str(caught.value) and message in str(caught.value)


def test_an_unknown_asset_is_named_with_its_line_and_the_nearest(tmp_path: Path) -> None:
    found = read_expectations(written(tmp_path, "laptop_silvr,size,30,40,cm,", "box,size,8,35,cm,"))
    (warning,) = unknown_assets(found, ["laptop_silver", "box"])
    assert warning == f"{FILE}, line 2: asset 'laptop_silvr' is not in the dataset; did you mean 'laptop_silver'?"


# Meeting


@pytest.mark.parametrize(("low", "high", "met"), [(20.0, 30.0, True), (25.0, 26.0, True), (26.0, 30.0, False)])
def test_the_size_is_the_longest_edge_with_all_closed(low: float, high: float, met: bool) -> None:
    found = met_expectation(placed(0.0), stated("size", low, high, "cm"))
    assert verdicts(found) == (met, None) and found.start == pytest.approx(25.0)


def test_a_joint_is_met_at_rest_in_every_engine_or_not_at_all() -> None:
    want = stated("hinge", 0.2, 0.4, "rad")
    assert verdicts(met_expectation(placed(0.3, rests=(0.3, 0.39)), want)) == (True, True)
    fell = met_expectation(placed(0.3, rests=(0.3, 0.0)), want)
    assert verdicts(fell) == (True, False) and (fell.rest, fell.rest_engine) == (0.0, "mujoco")
    assert verdicts(met_expectation(placed(0.5, rests=(0.3, 0.3)), want)) == (False, True)
    assert verdicts(met_expectation(placed(0.3), want)) == (True, None), "what no engine measured is not known"


def test_an_engine_that_exploded_or_crashed_meets_nothing() -> None:
    record = placed(0.3, rests=(0.3,))
    for broken in (make_measurement(finite=False), None):
        report = make_report(Engine.MUJOCO, measurement=broken)
        found = met_expectation(
            record.model_copy(update={"reports": (*record.reports, report)}), stated("hinge", 0.2, 0.4, "rad")
        )
        assert verdicts(found) == (True, False) and found.rest is None and found.reason == "mujoco measured no rest"


def test_either_range_will_do_and_whole_turns_do_not_count() -> None:
    either = Expectation(what="hinge", ranges=((-0.4, -0.3), (0.3, 0.4)), unit="rad", lines=(2,))
    for at, met in ((0.35, True), (-0.35, True), (0.0, False), (0.35 - TURN, True), (0.35 + TURN, True)):
        assert met_expectation(placed(at), either).at_start is met
    assert met_expectation(placed(0.35 + TURN), either).start == pytest.approx(0.35)
    assert met_expectation(placed(5.0), stated("hinge", -6.3, 6.3, "swings")).start == 5.0


def test_what_swings_is_held_to_its_start_alone_in_its_own_unit() -> None:
    for what, record in (("hinge", placed(0.3, rests=(9.0, 9.0))), ("slider", placed(0.0, slider=0.3 * 0.25))):
        assert verdicts(met_expectation(record, stated(what, 0.2, 0.4, "swings"))) == (True, None)


def test_a_slider_is_counted_at_scale_one() -> None:
    # 0.1 m measured, at a scale of 0.25.
    found = met_expectation(placed(0.0, slider=0.05, rests=(0.0,)), stated("slider", 0.39, 0.41, "m"))
    assert verdicts(found) == (False, True) and [found.start, found.rest] == pytest.approx([0.2, 0.4])


def test_what_never_came_to_an_overlay_meets_nothing_and_is_not_lost() -> None:
    wanted = (stated("size", 1.0, 90.0, "cm"), stated("hinge", 0.0, 1.0, "rad"), Expectation(what="none", lines=(4,)))
    record = held(make_failure("1", FailureMode.MISSING_MESH), None, *wanted)
    assert [verdicts(item) for item in record.expected] == [(False, None), (False, False), (None, None)]
    assert expected_counts(summarize_all([record])) == {
        "sizes": (0, 1),
        "joints at the start": (0, 1),
        "joints at rest": (0, 1),
    }


def test_a_line_that_fits_no_joint_is_a_finding_and_no_verdict() -> None:
    wanted = (stated("hinges", 0.0, 1.0, "rad"), stated("hinge", 0.0, 1.0, "m"), stated("anchor", 0.0, 1.0, "swings"))
    record = held(placed(0.3), None, *wanted)
    assert all(verdicts(item) == (None, None) for item in record.expected)
    messages = [item.message for item in record.findings if item.code == "expectation_unfit"]
    assert messages == [
        f"{FILE}, line 2: 'hinges' is no joint of this object that moves; did you mean 'hinge'?",
        f"{FILE}, line 2: joint 'hinge' is stated in m, and its positions are in rad",
        f"{FILE}, line 2: 'anchor' is no joint of this object that moves; choose from: hinge, slider",
    ]
    assert record.status is make_record("1").status


# What users see


def test_rows_figures_and_the_line_count_what_is_asked() -> None:
    wanted = (stated("size", 20.0, 30.0, "cm"), stated("hinge", 0.2, 0.4, "rad"), stated("slider", 0.9, 1.0, "swings"))
    records = [held(placed(0.3, rests=(0.3, 0.0)), None, *wanted), make_record("2")]
    rows = expectation_rows({}, records[0])
    assert [(row["what"], row["met_at_start"], row["met_at_rest"]) for row in rows] == [
        ("size", True, None), ("hinge", True, False), ("slider", False, None),
    ]  # fmt: skip
    assert rows[1]["lows"] == [0.2] and (rows[1]["rest"], rows[1]["rest_engine"]) == (0.0, "mujoco")
    summaries = summarize_all(records)
    figures = run_figures(summaries, Thresholds())
    assert figures["expected_sizes_share"] == 1.0 and figures["expected_joints_at_the_start_share"] == 0.5
    assert expected_line(summaries) == (
        "as its readers expect: sizes 1 of 1, joints at the start 1 of 2, joints at rest 0 of 2"
    )
    # The rubric speaks for the object without expectations alone.
    assert alignment_line(summaries).startswith("prompt alignment by rubric 75.0 % over 1 assets;")
    assert alignment_line(summaries[:1]).startswith("prompt alignment by rubric: every asset has expectations instead;")
    assert expected_line(summaries[1:]) == ""


# Blindness


@pytest.mark.system
@pytest.mark.parametrize("method", [Method.ASSET2SIM, Method.REFERENCE])
def test_no_model_rule_or_search_sees_an_expectation(tmp_path: Path, method: Method) -> None:
    """The same questions, the same overlay and the same refined files, with absurd expectations beside the asset."""
    results = []
    for name in ("without", "with"):
        data = tmp_path / name / "data"
        shutil.copytree(RAW / "Box" / "box_wooden", data / "Box" / "box_wooden")
        shutil.copy(RAW / "manifest.csv", data)
        (data / "reference.csv").write_text(
            "asset_id,category,gensim2_task,scale,joint,joint_position\nbox_wooden,Box,box_rotate,0.3,joint_0,0.4\n"
        )
        if name == "with":
            for folder in (data, data / "Box", data / "Box" / "box_wooden"):
                written(folder, "box_wooden,size,300,400,cm,a wardrobe", "box_wooden,joint_0,1.4,1.5,rad,wide open")
        out = tmp_path / name / "out"
        ref = sample("box_wooden", data)
        record, requests = run(ref, out, settings_of(method))
        assert record.overlay is not None
        files = {
            file.relative_to(out).as_posix(): file.read_bytes()
            for file in sorted((out / "assets").rglob("*"))
            if file.suffix in (".urdf", ".obj") or file.name == "overlay.json"
        }
        assert files
        results.append((record.overlay, [item.model_dump() for item in requests], files))
    assert results[0] == results[1]


def test_only_the_yardstick_s_own_readers_import_it() -> None:
    root = Path(__file__).resolve().parents[1]
    rooms = [*(root / "asset2sim").iterdir(), root / "tasks", root / "flows"]
    users = {
        room.name
        for room in rooms
        for file in ([room] if room.is_file() else room.rglob("*.py"))
        if file.suffix == ".py" and "expectations" in file.read_text(encoding="utf-8")
    }
    # A run brings them, for its plan and for the stage that holds an asset against them; a report shows how they were
    # met. Of what proposes, bounds or refines nothing reads them.
    assert users <= {"catalog", "checks", "report", "runs", "flows", "tasks"} and "checks" in users
    stages = {file.name for file in (root / "tasks").glob("*.py") if "expectations" in file.read_text()}
    assert stages == {"align.py"}
