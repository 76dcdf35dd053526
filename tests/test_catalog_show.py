"""An asset and a run on a terminal: what the catalog knows, without escapes or endless cells."""

import io
import re
from pathlib import Path

import pytest
from rich.console import Console, Group, RenderableType

from asset2sim.catalog import summary
from asset2sim.catalog import text as shown
from asset2sim.catalog.run import start_run
from asset2sim.catalog.show import describe_asset
from asset2sim.catalog.summarize import summarize_all
from asset2sim.catalog.summary import summary_tables, totals_line
from asset2sim.catalog.text import NOTHING, markdown_table, significant
from asset2sim.catalog.write import write_run
from asset2sim.runs.spread.progress import Report
from flows.command import main
from schemas.asset import AssetRef
from schemas.errors import UnknownChoiceError, UsageError, exit_code_of, printable
from schemas.settings import Settings, Thresholds
from schemas.vocabulary import FailureMode, Status
from tests.factories import make_failure, make_measurement, make_motion, make_record, make_run_records


def text_of(renderable: RenderableType, width: int = 160) -> str:
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(renderable)
    return console.export_text()


def test_an_asset_is_shown_with_units_sources_thresholds_cost_and_files(tmp_path: Path) -> None:
    write_run(tmp_path, start_run(Settings(), "data"), [make_record("7")])
    views = tmp_path / "assets" / "7" / "views"
    views.mkdir(parents=True)
    (views / "front.png").touch()
    text = text_of(describe_asset(tmp_path, "7"))
    for expected in (
        "a small closed box", "scale 0.250 (user)", "mass 3 kg", "N·m·s/rad", "N·s/m", "0.500 mm", "2 mm",
        "link_completed",
        "0.90 sure", "hinge → 0.100", "prior/household", "1 model calls (1 more from the cache)", "extract 0.10",
        str(tmp_path / "assets" / "7"), "front.png", "pybullet 3.2.7", "alignment 0.750: the scale meets a small Box",
    ):  # fmt: skip
        assert expected in text.replace("\n", " ") or expected in text.replace("\n", ""), expected
    assert "fails" not in text


def test_what_further_checks_measured_is_a_line_where_they_were_run(tmp_path: Path) -> None:
    lifted = {"lifted": 0.75, "lifted_by": "gripper", "lifted_reason": "hand: it slips"}
    write_run(tmp_path, start_run(Settings(), "data"), [make_record("7", further=lifted), make_record("8")])
    text = text_of(describe_asset(tmp_path, "7"))
    assert "lifted     0.750, by gripper, reason hand: it slips" in text
    assert "gripper" not in text_of(describe_asset(tmp_path, "8"))


def test_a_figure_over_the_run_s_own_threshold_fails(tmp_path: Path) -> None:
    strict = Settings(thresholds=Thresholds(penetration_m=0.0001))
    write_run(tmp_path, start_run(strict, "data"), [make_record("7")])
    line = next(line for line in text_of(describe_asset(tmp_path, "7")).splitlines() if "penetration" in line)
    assert "0.100 mm" in line and "fails" in line


def test_an_asset_that_failed_early_and_text_that_looks_like_markup_are_shown(tmp_path: Path) -> None:
    write_run(tmp_path, start_run(Settings(), "data"), [make_failure("7", FailureMode.MISSING_MESH, "[bold]mesh[/]")])
    text = text_of(describe_asset(tmp_path, "7"))
    assert "failed: missing_mesh" in text and "not measured" in text and "[bold]mesh[/]" in text


def test_every_engine_has_a_line_with_its_tests_and_efforts(tmp_path: Path) -> None:
    write_run(tmp_path, start_run(Settings(), "data"), [make_record("7")])
    text = text_of(describe_asset(tmp_path, "7"), 160)
    (line,) = [line.split() for line in text.splitlines() if line.strip().startswith("mujoco")]
    assert line[:6] == ["mujoco", "1.0", "ok", "0.500", "0.000100", "0.00100"]
    assert line[6] == "2/2" and line[-1] == "0.40"
    effort = next(line for line in text.splitlines() if line.split() == ["hinge", "0.0100", "–"])
    assert effort and "Least effort" in text
    assert "not seen by default: parent and child" in text and "hull" in text


def test_every_model_that_refined_the_asset_is_shown(tmp_path: Path) -> None:
    write_run(tmp_path, start_run(Settings(), "data"), [make_record("7"), make_record("7", model="other/model")])
    text = text_of(describe_asset(tmp_path, "7"))
    assert "with other/model" in text and "with prior/household" in text


def test_an_unknown_id_names_the_closest(tmp_path: Path) -> None:
    write_run(tmp_path, start_run(Settings(), "data"), [make_record("cabinet_1"), make_record("stapler")])
    with pytest.raises(UnknownChoiceError, match=r"unknown asset 'cabinet1'; choose from: cabinet_1$"):
        describe_asset(tmp_path, "cabinet1")


@pytest.mark.parametrize("width", [100, 150])
def test_the_summary_keeps_every_number_at_every_width(width: int) -> None:
    records = [make_record(f"{100000 + i}", category="StorageFurniture") for i in range(147)]
    records[0] = make_failure("100000", FailureMode.INVALID_JOINT_CONFIGURATION)
    lines = text_of(Group(*summary_tables(summarize_all(records), Thresholds())), width).splitlines()
    assert "…" not in "\n".join(lines) and max(map(len, lines)) <= width
    shown = [line for line in lines if line.startswith("100")]
    assert len(shown) == 147 and shown[-1].startswith("100000") and "invalid_joint_configuration" in shown[-1]
    assert shown[0].split()[-8:] == ["0.250", "3", "0.500", "0.100", "0.0010", "2/2", "1", "2.1"]


def test_a_long_summary_is_several_tables_with_one_line_of_totals(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(summary, "PAGE", 50)
    records = summarize_all(
        make_failure(f"{i:03}", FailureMode.DRIFT) if i % 7 == 0 else make_record(f"{i:03}") for i in range(120)
    )
    tables = list(summary_tables(records, Thresholds()))
    assert [table.row_count for table in tables] == [50, 50, 20] and [bool(table.caption) for table in tables][:2] == [
        False,
        False,
    ]
    text = text_of(Group(*tables), 120)
    shown = [line.split()[0] for line in text.splitlines() if line[:3].isdigit() and " ok (" not in line]
    good = [record.ref.asset_id for record in records if record.status is Status.OK]
    assert shown == good + [record.ref.asset_id for record in records if record.status is not Status.OK]
    assert text.count("102 of 120 ok") == 1
    assert len(list(summary_tables((), Thresholds()))) == 1


def test_totals() -> None:
    wild = make_measurement(penetration_m=0.0, joints=(make_motion("hinge", 0.5, 9),))
    records = [*make_run_records(3, [FailureMode.TIMEOUT]), make_record("wild", measurement=wild)]
    totals = totals_line(summarize_all(records), Thresholds())
    assert "4 of 5 ok (80.0 %)" in totals and "mean over 3 not zero 0.500 mm" in totals and "oscillation 3/4" in totals
    assert totals_line([], Thresholds()) == "no assets"


def test_a_markdown_table_escapes_what_would_split_a_cell() -> None:
    table = markdown_table(("a", "n"), [("x|y", "1"), (r"x\|y", "two\nlines"), ("", NOTHING)], right=(1,))
    assert table.splitlines() == ["| a | n |", "| --- | ---: |", r"| x\|y | 1 |", r"| x\|y | two lines |", "|  | – |"]


@pytest.mark.parametrize(
    ("value", "shown"),
    [(None, "–"), (float("nan"), "–"), (0, "0"), (0.0, "0"), (2.0, "2"), (0.25, "0.250"), (1234.56, "1235"),
     (1.5e-7, "1.50e-07"), (3.2e8, "3.20e+08"), (-0.05, "-0.0500")],
)  # fmt: skip
def test_numbers(value: object, shown: str) -> None:
    assert significant(value) == shown


EVIL = "small\x1b]0;owned\x07\x1b[2J\x1b[31mred\x9b1m\u202eback"
_STYLE = re.compile("\x1b\\[[0-9;]*m")


def terminal(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """A terminal in the place of standard output."""
    file = io.StringIO()
    monkeypatch.setattr(file, "isatty", lambda: True)
    monkeypatch.setattr("sys.stdout", file)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "100")
    return file


def test_prompts_and_reasons_bring_no_escapes_to_a_terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ref = AssetRef(asset_id="a", path="x", prompt=EVIL + "y" * 100_000)
    records = [make_record("a", ref=ref, category=EVIL), make_failure("b", FailureMode.DRIFT, reason=EVIL)]
    write_run(tmp_path, start_run(Settings(), "data"), records)
    out = ["--out", str(tmp_path)]
    query = ["query", "SELECT prompt, reason, category FROM assets", *out]
    for words in (["show", "a", *out], ["show", "b", *out], ["failures", *out], query, [*query, "--csv"]):
        file = terminal(monkeypatch)
        assert main(words) == 0
        told = file.getvalue()
        plain = _STYLE.sub("", told)
        assert "]0;owned" in plain and not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202e]", plain), words
        assert len(told) < 20_000 or "--csv" in words


def test_a_program_gets_values_as_they_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ref = AssetRef(asset_id="a", path="x", prompt=EVIL)
    write_run(tmp_path, start_run(Settings(), "data"), [make_record("a", ref=ref)])
    assert main(["query", "SELECT prompt FROM assets", "--csv", "--out", str(tmp_path)]) == 0
    assert EVIL in capsys.readouterr().out


def test_errors_and_progress_are_printable_too(capsys: pytest.CaptureFixture[str]) -> None:
    def fail() -> int:
        raise UsageError(f"unknown subset '{EVIL}'")

    assert exit_code_of("asset2sim", fail) == 2
    assert "\x1b" not in capsys.readouterr().err
    report = Report(3)
    report.begun("slow")
    report.begun(f"x{EVIL}")
    report(make_record("slow"))
    report.begun("slow")
    report.begun("dead")
    report.waits("dead")
    line = report.line()
    assert line.startswith("refined 1 of 3 assets, 0 failed, 0 s; at work: x")
    assert "(0 s); 1 to be tried once more; slowest: slow (0 s)" in line and "dead" not in line
    assert "\x1b" not in line and printable("a\tb\nc – é 名") == "a\tb\nc – é 名"


def test_a_table_keeps_its_shape() -> None:
    console = shown.output()
    console.file = io.StringIO()
    table = shown.number_table("T", ("name", "n"), [("a\x1b[1mb", 1), ("x" * 9_000, 2)], left=1)
    console.print(table)
    lines = console.file.getvalue().splitlines()
    assert any("a[1mb" in line for line in lines) and "9000 characters" in "".join(lines)
