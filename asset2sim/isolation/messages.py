"""What a child and its parent say to each other over the pipe.

The parent sends ``Work``; the child says ``Begun``, any number of ``Call``s, each of which gets an ``Answer``, and then
``Returned`` or ``Raised``. It may be sent more work after the former.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Work:
    """One function to call. ``pickled`` is ``(function, args)``; ``services`` names what the child may call here."""

    pickled: bytes
    services: tuple[str, ...]
    memory_limit_mb: int
    log_path: str


@dataclass(frozen=True)
class Begun:
    """The child is there and has the work: what ends it from here on is the work's doing."""


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
    """The function came back with this value; ``clean`` says whether the child may be given more work."""

    value: object
    clean: bool = False


@dataclass(frozen=True)
class Raised:
    """The function raised. Only text travels: an exception need not survive pickling."""

    type_name: str
    message: str
    traceback: str
    out_of_memory: bool
    disk_full: bool = False
