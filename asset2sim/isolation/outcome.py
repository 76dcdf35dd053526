"""How a child process ended, and what it said."""

from dataclasses import dataclass
from enum import StrEnum


class Ending(StrEnum):
    """The ways in which a child process can end."""

    RETURNED = "returned"
    RAISED = "raised"
    OUT_OF_MEMORY = "out_of_memory"
    DISK_FULL = "disk_full"
    DIED = "died"
    TIMED_OUT = "timed_out"
    STOPPED = "stopped"


@dataclass(frozen=True)
class Outcome:
    """What one child left behind.

    ``value`` is what the function returned where ``ending`` is RETURNED and None otherwise; ``reason`` is one line
    for a person; ``detail`` the traceback, if there is one. ``seconds`` is the wall time of the child, of which it
    spent ``service_seconds`` waiting for services of its parent. ``clean`` says whether it may be given more work.
    """

    ending: Ending
    value: object
    reason: str
    detail: str
    seconds: float
    service_seconds: float
    clean: bool = False
