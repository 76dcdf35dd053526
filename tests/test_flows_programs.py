"""Programs that end together."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from flows.programs import ProgramError, run_together
from flows.show import commands

SLEEPER = "import subprocess, sys, pathlib\nchild = subprocess.Popen(['sleep', '600'])\n"


def gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0] == "Z"
    except FileNotFoundError:
        return True


@pytest.mark.system
def test_when_one_program_ends_the_others_do_with_all_that_they_started(tmp_path: Path) -> None:
    pid_file = tmp_path / "pid"
    sleeper = f"{SLEEPER}pathlib.Path({str(pid_file)!r}).write_text(str(child.pid))\nchild.wait()"
    quitter = (
        f"import pathlib, sys, time\nwhile not pathlib.Path({str(pid_file)!r}).exists(): time.sleep(0.05)\nsys.exit(7)"
    )
    with pytest.raises(ProgramError, match="quitter ended with exit code 7"):
        run_together({"sleeper": [sys.executable, "-c", sleeper], "quitter": [sys.executable, "-c", quitter]})
    grandchild = int(pid_file.read_text(encoding="ascii"))
    end = time.monotonic() + 10.0
    while not gone(grandchild) and time.monotonic() < end:
        time.sleep(0.05)
    assert gone(grandchild)


@pytest.mark.system
def test_the_pages_programs_are_installed_and_listen_for_this_machine_alone(tmp_path: Path) -> None:
    assert commands(tmp_path).keys() == {"Prefect", "MLflow"}
    for command in commands(tmp_path).values():
        assert command[command.index("--host") + 1] == "127.0.0.1"
        shown = subprocess.run([command[0], "--help"], capture_output=True, text=True, timeout=120)
        assert shown.returncode == 0
