"""Child processes: ending with their parent, and telling where they hang. In this room because it is the lowest that
starts any; engines and runs use it too."""

import ctypes
import os
import signal
import sys
import time

PR_SET_PDEATHSIG = 1
"""Linux: the signal that a process is sent when its parent ends."""
DUMP_WAIT_S = 0.1
"""Time for a hung child to write its traceback before it is killed, s."""


def end_with_parent(parent: int) -> None:
    """Have the kernel kill this process when its parent, of that process id, goes. Linux only: elsewhere the process
    group or a time limit does it. (A child of the fork server has another parent: see ``isolation.child``.)"""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)


def dump_traceback(pid: int) -> None:
    """Have a hung child write its traceback, if it has set that up, and wait for it; nothing if it is gone."""
    try:
        os.kill(pid, signal.SIGUSR1)
    except ProcessLookupError:
        return
    time.sleep(DUMP_WAIT_S)
