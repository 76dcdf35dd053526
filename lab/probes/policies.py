"""Which policy is asked: the address of a server, or a probe of ours, which is served by this project."""

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import urlsplit

from lab.probes.cameras import open_gl
from lab.probes.cloning import Cloned
from lab.probes.experts import Noisy, scripted
from lab.probes.observation import ActionKind, Policy
from lab.probes.openpi_client import OpenPiPolicy
from lab.probes.openpi_wire import Camera
from lab.probes.serving import HOST, served
from lab.probes.tasks import ProbeTask
from lab.schemas.settings import ProbeSettings
from schemas.errors import UnknownChoiceError, UsageError

OPENPI, GROOT = "openpi", "gr00t"
SECURE = "wss"
PORTS = {OPENPI: 8000, GROOT: 5555, SECURE: 443}
"""Scheme → the port of its servers where none is named; ``wss`` is openpi over TLS."""
KEY = "ASSET2SIM_POLICY_KEY"
"""Environment variable of the API key or token that a policy's server wants."""
CLONED = "cloned"
NOISY = "noisy"
BLIND = ("scripted", NOISY)
"""Probes of ours that know the state and look at no picture."""
PROBES = (*BLIND, CLONED)
"""Probes of ours: they never acted in reality."""
NEED = f"name {', '.join(PROBES)}, or a server as openpi://HOST:PORT, wss://HOST:PORT or gr00t://HOST:PORT"


@dataclass(frozen=True)
class PolicySpec:
    """A policy: the name under which its trials are kept, its protocol, and where it is; a probe of ours is nowhere
    before it is served. ``kind`` is what openpi's actions are unless the server says so, ``camera`` the outside one
    that the policy sees, ``network`` the file of a cloned one."""

    name: str
    protocol: str = OPENPI
    host: str = ""
    port: int = 0
    kind: ActionKind = "joint_velocity"
    camera: Camera = "left"
    network: Path | None = None
    secure: bool = False

    @property
    def ours(self) -> bool:
        """Whether it is a probe of ours."""
        return not self.host

    @property
    def folder(self) -> str:
        """Its name as the name of a folder."""
        return re.sub(r"[^\w.-]+", "-", self.name).strip("-.") or "policy"


def policy_spec(
    text: str, name: str | None, kind: ActionKind, camera: Camera, network: Path | None = None
) -> PolicySpec:
    """The policy that an option names. A probe of ours keeps its own name, so that its trials are never taken for a
    real policy's. Raises UsageError."""
    if "://" not in text:
        if text not in PROBES:
            raise UnknownChoiceError("policy", text, (*PROBES, *(f"{name}://HOST:PORT" for name in PORTS)))
        if name is not None:
            raise UsageError(f"--name is for policies of a server; '{text}' is a probe of ours and keeps its name")
        if text == CLONED and (network is None or not network.is_file()):
            raise UsageError(
                f"--policy {CLONED} needs --network FILE, a network that make clone has trained; see docs/probes.md"
            )
        return PolicySpec(text, kind=kind, camera=camera, network=network)
    try:
        parts = urlsplit(text)
        port = parts.port
    except ValueError as error:
        raise UsageError(f"--policy {text}: {error}; {NEED}") from error
    if parts.scheme not in PORTS or not parts.hostname or parts.path.strip("/") or parts.query:
        raise UsageError(f"--policy {text} names no policy; {NEED}")
    if name in PROBES:
        raise UsageError(f"--name {name} is the name of a probe of ours; give the policy another")
    secure = parts.scheme == SECURE
    protocol = OPENPI if secure else parts.scheme
    where = parts.hostname, port or PORTS[parts.scheme]
    return PolicySpec(name or text, protocol, *where, kind, camera, secure=secure)


def make_probe(spec: PolicySpec, folder: Path, task: ProbeTask, seed: int) -> Policy:
    """A probe of ours for a trial. Raises NoWayError, LoadError and ValueError as its expert does, UsageError."""
    if spec.name == CLONED:
        assert spec.network is not None
        return Cloned(spec.network)
    expert = scripted(folder, task, seed)
    return Noisy(expert, seed) if spec.name == NOISY else expert


@contextmanager
def opened(spec: PolicySpec, make: Callable[[], Policy], settings: ProbeSettings) -> Iterator[Policy]:
    """The policy, connected while the block runs; a probe of ours is made by ``make`` in a process of its own and asked
    over the same websocket. Raises PolicyError, and ServingError where a probe cannot be made."""
    if spec.ours:
        with served(make, "joint_velocity") as port, OpenPiPolicy(HOST, port, settings=settings) as policy:
            yield policy
    elif spec.protocol == OPENPI:
        key, secure = os.environ.get(KEY, ""), spec.secure
        with OpenPiPolicy(spec.host, spec.port, spec.kind, spec.camera, settings, secure=secure, key=key) as policy:
            yield policy
    else:
        from lab.probes.groot_client import GrootPolicy  # late: ZeroMQ is for this alone

        with GrootPolicy(spec.host, spec.port, spec.camera, settings, os.environ.get(KEY, "")) as groot:
            yield groot


def check_installed(spec: PolicySpec) -> None:
    """Raise UsageError where pictures cannot be drawn, or what the policy needs is not installed."""
    open_gl(16, 16).free()
    if spec.name == CLONED and find_spec("torch") is None:
        raise UsageError("the cloned probe is a network and needs torch: pip install './lab[learn]'")
    if spec.protocol == GROOT:
        try:
            import zmq  # noqa: F401
        except ImportError as error:
            raise UsageError(f"{GROOT}:// needs pyzmq ({error}): pip install ./lab") from error
