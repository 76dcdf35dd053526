"""Schedules: a bad one is one line and exit code 2, before anything starts."""

from pathlib import Path

import pytest

from flows import schedule
from flows.command import run_command
from flows.schedule import check_cron, chosen_schedule
from schemas.errors import UsageError
from tests.incremental_runs import dataset

BAD = ("99 2 * * *", "0 2 * *", "0 2 * * 8", "a b c d e", "R 2 * * *", "0 0 31 2 *", "", "@daily", "0 2 * * * *")


@pytest.mark.parametrize("cron", BAD)
def test_a_bad_schedule_is_one_line_and_nothing_starts(
    cron: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"

    def never(request: object) -> object:
        raise AssertionError(f"it must not start: {request}")

    words = ["nightly", str(data), "--out", str(out)]
    assert run_command([*words, "--cron", cron], refine=never, nightly=never) == 2  # type: ignore[arg-type]
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"asset2sim: --cron '{cron}'") and "0 2 * * *" in line
    file = tmp_path / "catalog.yaml"
    file.write_text(f"metadata: {{nightly: {{cron: '{cron}'}}}}", encoding="utf-8")
    monkeypatch.setattr(schedule.chosen_schedule, "__defaults__", (file,))
    assert run_command(words, refine=never, nightly=never) == 2  # type: ignore[arg-type]
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"asset2sim: {file}: cron '{cron}'") and not out.exists()


def test_a_schedule_of_the_command_line_has_the_files_time_zone(tmp_path: Path) -> None:
    file = tmp_path / "catalog.yaml"
    file.write_text("metadata: {nightly: {cron: 'nonsense', timezone: Europe/Berlin}}", encoding="utf-8")
    assert chosen_schedule("30 3 * * 1-5", file) == ("30 3 * * 1-5", "Europe/Berlin")
    assert check_cron("0 2 29 2 *", "--cron") == "0 2 29 2 *", "there are leap years"
    with pytest.raises(UsageError, match="cron 'nonsense' needs five fields"):
        chosen_schedule(None, file)
