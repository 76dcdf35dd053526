"""Commands as a user gives them, one after the other in one Python program: what they load is loaded once."""

import json
import subprocess
import sys
from collections.abc import Mapping, Sequence

from tests.assets import ROOT

LIMIT_S = 900.0
PROGRAM = """
import json, sys
from flows.command import main

if __name__ == "__main__":
    for words in json.loads(sys.argv[1]):
        code = main(words)
        print("\\0", end="", flush=True)
        if code:
            sys.exit(code)
"""


def one_after_the_other(commands: Sequence[Sequence[str]], environment: Mapping[str, str]) -> list[str]:
    """What each command printed; each must end well."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(commands)], cwd=ROOT, env=environment, text=True,
        capture_output=True, timeout=LIMIT_S,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.split("\0")[:-1]
