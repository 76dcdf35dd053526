"""The rig of a check: the object in one engine, loaded on a plane and with its root held."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from asset2sim.checks.mechanism import Mechanism
from asset2sim.checks.rest import RestMotion, record
from asset2sim.checks.set_down import Clouds, Resting, rest_held, set_down
from asset2sim.engines.registry import open_world
from asset2sim.engines.world import Opener, World
from asset2sim.physics.on_floor import StandingParts
from asset2sim.physics.support_polygon import SupportPolygon
from schemas.interaction import Stand
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Thresholds
from schemas.support import SupportKind
from schemas.vocabulary import Engine, OverlapCause

CauseOf = Callable[[str, str, Mapping[str, float]], OverlapCause]
"""Function that tells why two links overlap at these joint positions."""


@dataclass
class SharedWorld:
    """One world that several checks share, loaded afresh once a check has left numbers in it that are not finite."""

    open: Opener
    urdf: Path
    friction: float
    plane: bool
    timestep_s: float
    stack: ExitStack
    world: World | None = None

    def ready(self) -> World:
        """The world, loaded if it is not."""
        if self.world is None:
            opened = self.open(self.urdf, plane=self.plane, timestep_s=self.timestep_s, contact_friction=self.friction)
            self.world = self.stack.enter_context(opened)
        return self.world

    def sound(self) -> World:
        """The world, loaded afresh if its present numbers are not finite."""
        world = self.ready()
        if not (np.isfinite(world.positions()).all() and np.isfinite(world.link_speeds()).all()):
            self.close()
        return self.ready()

    def close(self) -> None:
        """Close the world, if it is loaded."""
        self.stack.close()
        self.world = None


@contextmanager
def shared_world(
    opener: Opener, urdf: Path, overlay: PhysicsOverlay, *, plane: bool, timestep_s: float
) -> Iterator[SharedWorld]:
    """A shared world that is closed at the end of the block."""
    with ExitStack() as stack:
        yield SharedWorld(opener, urdf, overlay.contact_friction, plane, timestep_s, stack)


def opener_of(engine: Engine) -> Opener:
    """An engine's own way to open a world."""
    return partial(open_world, engine)


@dataclass(frozen=True)
class SetDown:
    """How the object stood when it was set down and how it rests; ``support`` is what it rests on. An object with a
    fixed base stands on nothing. ``rest`` is the paper's record from there, where it is wanted."""

    stand: Stand | None
    resting: Resting
    support: SupportPolygon | None
    rest: RestMotion | None


@dataclass
class Rig:
    """One written object in one engine, in its initial state (``item.start``)."""

    engine: Engine
    urdf: Path
    overlay: PhysicsOverlay
    settings: EngineSettings
    limits: Thresholds
    cause: CauseOf
    item: Mechanism
    clouds: Clouds
    held: SharedWorld
    """Its root held, over no plane."""
    free: SharedWorld
    """Its root free, on a plane; closed before the checks that move joints."""
    open: Opener
    """How its worlds are opened."""
    whole: bool
    """Whether every check is run, and the paper's measurement is taken with them."""
    free_stretches: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Joint → the stretch in which the sweep found it free, rad or m."""
    _down: SetDown | None = None

    @property
    def fixed(self) -> bool:
        """Whether the object's base is fixed: what else is done on the plane is then done with its root held."""
        return self.overlay.support.fixed

    @property
    def resting_world(self) -> SharedWorld:
        """The world in which the object is put down."""
        return self.held if self.fixed else self.free

    def coarse_world(self) -> AbstractContextManager[SharedWorld]:
        """The same at the coarse time step, for the length of a block."""
        step = self.settings.coarse_timestep_s
        return shared_world(self.open, self.urdf, self.overlay, plane=not self.fixed, timestep_s=step)

    @cached_property
    def standing(self) -> StandingParts | None:
        """Its parts over the floor in its initial state; None for what does not stand free."""
        if self.overlay.support.kind is not SupportKind.FREESTANDING:
            return None
        return StandingParts(self.item.tree, self.item.root, self.item.bodies, self.clouds, self.item.start)

    def down(self) -> SetDown:
        """The object set down once, undisturbed, until it rests."""
        if self._down is None:
            self._down = self._set_down()
        return self._down

    def _set_down(self) -> SetDown:
        stood, support = None, None
        if self.fixed:
            world = self.held.sound()
            resting = rest_held(world, self.item, self.settings)
        else:
            world = self.free.ready()
            stood, resting, support = set_down(world, self.item, self.clouds, self.settings)
        rest = record(world, resting.peak_speed, self.settings) if self.whole else None
        return SetDown(stood, resting, support, rest)
