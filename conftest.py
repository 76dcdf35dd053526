"""Set-up of every test: quiet libraries, no network beyond this machine, true ``system`` marks."""

import gc
import os
import shutil
import signal
import socket
import sys
import tempfile
from collections.abc import Generator, Iterator
from multiprocessing.util import Finalize
from typing import Any

import hypothesis
import pytest

from asset2sim.experiments.isolation.children import preload
from asset2sim.models.gateway.environment import quiet_environment
from tests import started
from tests.gateway import no_keys, one_key
from tests.object_store import store, store_server
from tests.prefect_server import prefect_server, prefect_server_home, prefect_tables
from tests.ready import ready

__all__ = ["no_keys", "one_key", "ready", "store", "store_server"]
__all__ += ["prefect_server", "prefect_server_home", "prefect_tables"]

# Hundreds of processes import our modules, and nearly all time of a short one is compiling them.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
quiet_environment()
preload("tasks.pipeline:refine_asset")
# A shell starts what it puts into the background with Ctrl-C ignored, which its children would inherit.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# A busy machine must fail no test.
hypothesis.settings.register_profile("tests", deadline=None)
hypothesis.settings.load_profile("tests")

# While a worker loads all modules, nothing becomes garbage: looking for it takes a seventh of the time.
gc.disable()

_attempts: list[str] = []


class NetworkForbiddenError(OSError):
    """A test tried to reach another machine."""


def _refuse_far_address(sock: socket.socket, address: Any) -> None:
    # Connecting a datagram socket sends nothing; libraries do it to learn this machine's own address.
    if sock.family not in (socket.AF_INET, socket.AF_INET6) or sock.type & socket.SOCK_DGRAM:
        return
    host = str(address[0])
    if host == "localhost" or host == "::1" or host.startswith(("127.", "::ffff:127.")):
        return
    _attempts.append(f"{host}:{address[1]}")
    raise NetworkForbiddenError(f"tests may not reach {host}:{address[1]}")


@pytest.fixture(scope="session", autouse=True)
def forbid_network() -> Iterator[None]:
    """Let sockets of this process connect to the loopback interface and to local files only."""
    connect, connect_ex = socket.socket.connect, socket.socket.connect_ex

    def guarded(self: socket.socket, address: Any) -> None:
        _refuse_far_address(self, address)
        connect(self, address)

    def guarded_ex(self: socket.socket, address: Any) -> int:
        _refuse_far_address(self, address)
        return connect_ex(self, address)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(socket.socket, "connect", guarded)
        patch.setattr(socket.socket, "connect_ex", guarded_ex)
        yield


@pytest.fixture(autouse=True)
def network_attempts() -> Iterator[list[str]]:
    """Addresses beyond this machine that the test tried to reach: a test that leaves any fails, even if it went on."""
    _attempts.clear()
    yield _attempts
    assert not _attempts, f"the test tried to reach the network: {', '.join(_attempts)}"


SLOWEST_FIRST = (
    "test_flows_serve_nightly", "test_flows_faults", "test_project_walks", "test_project_walk_nights",
    "test_flows_refine_dataset", "test_gym_learn", "test_runs_remote_output", "test_tasks_ask_again",
    "test_tasks_paper9", "test_hostile", "test_report_browser", "test_flows_serving", "test_runs_plan",
    "test_assets_origins", "test_gym_random_sweeps", "test_viewer_page", "test_runs_refine_all",
    "test_tasks_pipeline", "test_probes_scene", "test_judged_rating_page", "test_flows_remote",
    "test_described_otherwise", "test_project_notebook", "test_catalog_parts", "test_refinement_turn_over",
    "test_runs_plan_records", "test_judged_video_judge", "test_project_walk_data", "test_load",
    "test_probes_probe_study", "test_catalog_write", "test_runs_record_answers", "test_mechanisms_planted",
    "test_report_site", "test_trials_motion", "test_gym_hand_used", "test_packs",
    "test_storage_empty_databases", "test_runs_hostile_answers", "test_assets_usd_hulls", "test_tasks_formats",
    "test_weights", "test_gym_hand_contents", "test_project_walk_models", "test_speed", "test_checks_outside",
)  # fmt: skip
"""Files of tests that take longest: 10 s of a core and more; those that wait most first, then in the order of what was
measured."""


def pytest_configure(config: pytest.Config) -> None:
    """Give the run a temporary folder of its own, which goes with it: what is killed leaves files behind. Those of
    ``tmp_path`` stay where they are."""
    if not hasattr(config, "workerinput"):
        os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", tempfile.gettempdir())
        os.environ["TMPDIR"] = tempfile.mkdtemp(prefix="tests-")
        tempfile.tempdir = None
        # After multiprocessing's own folder in it, which has -100.
        Finalize(None, shutil.rmtree, (os.environ["TMPDIR"], True), exitpriority=-200)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark ``system`` what uses the object store, which is a server; the files that take minutes come first, so that
    no worker has one of them left at the end."""
    for item in items:
        if "store_server" in getattr(item, "fixturenames", ()):
            item.add_marker("system")
    first = {name: place for place, name in enumerate(SLOWEST_FIRST)}
    items.sort(key=lambda item: first.get(item.path.stem, len(first)))


def pytest_collection_finish() -> None:
    """From here on garbage is collected, and what was loaded is not looked at: 5 % of a worker's time."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, None, None]:
    """Watch what the test and its fixtures start."""
    started.begin()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """Fail a test that starts programs, servers or engines and is not marked ``system``."""
    yield
    found = started.end()
    if found and item.get_closest_marker("system") is None:
        pytest.fail(f"mark it `system`: it starts {', '.join(found)}", pytrace=False)
