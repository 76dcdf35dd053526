"""An S3-compatible server on this machine (moto's) that records its requests. Fixture: ``store``."""

import itertools
import logging
import os
import signal
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from asset2sim.runs.plan.content_hash import shared_hash
from schemas.settings import Settings

KEY, SECRET = "AKIATESTTESTTESTTEST", "wJalrXUtnFEMItestK7MDENGtestbPxRfiCYtestKEY"
"""Made up: the server takes any."""

_numbers = itertools.count()


@dataclass
class Store:
    """``url`` is the test's own bucket; ``requests`` are (method, path with query) in order.
    ``doomed`` is empty or (process id, n): the n-th PUT, POST or DELETE in ``requests`` kills that process."""

    address: str
    url: str = ""
    requests: list[tuple[str, str]] = field(default_factory=list)
    doomed: list[int] = field(default_factory=list)

    @property
    def files(self) -> Any:
        """The store as a file system of fsspec, for changes that a test makes without our code."""
        import fsspec

        return fsspec.filesystem("s3", use_listings_cache=False)

    def keys(self, url: str) -> list[str]:
        """Names of the objects below a URL, relative to it."""
        key = url.removeprefix("s3://")
        return sorted(path.removeprefix(f"{key}/") for path in self.files.find(key))

    def put(self, folder: Path, url: str) -> None:
        """Copy a folder's files."""
        for path in folder.rglob("*"):
            if path.is_file():
                self.files.pipe_file(f"{url}/{path.relative_to(folder).as_posix()}", path.read_bytes())

    def asked(self, method: str, work: Callable[[], object]) -> list[str]:
        """The keys of the requests of this HTTP method during ``work``; listings have no key and are left out."""
        self.requests.clear()
        work()
        asked = [path.partition("?")[0].split("/", 2)[1:] for made, path in self.requests if made == method]
        return [parts[1] for parts in asked if len(parts) > 1]


@pytest.fixture(scope="session")
def store_server() -> Iterator[Store]:
    pytest.importorskip("s3fs", reason="the extra s3 is not installed")
    from moto.moto_server.werkzeug_app import DomainDispatcherApplication, create_backend_app
    from werkzeug.serving import make_server

    logging.getLogger("werkzeug").setLevel(logging.CRITICAL)
    application = DomainDispatcherApplication(create_backend_app)
    requests: list[tuple[str, str]] = []
    doomed: list[int] = []

    def counting(environ: dict[str, Any], start_response: Any) -> Any:
        requests.append((environ["REQUEST_METHOD"], f"{environ['PATH_INFO']}?{environ.get('QUERY_STRING', '')}"))
        if doomed and sum(method in ("PUT", "POST", "DELETE") for method, _ in list(requests)) == doomed[1]:
            os.kill(doomed[0], signal.SIGKILL)
        return application(environ, start_response)

    server = make_server("127.0.0.1", 0, counting, threaded=True)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield Store(f"http://127.0.0.1:{server.port}", requests=requests, doomed=doomed)
    server.shutdown()
    thread.join()


@pytest.fixture
def store(store_server: Store, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Store:
    """The server with an empty bucket, found by this process and its children as a user's store is: by environment."""
    # Once a process, by what the cache of this user knows of the sources: with an empty one it takes 3 s.
    shared_hash(Settings(), "")
    for name, value in environment(store_server, tmp_path / "cache").items():
        monkeypatch.setenv(name, value)
    found = Store(store_server.address, f"s3://bucket-{next(_numbers)}", store_server.requests, store_server.doomed)
    found.files.mkdir(found.url)
    return found


def environment(store: Store, cache: Path) -> dict[str, str]:
    return {
        "AWS_ACCESS_KEY_ID": KEY,
        "AWS_SECRET_ACCESS_KEY": SECRET,
        "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": store.address,
        "AWS_EC2_METADATA_DISABLED": "true",
        "AWS_CONFIG_FILE": os.devnull,
        "AWS_SHARED_CREDENTIALS_FILE": os.devnull,
        "ASSET2SIM_CACHE": str(cache),
    }
