"""The hook: a user's shell command that gets a run's result, in environment variables only.

Nothing of a run is put into the command's text, so that no asset's name or message can inject shell code.
"""

import os
import re
import signal
import subprocess
from collections.abc import Mapping
from contextlib import suppress

PREFIX = "ASSET2SIM_"
MAX_VALUE = 4096
"""Characters of one variable: far below what any system takes, and enough for a path or a message."""
_IMPOSSIBLE = re.compile("[\0\ud800-\udc7f\udd00-\udfff]")
"""Characters that an environment cannot hold; it can hold undecodable bytes of a file name (U+DC80 to U+DCFF)."""
REAP_LIMIT_S = 5.0
"""Longest wait for a killed hook to exit, s."""


def run_hook(command: str, values: Mapping[str, object], limit_s: float) -> str | None:
    """Run ``command`` in a shell for at most ``limit_s`` s, with each value as ``ASSET2SIM_<NAME>`` in its environment.

    Returns None, or a one-line warning where it failed; its standard error is passed on, not kept. A hook that takes
    too long, or whose run is interrupted meanwhile, is killed with every process that it started.
    """
    try:
        process = subprocess.Popen(
            ["/bin/sh", "-c", command],
            env={**os.environ, **hook_environment(values)},
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
    except (OSError, ValueError) as error:
        return f"the hook did not start: {error}"
    try:
        code = process.wait(timeout=limit_s)
    except subprocess.TimeoutExpired:
        _kill(process)
        return f"the hook was killed after {limit_s:g} s; see run.hook_time_limit_s"
    except BaseException:
        _kill(process)
        raise
    if code < 0:
        return f"the hook was killed by {signal.Signals(-code).name}"
    return f"the hook ended with exit code {code}" if code else None


def hook_environment(values: Mapping[str, object]) -> dict[str, str]:
    """Name → value as an environment takes it: prefixed and in capitals, without zero bytes, of bounded length."""
    return {f"{PREFIX}{name.upper()}": _text(value) for name, value in values.items()}


def _text(value: object) -> str:
    shown = "" if value is None else str(value)
    return _IMPOSSIBLE.sub("", shown)[:MAX_VALUE]


def _kill(process: subprocess.Popen[bytes]) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    with suppress(subprocess.TimeoutExpired):
        process.wait(timeout=REAP_LIMIT_S)
