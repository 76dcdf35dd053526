"""The ways in which a user gets a refined object, each as a world in which every check runs: ``asset2sim.load`` in
every engine, the MJCF as MuJoCo compiles it, and the USD read back."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

import mujoco
import numpy as np
import pybullet
from lxml import etree
from pybullet_utils.bullet_client import BulletClient

from asset2sim.assets.exports.mjcf import SCENE_NAME
from asset2sim.assets.exports.refined_object import MJCF_NAME, USD_NAME
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.mimic import read_mimics
from asset2sim.assets.urdf.read import read_dynamics, read_urdf
from asset2sim.checks.set_down import point_clouds
from asset2sim.engines import lowest, pybullet_object, sapien_object
from asset2sim.engines.mujoco_world import MuJoCoWorld
from asset2sim.engines.pybullet_world import PyBulletWorld
from asset2sim.engines.registry import installed, open_world
from asset2sim.engines.sapien_world import SapienWorld
from asset2sim.engines.world import Opener, World
from asset2sim.intake.formats.usd import urdf_of_usd
from asset2sim.load import describe, load
from asset2sim.load.in_mujoco import MuJoCoObject
from asset2sim.load.in_pybullet import PyBulletObject
from asset2sim.load.in_sapien import SapienObject
from asset2sim.load.loaded import Loaded
from schemas.vocabulary import Engine

RAISED_M = 10.0
"""Height at which an object that stands free is held, m: it then has no floor."""


@dataclass(frozen=True)
class Route:
    """One way: its name, the engine that it ends in, how it opens a world, and the file that it needs."""

    name: str
    engine: Engine
    open: Opener
    needs: str = URDF_NAME


class ThroughLoad:
    """A world of the checks in which ``asset2sim.load`` steps and pushes; put before the class of an engine's world."""

    user: Loaded

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            self.user.step()

    def push(self, efforts: Mapping[str, float]) -> None:
        self.user.efforts = {}
        self.user.apply_effort(dict(efforts))


class LoadedMuJoCo(ThroughLoad, MuJoCoWorld):
    """The object that ``load`` made in MuJoCo."""

    def __init__(self, user: MuJoCoObject, urdf: Path, plane: bool) -> None:
        super().__init__(user.model, plane, (), parsed_root(urdf))
        self.user, self.data = user, user.data

    def place(self, positions: Mapping[str, float], **where: Any) -> None:
        super().place(positions, **where)
        self.push({})


class LoadedPyBullet(ThroughLoad, PyBulletWorld):
    """The object that ``load`` made in PyBullet; its floor is the client's first body."""

    def __init__(self, user: PyBulletObject, urdf: Path, plane: bool) -> None:
        client, self.user = OwnedClient(user.client), user
        names = {number: name for name, number in user.links.items()} | {-1: user.about.root}
        # Without armature, whose motors of the checks' own world would change the joints.
        terms = {name: replace(term, armature=0.0) for name, term in read_dynamics(urdf).items() if name in user.joints}
        super().__init__(
            pybullet_object.PyBulletItem(
                client, user.body, dict(sorted(names.items())), user.joints, terms, (), read_mimics(parsed_root(urdf))
            ),
            user.timestep_s,
            plane=False,
        )
        self.plane = 0 if plane else None


class OwnedClient(BulletClient):  # type: ignore[misc]
    """PyBullet's functions on a client that is connected, and is disconnected when this goes."""

    _client: int

    def __init__(self, number: int) -> None:
        super().__init__(pybullet.DIRECT)
        pybullet.disconnect(physicsClientId=self._client)
        self._client = number


class LoadedSapien(ThroughLoad, SapienWorld):
    """The object that ``load`` made in SAPIEN."""

    def __init__(self, user: SapienObject, urdf: Path, plane: bool) -> None:
        self.user = user
        clouds, links = point_clouds(urdf), tuple(user.articulation.links)
        shapes = [
            (i, lowest.corners(clouds[link.name]), np.eye(4)) for i, link in enumerate(links) if link.name in clouds
        ]
        item = sapien_object.SapienItem(
            user.scene.physx_system, user.articulation, links, lowest.lowest_cloud(shapes), read_dynamics(urdf), (),
            read_urdf(urdf),
        )  # fmt: skip
        super().__init__(item, user.timestep_s, plane)


WRAPPERS: Mapping[str, Callable[[Any, Path, bool], World]] = {
    "pybullet": cast(Any, LoadedPyBullet), "mujoco": cast(Any, LoadedMuJoCo), "sapien": cast(Any, LoadedSapien),
}  # fmt: skip


@contextmanager
def through_load(
    urdf: Path, *, engine: str, plane: bool, timestep_s: float, contact_friction: float, **_: float
) -> Iterator[World]:
    """The folder of ``urdf`` as ``load`` opens it. What is fixed stands on the floor that ``load`` makes, as users find
    it; what stands free is held far above it."""
    fixed = describe(urdf.parent).support == "fixed"
    position = (0.0, 0.0) if plane or fixed else (0.0, 0.0, RAISED_M)
    user = load(urdf.parent, engine, fixed=not plane, position=position, timestep_s=timestep_s)
    world = WRAPPERS[engine](user, urdf, plane)
    world.place({})
    yield world


@contextmanager
def plain_mjcf(urdf: Path, *, plane: bool, timestep_s: float, contact_friction: float, **_: float) -> Iterator[World]:
    """The scene of the MJCF on its floor, compiled by MuJoCo; without a floor the object alone, its root held."""
    spec = mujoco.MjSpec.from_file(str(urdf.parent / (SCENE_NAME if plane else MJCF_NAME)))
    spec.option.timestep = timestep_s
    root = spec.worldbody.first_body()
    free = [joint for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    for gone in () if plane else (*free, *spec.keys):
        spec.delete(gone)
    if plane and not free:
        root.add_freejoint()
    model = spec.compile()
    world = MuJoCoWorld(model, plane, (), parsed_root(urdf))
    world.place({})
    yield world


@contextmanager
def read_back(urdf: Path, *, engine: Engine, **options: Any) -> Iterator[World]:
    """The USD made a URDF again by our own reader, in a world of the checks."""
    with TemporaryDirectory() as place:
        file = Path(place) / URDF_NAME
        robot = urdf_of_usd(urdf.parent / USD_NAME, Path(place)).robot
        file.write_bytes(etree.tostring(robot))
        with open_world(engine, file, **options) as world:
            yield world


def routes() -> tuple[Route, ...]:
    """Every way that can be taken here."""
    engines = [engine for engine in installed() if engine.value in WRAPPERS]
    loaded = [Route(f"load {name}", name, cast(Opener, partial(through_load, engine=name.value))) for name in engines]
    return (
        *loaded,
        Route("MJCF", Engine.MUJOCO, cast(Opener, plain_mjcf), MJCF_NAME),
        Route("USD", Engine.MUJOCO, cast(Opener, partial(read_back, engine=Engine.MUJOCO)), USD_NAME),
    )
