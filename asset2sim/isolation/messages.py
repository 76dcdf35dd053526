"""What a child and its parent say to each other over the pipe."""

from dataclasses import dataclass


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
    """The function came back with this value."""

    value: object


@dataclass(frozen=True)
class Raised:
    """The function raised. Only text travels: an exception need not survive pickling."""

    type_name: str
    message: str
    traceback: str
    out_of_memory: bool
    disk_full: bool = False
