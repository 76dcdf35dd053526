"""Consumers that open packs: Python environments of their own, and a local Hub: one folder as one commit."""

import hashlib
import importlib.util
import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

COMMIT = "0123456789abcdef0123456789abcdef01234567"


def python_with(module: str) -> str:
    """The Python that has a consumer: that of the environment of this name in the folder CONSUMERS, else this one.
    Skips the test where neither has it, and says why; where CONSUMERS_REQUIRED is set, fails it."""
    own = Path(os.environ.get("CONSUMERS", "")) / module / "bin" / "python"
    if "CONSUMERS" in os.environ and own.is_file():
        return str(own)
    reason = cannot_import(module)
    if reason:
        text = f"{module} is not to be had ({reason}): make an environment CONSUMERS/{module} that has it"
        (pytest.fail if os.environ.get("CONSUMERS_REQUIRED") else pytest.skip)(text)
    return sys.executable


@cache
def cannot_import(module: str) -> str:
    """Why a child of this Python cannot import a module; empty where it can. A package may lie here without what it
    needs."""
    if importlib.util.find_spec(module) is None:
        return "not installed"
    words = [sys.executable, "-c", f"import {module}"]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=300)
    return ended.stderr.strip().splitlines()[-1] if ended.returncode else ""


def digest(body: bytes) -> str:
    """The name of a blob by its content."""
    return hashlib.sha1(body).hexdigest()


class Handler(BaseHTTPRequestHandler):
    """Answers what ``hf_hub_download`` and ``snapshot_download`` ask: a commit's files, and each file."""

    def __init__(self, folder: Path, asked: list[str], *args: object) -> None:
        self.folder, self.asked = folder, asked
        super().__init__(*args)  # type: ignore[arg-type]

    def do_HEAD(self) -> None:
        self.answer(with_body=False)

    def do_GET(self) -> None:
        self.answer(with_body=True)

    def answer(self, with_body: bool) -> None:
        """Send a file of the repository, or the commit's list of them."""
        path, _, _ = self.path.partition("?")
        if path.startswith("/api/"):
            files = [item for item in self.folder.rglob("*") if item.is_file()]
            names = [item.relative_to(self.folder).as_posix() for item in files]
            tree = [{"type": "file", "path": name, "size": file.stat().st_size, "oid": digest(file.read_bytes())}
                    for name, file in zip(names, files, strict=True)]  # fmt: skip
            commit = {"id": "user/name", "sha": COMMIT, "siblings": [{"rfilename": name} for name in names]}
            body = json.dumps(tree if "/tree/" in path else commit).encode()
            return self.send(body, "application/json", with_body)
        name = path.split("/resolve/", 1)[-1].partition("/")[2]
        self.asked.append(name)
        if not (self.folder / name).is_file():
            return self.send_error(404)
        return self.send((self.folder / name).read_bytes(), "application/octet-stream", with_body)

    def send(self, body: bytes, kind: str, with_body: bool) -> None:
        """Send a body with the headers that the client reads."""
        self.send_response(200)
        for key, value in (("Content-Type", kind), ("Content-Length", str(len(body))), ("X-Repo-Commit", COMMIT),
                           ("ETag", f'"{digest(body)}"')):  # fmt: skip
            self.send_header(key, value)
        self.end_headers()
        if with_body:
            self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Nothing is logged."""


@contextmanager
def served_as_hub(folder: Path) -> Iterator[tuple[str, list[str]]]:
    """The address of a hub whose only repository is the folder, and the names of the files asked for."""
    asked: list[str] = []
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, folder, asked))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}", asked
    finally:
        server.shutdown()
        server.server_close()
