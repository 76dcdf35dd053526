"""Commands that are ready behave as programs of their own do: see ``tests.ready``."""

import os
import signal
import subprocess
from pathlib import Path

import pytest

from tests.processes import MARK, alive, wait_until

pytestmark = pytest.mark.system
SCRIPT = """
import os, sys, threading, time
from pathlib import Path
word = sys.stdin.readline().strip()
print(word, os.environ["WORD"], Path.cwd().name, *sys.argv[1:])
print("to the other", file=sys.stderr)
if word == "fail":
    raise KeyError("lost")
if word == "wait":
    Path("begun").touch()
    time.sleep(600)
threading.Thread(target=lambda: (time.sleep(0.2), print("a thread ends"))).start()
sys.exit(3)
"""


@pytest.fixture
def start(ready: list[str], tmp_path: Path) -> "subprocess.Popen[str]":
    """The script, which waits for a word on its standard input."""
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    environment = {**os.environ, "WORD": "ü", MARK: str(tmp_path)[-60:]}
    pipe = subprocess.PIPE
    return subprocess.Popen(
        [*ready, "script.py", "a b"], cwd=tmp_path, env=environment, text=True, stdin=pipe, stdout=pipe, stderr=pipe
    )


@pytest.mark.parametrize(("word", "code", "said"), [("go", 3, "to the other\n"), ("fail", 1, "KeyError: 'lost'")])
def test_streams_folder_environment_and_exit_code(
    start: "subprocess.Popen[str]", tmp_path: Path, word: str, code: int, said: str
) -> None:
    out, errors = start.communicate(word, timeout=60.0)
    assert (start.returncode, out.splitlines()[0]) == (code, f"{word} ü {tmp_path.name} a b")
    assert errors.startswith("to the other") and said in errors
    assert ("a thread ends" in out) == (word == "go")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_it_ends_by_a_signal_and_carries_its_mark_until_then(
    start: "subprocess.Popen[str]", tmp_path: Path, number: signal.Signals
) -> None:
    assert start.stdin is not None
    start.stdin.write("wait\n")
    start.stdin.flush()
    assert wait_until((tmp_path / "begun").exists, 60.0)
    mark = str(tmp_path)[-60:]
    assert sum("tests.ready" in words for words in alive(mark)) == 2, "the command, and its fork server"
    start.send_signal(number)
    start.communicate(timeout=60.0)
    assert start.returncode == -number
    assert wait_until(lambda: not alive(mark), 60.0), alive(mark)
