"""Messages between a child and its parent over the pipe.

The parent sends ``ChildWork``; the child says ``Begun``, any number of ``Call``s, each of which gets an ``Answer``, and
then ``Returned`` or ``Raised``. It may be sent more work after the former.
"""

from dataclasses import dataclass
from enum import StrEnum


@dataclass(frozen=True)
class ChildWork:
    """One call. ``pickled``: ``(function or its name, args)``; ``services`` names what it may call in the parent."""

    pickled: bytes
    services: tuple[str, ...]
    memory_limit_mb: int
    log_path: str


@dataclass(frozen=True)
class Begun:
    """The child has received the work: if it ends from here on, the work is the cause."""


@dataclass(frozen=True)
class Call:
    """The child asks its parent for a service."""

    service: str
    args: tuple[object, ...]


@dataclass(frozen=True)
class Answer:
    """The parent's answer to a ``Call``; ``error`` says why there is no value."""

    value: object = None
    error: str | None = None


@dataclass(frozen=True)
class Returned:
    """The function returned this value; ``clean`` says whether the child may be given more work."""

    value: object
    clean: bool = False


@dataclass(frozen=True)
class Raised:
    """The function raised. Only text travels: an exception need not survive pickling; its traceback is in the log."""

    type_name: str
    message: str
    out_of_memory: bool
    disk_full: bool = False


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
    """The outcome of one call in a child process: ``value`` is what the function returned if ``ending`` is RETURNED,
    else None; ``reason`` is one line for a person, ``seconds`` the child's wall time; a ``clean`` child may go on."""

    ending: Ending
    value: object
    reason: str
    seconds: float
    clean: bool = False
