"""Programs that end together."""

import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flows.command import main
from flows.serve_pages import ProgramError, commands, run_programs
from tests.assets import ROOT
from tests.processes import alive, free_port, gone, wait_until

SLEEPER = "import subprocess, sys, pathlib\nchild = subprocess.Popen(['sleep', '600'])\n"


@pytest.mark.system
def test_when_one_program_ends_the_others_do_with_all_that_they_started(tmp_path: Path) -> None:
    pid_file = tmp_path / "pid"
    sleeper = f"{SLEEPER}pathlib.Path({str(pid_file)!r}).write_text(str(child.pid))\nchild.wait()"
    quitter = (
        f"import pathlib, sys, time\nwhile not pathlib.Path({str(pid_file)!r}).exists(): time.sleep(0.05)\nsys.exit(7)"
    )
    programs = {"sleeper": [sys.executable, "-c", sleeper], "quitter": [sys.executable, "-c", quitter]}
    with pytest.raises(ProgramError, match="quitter ended with exit code 7"):
        run_programs(programs, together=True)
    grandchild = int(pid_file.read_text(encoding="ascii"))
    end = time.monotonic() + 10.0
    while not gone(grandchild) and time.monotonic() < end:
        time.sleep(0.05)
    assert gone(grandchild)


@pytest.mark.system
def test_the_pages_programs_are_installed_and_listen_for_this_machine_alone(tmp_path: Path) -> None:
    pages = commands(tmp_path)
    assert pages.keys() == {"Prefect", "MLflow", "report"}
    assert [word for word in pages.pop("report") if word == "127.0.0.1"]
    for command in pages.values():
        assert command[command.index("--host") + 1] == "127.0.0.1" and "--allowed-hosts" not in command
        shown = subprocess.run([command[0], "--help"], capture_output=True, text=True, timeout=120)
        assert shown.returncode == 0


UI = """
import sys
from flows.command import main
import flows.serve_pages
flows.serve_pages.STOP_LIMIT_S = 2.0
flows.serve_pages.commands = lambda *_: {
    "Prefect": [sys.executable, "-c", "import sys; sys.exit(5)"],
    "MLflow": [sys.executable, "-c", "import subprocess; subprocess.run(['sleep', '600'])"],
}
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.system
def test_one_page_that_fails_leaves_the_other_and_sigterm_ends_it(tmp_path: Path) -> None:
    mark = f"asset2sim-ui-{tmp_path.name}-{os.getpid()}"
    ports = ["--prefect-port", str(free_port()), "--mlflow-port", str(free_port()), "--report-port", str(free_port())]
    ui = subprocess.Popen(
        [sys.executable, "-c", UI, "ui", "--out", str(tmp_path), *ports, "--host", "0.0.0.0"], cwd=ROOT, text=True,
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, "A_TEST": mark},
    )  # fmt: skip
    assert ui.stderr is not None and ui.stdout is not None
    assert ui.stdout.readline() == f"Prefect: http://0.0.0.0:{ports[1]}\n"
    assert "0.0.0.0 is open to every machine that reaches this one" in ui.stderr.readline()
    assert "Prefect ended with exit code 5" in (line := ui.stderr.readline()) and line.endswith("; MLflow goes on\n")
    assert ui.poll() is None and wait_until(lambda: len(alive(mark)) >= 3, 60.0)
    ui.terminate()
    assert ui.wait(timeout=60.0) == 0
    assert wait_until(lambda: not alive(mark), 60.0), alive(mark)


@pytest.mark.system
def test_a_port_in_use_and_a_store_that_there_is_not_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port, other = str(taken.getsockname()[1]), str(free_port())
        assert main(["ui", "--out", str(tmp_path), "--mlflow-port", port, "--prefect-port", other]) == 2
    assert f"port {port} of 127.0.0.1 cannot be used for MLflow" in (told := capsys.readouterr()).err
    assert told.out == "" and told.err.count("\n") == 1
    port = str(free_port())
    assert main(["ui", "--out", str(tmp_path), "--mlflow-port", port, "--prefect-port", port]) == 2
    assert main(["ui", "--out", "gopher://a/b"]) == 2
    assert "no store is known by 'gopher'" in capsys.readouterr().err
