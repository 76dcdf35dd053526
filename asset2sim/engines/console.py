"""Output of engines on the console, written from C where Python's streams do not see it: taken away, or collected."""

import ctypes
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.machinery import ExtensionFileLoader, ModuleSpec, PathFinder
from types import ModuleType

LOUD = "pybullet"
"""A module that prints when it was built, as it is imported."""


@contextmanager
def silenced() -> Iterator[None]:
    """Send what this process writes to file descriptors 1 and 2, also from C, nowhere while the block runs."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept, nowhere = (os.dup(1), os.dup(2)), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        ctypes.CDLL(None).fflush(None)
        for target, descriptor in zip((1, 2), kept, strict=True):
            os.dup2(descriptor, target)
            os.close(descriptor)
        os.close(nowhere)


@contextmanager
def captured_console() -> Iterator[list[str]]:
    """Collect the lines that this process writes to file descriptors 1 and 2 while the block runs."""
    lines: list[str] = []
    sys.stdout.flush()
    sys.stderr.flush()
    with tempfile.TemporaryFile() as sink:
        saved = [(fd, os.dup(fd)) for fd in (1, 2)]
        for fd, _ in saved:
            os.dup2(sink.fileno(), fd)
        try:
            yield lines
        finally:
            for fd, copy in saved:
                os.dup2(copy, fd)
                os.close(copy)
            sink.seek(0)
            text = sink.read().decode("utf-8", errors="replace")
            lines.extend(line.strip() for line in text.splitlines() if line.strip())


class QuietLoader(ExtensionFileLoader):
    """Loads an extension module without what it prints."""

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """The module."""
        with silenced():
            return super().create_module(spec)


class QuietFinder:
    """Finder in ``sys.meta_path`` that loads the module which prints at import with its output silenced."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> ModuleSpec | None:
        """Its spec, with a quiet loader; None for any other module."""
        spec = PathFinder.find_spec(name, path, target) if name == LOUD else None
        if spec is not None and spec.origin is not None:
            spec.loader = QuietLoader(name, spec.origin)
        return spec
