"""What reaches a terminal: no escapes of a dataset's, and no cell of a million characters."""

import io
import re
from pathlib import Path

import pytest
from rich.console import Console
from rich.text import Text

from asset2sim.catalog import text as shown
from asset2sim.catalog.run import start_run
from asset2sim.catalog.write import write_run
from asset2sim.runs.spread.progress import Report
from flows.command import main
from schemas.asset import AssetRef
from schemas.errors import UsageError, exit_code_of, printable
from schemas.settings import Settings
from schemas.vocabulary import FailureMode
from tests.factories import make_failure, make_record

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
    plain, evil = (Console(file=io.StringIO(), width=60) for _ in range(2))
    console.file = evil.file
    table = shown.number_table("T", ("name", "n"), [("a\x1b[1mb", 1), ("x" * 9_000, 2)], left=1)
    console.print(table)
    lines = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    assert any("a[1mb" in line for line in lines) and "9000 characters" in "".join(lines).replace("\n", "")
    plain.print(Text("x"))
