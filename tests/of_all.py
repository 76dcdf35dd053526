"""One program for all workers of a run of tests: started by the worker that needs it first, it ends with the last."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import pytest
from filelock import FileLock


def folder_of_all(factory: pytest.TempPathFactory, name: str) -> Path:
    """A folder that all workers of the run share."""
    base = factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / name
    folder.mkdir(exist_ok=True)
    return folder


@contextmanager
def one_of_all(home: Path, start: Callable[[IO[bytes]], str], answers: Callable[[str], bool]) -> Iterator[str]:
    """The address of the program, which ``start`` returns once it answers; it is to end with its standard input, a pipe
    that every worker holds open."""
    pipe, address = home / "pipe", home / "address"
    with FileLock(home / "lock"):
        if not pipe.exists():
            os.mkfifo(pipe)
        held = os.open(pipe, os.O_RDWR)
        if not address.exists() or not answers(address.read_text(encoding="utf-8")):
            with open(os.open(pipe, os.O_RDONLY), "rb") as alive:
                address.write_text(start(alive), encoding="utf-8")
    try:
        yield address.read_text(encoding="utf-8")
    finally:
        os.close(held)
