"""Checks of whether everything that a run needs works on this machine."""

import os
import platform
import re
import shutil
import socket
import sys
import tempfile
import time
import uuid
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from asset2sim.catalog.run import git_state, versions
from asset2sim.engines.registry import HOW_TO_INSTALL, engine_version, installed, known_engines, open_world
from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work, in_child
from asset2sim.models.gateway.abilities import check_model
from asset2sim.models.gateway.environment import quiet_environment
from asset2sim.models.gateway.recorded import check_recorded
from asset2sim.runs.request import usable_cores
from asset2sim.storage.objects import StoreError, cache_root, list_objects, remove_objects, send_objects
from schemas.errors import Asset2SimError, UsageError
from schemas.location import Location, nearest_existing
from schemas.model_names import described, is_prior, is_recorded, named_models, settings_for
from schemas.request import ModelRequest
from schemas.secret import redacted_address
from schemas.settings import ModelSettings, RunSettings
from schemas.vocabulary import Engine

BALL_RADIUS_M = 0.1
BALL_TOLERANCE_M = 0.005
ASK_LIMIT_S = 30.0
"""Time in which a model must answer the doctor, s: a server of one's own may have to load it first."""
ASK_TOKENS = 64
"""Most tokens of that answer: a call costs a hundredth of a cent."""
MIN_FREE_DISK_GB = 1.0
"""Room that a run needs, GB: 150 refined objects with their meshes and views take about a third of it."""


class DoctorError(Asset2SimError):
    """A check found something that does not work; the message says what to do."""


@dataclass(frozen=True)
class DoctorCheck:
    """One line of the report. A ``needed`` check that is not ``ok`` keeps a run from working."""

    name: str
    ok: bool
    detail: str
    needed: bool = True


def run_all_checks(out: Path | str, model: ModelSettings) -> list[DoctorCheck]:
    """Results of all checks, in the order in which a run would meet the problems; no file is left behind."""
    quiet_environment()
    place = Location(out)
    return [
        _attempt("python", check_python),
        _attempt("packages", check_packages),
        _attempt("checkout", check_checkout, needed=False),
        _attempt(
            "output folder", lambda: check_store_writable(place) if place.is_url else check_writable(place.folder)
        ),
        _attempt("temporary folder", lambda: check_writable(Path(tempfile.gettempdir()))),
        _attempt("cores and memory", check_machine),
        _attempt("local ports", check_ports),
        _attempt("child processes and PyBullet", check_engine),
        *(
            _attempt(f"engine {engine}", partial(check_engine, engine), needed=False)
            for engine in known_engines()
            if engine is not Engine.PYBULLET
        ),
        *(
            _attempt(f"model {described(name)}", partial(check_model_answers, settings_for(model, name)))
            for name in named_models(model)
        ),
        _attempt("Dask", check_dask),
        _attempt("Prefect", check_prefect),
    ]


def check_python() -> str:
    """Python 3.11, for which the pinned versions were tested together."""
    if sys.version_info[:2] != (3, 11):
        raise DoctorError(f"{platform.python_version()}; the project needs 3.11: make clean, then make install")
    return f"{platform.python_version()} at {sys.prefix}"


def check_packages() -> str:
    """Every package that we depend on is installed."""
    missing = []
    try:
        requirements = metadata.requires("asset2sim") or []
    except metadata.PackageNotFoundError as error:
        raise DoctorError("asset2sim itself is not installed; run make install") from error
    for requirement in requirements:
        name = re.split(r"[<>=!~ \[;]", requirement)[0]
        if "extra ==" in requirement:
            continue
        try:
            metadata.version(name)
        except metadata.PackageNotFoundError:
            missing.append(name)
    if missing:
        raise DoctorError(f"missing: {', '.join(missing)}; run make install")
    return ", ".join(f"{name} {version}" for name, version in versions().items() if name != "python")


def check_checkout() -> str:
    """The commit that runs are recorded with."""
    commit, changed = git_state(Path(__file__).resolve().parent)
    if commit is None:
        raise DoctorError("no git commit found; runs are recorded without one")
    return commit[:12] + (" with uncommitted changes" if changed else "")


def check_writable(folder: Path) -> str:
    """The folder, or the one in which it would be made, takes files and has room."""
    above = nearest_existing(folder)
    try:
        with tempfile.TemporaryFile(dir=above):
            pass
    except OSError as error:
        raise DoctorError(f"{above}: {error.strerror}; choose another --out") from error
    free = shutil.disk_usage(above).free / 1e9
    if free < MIN_FREE_DISK_GB:
        raise DoctorError(f"{above}: {free:.1f} GB free; a run may need {MIN_FREE_DISK_GB:g}")
    return f"{folder} ({free:.0f} GB free)"


def check_store_writable(url: str) -> str:
    """Objects below a URL can be written, listed and removed, and this machine has room for copies of them."""
    place = f"{url}/.doctor-{uuid.uuid4().hex}"
    try:
        with tempfile.NamedTemporaryFile() as file:
            send_objects({place: Path(file.name)})
        found = place.rpartition("/")[2] in list_objects(url)
        remove_objects([place])
    except StoreError as error:
        raise DoctorError(str(error)) from error
    if not found:
        raise DoctorError(f"{url}: what is written there does not show in its listing")
    return f"{url}, with {check_writable(cache_root())}"


def check_machine() -> str:
    """Cores and memory, against what the default settings may take."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    limit = RunSettings().asset_memory_limit_mb / 1e3
    return f"{usable_cores()} cores, {memory:.0f} GB; an asset may take up to {limit:.0f} GB and one core"


def check_ports() -> str:
    """A server can listen on this machine, and be reached."""
    try:
        with socket.create_server(("127.0.0.1", 0)) as server:
            socket.create_connection(server.getsockname(), timeout=5).close()
            return f"127.0.0.1 (port {server.getsockname()[1]} tried)"
    except OSError as error:
        raise DoctorError(f"cannot connect to a port of 127.0.0.1: {error}; Prefect's server needs one") from error


def check_engine(engine: Engine = Engine.PYBULLET) -> str:
    """A child process drops a ball in an engine, and the ball comes to rest on the plane."""
    if engine not in installed():
        raise DoctorError(f"not installed; {HOW_TO_INSTALL} to judge in it too")
    with tempfile.TemporaryDirectory() as folder:
        outcome = in_child(Work(drop_ball, (engine, folder), 60.0))
    if outcome.ending is not Ending.RETURNED or not isinstance(outcome.value, float):
        raise DoctorError(f"{outcome.reason}; run make clean, then make install")
    if abs(outcome.value - BALL_RADIUS_M) > BALL_TOLERANCE_M:
        raise DoctorError(f"a ball of {BALL_RADIUS_M} m came to rest at {outcome.value:.4f} m; the engine is not sane")
    version = engine_version(engine)
    return f"{version}: a dropped ball rests at {1000 * outcome.value:.1f} mm, in {outcome.seconds:.2f} s"


def drop_ball(engine: Engine, folder: str) -> float:
    """The height, m, at which the centre of a ball of ``BALL_RADIUS_M`` is 2 s after a drop from 0.2 m."""
    urdf = Path(folder) / "ball.urdf"
    urdf.write_text(
        '<robot name="ball"><link name="ball"><inertial><mass value="0.1"/>'
        '<inertia ixx="4e-4" iyy="4e-4" izz="4e-4" ixy="0" ixz="0" iyz="0"/></inertial>'
        f'<collision><geometry><sphere radius="{BALL_RADIUS_M}"/></geometry></collision></link></robot>',
        encoding="utf-8",
    )
    with open_world(engine, urdf, plane=True, timestep_s=1.0 / 240.0, contact_friction=0.5) as world:
        world.place({}, height_m=0.2)
        world.step(480)
        return float(world.root_pose()[0][2])


def check_model_answers(settings: ModelSettings) -> str:
    """The model answers a question of a few words; a recorded model has answers in its folder. A provider's model is
    asked once, over the network, with its key."""
    try:
        check_model(settings)
    except UsageError as error:
        raise DoctorError(str(error)) from error
    if is_recorded(settings.model):
        return check_recorded(settings.model)
    from asset2sim.models.gateway.ask import ask

    brief = {"timeout_s": min(settings.timeout_s, ASK_LIMIT_S), "max_attempts": 1, "max_completion_tokens": ASK_TOKENS}
    prior = is_prior(settings.model)
    started = time.monotonic()
    request = ModelRequest(purpose="doctor", system="Answer in JSON.", text="A box." if prior else 'Say {"ok": true}.')
    answer = ask(request, settings if prior else settings.model_copy(update=brief))
    (call,) = answer.calls[-1:] or (None,)
    if prior and answer.content is not None:
        return f"answers in this process, {len(answer.content)} characters"
    # A model that thinks before it answers may have spent its few tokens on that: it has been reached, and said so.
    if answer.content is None and (prior or call is None or not call.completion_tokens):
        raise DoctorError(answer.error or "no answer")
    place = f" at {redacted_address(settings.api_base)}" if settings.api_base else ""
    tokens = f"{call.prompt_tokens + call.completion_tokens} tokens" if call else "no tokens"
    cost = f", {call.cost_usd:.5f} USD" if call and call.cost_usd else ""
    return f"answers{place} in {time.monotonic() - started:.1f} s ({tokens}{cost})"


def check_dask() -> str:
    """A cluster starts and computes."""
    from asset2sim.experiments.cluster import open_client

    with open_client(RunSettings(workers=1), Path.cwd()) as client:
        if client.submit(abs, -1).result(timeout=30) != 1:
            raise DoctorError("a cluster started and gave a wrong answer")
    return "a cluster starts and computes"


def check_prefect() -> str:
    """Prefect is installed; returns which server a run would use."""
    if find_spec("prefect") is None:
        raise DoctorError("not installed; run make install")
    address = os.environ.get("PREFECT_API_URL")
    return f"server at {address}" if address else "a run starts a temporary server"


def _attempt(name: str, check: Callable[[], str], needed: bool = True) -> DoctorCheck:
    try:
        return DoctorCheck(name, True, check(), needed)
    except DoctorError as error:
        return DoctorCheck(name, False, str(error), needed)
    except Exception as error:  # a check must report whatever is broken, and the next one must still run
        return DoctorCheck(name, False, f"{type(error).__name__}: {error}", needed)
