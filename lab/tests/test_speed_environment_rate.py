"""How fast an environment is, and a door that cannot be measured; robosuite itself is not installed here."""

import sys
from pathlib import Path

import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed: it comes with the extra gym")
pytest.importorskip("mujoco", reason="MuJoCo is not installed here")

from lab.speed.environment_rate import Rate, described, main
from tests.refined_things import drawer

pytestmark = pytest.mark.system


def test_an_objects_rate_is_a_line_of_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = drawer(tmp_path / "thing")
    assert main([str(folder), "--seconds", "0.3", "--rounds", "2"]) == 0
    line = capsys.readouterr().out.splitlines()[2]
    name, rate, action, step, simulated = (cell.strip() for cell in line.strip("|").split("|"))
    assert (name, action, step) == ("close", "80 ms", "2 ms")
    # Anything slower than time itself is broken, on any machine.
    assert float(rate) > 12.5 and float(simulated) == pytest.approx(0.08 * float(rate), abs=0.1)


def test_a_python_without_robosuite_is_named_with_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = drawer(tmp_path / "thing")
    bare = tmp_path / "python"  # this interpreter without its packages
    bare.write_text(f'#!/bin/sh\nexec "{sys.executable}" -S "$@"\n')
    bare.chmod(0o755)
    assert main([str(folder), "--seconds", "0.1", "--rounds", "1", "--door", str(bare)]) == 2
    said = capsys.readouterr().err
    assert str(bare) in said and "pip install robosuite" in said


def test_environments_are_compared_by_simulated_time_and_not_by_actions() -> None:
    ours, door = Rate("close", 100.0, 0.08, 0.002), Rate("robosuite's door", 200.0, 0.05, 0.002)
    assert "simulated s/s: 0.8 (median)" in described([ours, door])
