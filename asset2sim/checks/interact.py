"""All checks of one asset in one engine: loaded once on a plane, once held, once at the coarse step."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asset2sim.checks.effort import efforts
from asset2sim.checks.hold import holds
from asset2sim.checks.mechanism import Mechanism, mechanism
from asset2sim.checks.nudge import nudges
from asset2sim.checks.opening import openings
from asset2sim.checks.release import releases
from asset2sim.checks.reset import held_reset, held_starts, reset, starts
from asset2sim.checks.rest import Recording, contacts_of, measurement, record
from asset2sim.checks.stand import Resting, rest_held, settled, stand
from asset2sim.checks.support_polygon import Clouds, point_clouds
from asset2sim.checks.sweep import CauseOf, sweeps
from asset2sim.checks.watch import capped, watch
from asset2sim.engines.registry import open_world
from asset2sim.engines.world import World
from asset2sim.physics.support_polygon import SupportPolygon
from schemas.interaction import Drop, Interaction, Reset
from schemas.measurement import Measurement
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Thresholds
from schemas.vocabulary import Engine, FailureMode

MANY_JOINTS = 50
"""Joints beyond which only every second perturbed start is run: a contact costs engines in proportion to the joints,
and a step on a keyboard of 115 takes 30 ms."""


UNTOUCHED = (FailureMode.STANDS, FailureMode.STATE, FailureMode.DROP, FailureMode.RESET)
"""Failures that the checks show which put the object down and let it be."""


@dataclass
class SharedWorld:
    """One world that several checks share, loaded afresh once a check has left numbers in it that are not finite."""

    engine: Engine
    urdf: Path
    friction: float
    plane: bool
    timestep_s: float
    stack: ExitStack
    world: World | None = None

    def ready(self) -> World:
        """The world, loaded if it is not."""
        if self.world is None:
            opened = open_world(
                self.engine, self.urdf, plane=self.plane, timestep_s=self.timestep_s, contact_friction=self.friction
            )
            self.world = self.stack.enter_context(opened)
        return self.world

    def sound(self) -> World:
        """The world, loaded afresh if its present numbers are not finite."""
        world = self.ready()
        if not (np.isfinite(world.positions()).all() and np.isfinite(world.link_speeds()).all()):
            self.stack.close()
            self.world = None
        return self.ready()


@contextmanager
def shared_world(
    engine: Engine, urdf: Path, overlay: PhysicsOverlay, *, plane: bool, timestep_s: float
) -> Iterator[SharedWorld]:
    """A shared world that is closed at the end of the block."""
    with ExitStack() as stack:
        yield SharedWorld(engine, urdf, overlay.contact_friction, plane, timestep_s, stack)


def examine(
    engine: Engine,
    urdf: Path,
    overlay: PhysicsOverlay,
    settings: EngineSettings,
    limits: Thresholds,
    *,
    cause: CauseOf,
    only: FailureMode | None = None,
) -> tuple[Measurement | None, Interaction]:
    """Run every check on a written asset in its initial state, or ``only`` one interaction check and those that it
    needs, without the paper's measurement.

    ``limits`` state how deep an overlap stops a sweep, and which records are worth a second, single run; verdicts are
    made in ``interaction_verdict``. Raises AssetError (engine_refused) where the engine refuses the file.
    """
    item, clouds = mechanism(urdf, overlay), point_clouds(urdf)
    seen, support, measured = Interaction(engine=engine), None, None
    with shared_world(engine, urdf, overlay, plane=False, timestep_s=settings.timestep_s) as held:
        # First, while the world is fresh: contact caches make Φ depend slightly on earlier poses.
        points = contacts_of(held.ready(), item.start) if only is None else []
        if wanted(only, *UNTOUCHED, FailureMode.EFFORT):
            if overlay.support.fixed:
                seen, rest = on_its_mount(engine, urdf, overlay, held, item, settings, limits, only)
            else:
                seen, support, rest = on_a_plane(engine, urdf, overlay, item, clouds, settings, limits, only)
            if rest is not None:
                measured = measurement(engine, points, rest, overlay.initial_positions, settings)
        found = (
            {} if only in UNTOUCHED else touched(held, item, clouds, support, overlay, settings, limits, cause, only)
        )
    return measured, seen.model_copy(update=found)


def touched(
    held: SharedWorld,
    item: Mechanism,
    clouds: Clouds,
    support: SupportPolygon | None,
    overlay: PhysicsOverlay,
    settings: EngineSettings,
    limits: Thresholds,
    cause: CauseOf,
    only: FailureMode | None,
) -> dict[str, object]:
    """The records of the checks that move joints, the root ``held``, by their fields; or of ``only`` one of them."""
    found: dict[str, object] = {}
    if wanted(only, FailureMode.JAM, FailureMode.RELEASE):
        found["sweeps"], stretches = sweeps(held.sound(), item, settings, limits, cause)
    if wanted(only, FailureMode.HOLD):
        found["holds"] = holds(held.sound(), item, settings, limits)
    if wanted(only, FailureMode.EFFORT):
        opened = openings(held.sound(), item, settings)
        found["openings"] = opened
        friction, kind = overlay.contact_friction, overlay.support.kind
        found["efforts"] = efforts(item, clouds, opened, support, friction, limits, kind)
    if wanted(only, FailureMode.RELEASE):
        found["releases"] = releases(held.sound(), item, stretches, settings, limits)
    if wanted(only, FailureMode.NUDGE):
        found["nudges"] = nudges(held.sound(), item, settings, limits)
    return found


def wanted(only: FailureMode | None, *shown: FailureMode) -> bool:
    """Whether the check that shows one of these failures is to run."""
    return only is None or only in shown


def on_a_plane(
    engine: Engine,
    urdf: Path,
    overlay: PhysicsOverlay,
    item: Mechanism,
    clouds: Clouds,
    settings: EngineSettings,
    limits: Thresholds,
    only: FailureMode | None,
) -> tuple[Interaction, SupportPolygon | None, Recording | None]:
    """The checks with a free root, what the object rests on, and the record of its rest: how it stands, the drop at
    both steps, and the perturbed starts; or ``only`` one of them, without that record."""
    seen, support, rest = Interaction(engine=engine), None, None
    drops: list[Drop] = []
    for timestep in (settings.timestep_s, settings.coarse_timestep_s):
        fine = timestep == settings.timestep_s
        if not wanted(only, FailureMode.DROP) and not fine:
            continue
        with shared_world(engine, urdf, overlay, plane=True, timestep_s=timestep) as free:
            if fine:
                stood, resting, support = stand(free.ready(), item, clouds, settings)
                placed = {"stand": stood, "settled": settled(item.joints, resting)}
                seen = seen.model_copy(update=placed)
                rest = record(free.ready(), resting.peak_speed, settings) if only is None else None
            if wanted(only, FailureMode.DROP):
                drops.append(drop(free.sound(), item.start, settings))
            if fine and settings.resets and support is not None and wanted(only, FailureMode.RESET):
                resets = perturbed(free, item, resting, support, settings, limits)
                tips = {"tip_rise_m": support.rise, "support_m": support.furthest}
                seen = seen.model_copy(update={"resets": resets, **tips})
    return seen.model_copy(update={"drops": tuple(drops)}), support, rest


def on_its_mount(
    engine: Engine,
    urdf: Path,
    overlay: PhysicsOverlay,
    held: SharedWorld,
    item: Mechanism,
    settings: EngineSettings,
    limits: Thresholds,
    only: FailureMode | None,
) -> tuple[Interaction, Recording | None]:
    """The same of a fixed object, in the world where its root is ``held``: where its joints settle, rest at both steps
    in place of the drop, and starts with its joints perturbed. It cannot tip, so that nothing is said of its stand."""
    found: dict[str, object] = {}
    resting = rest_held(held.sound(), item, settings)
    rest = record(held.ready(), resting.peak_speed, settings) if only is None else None
    found["settled"] = settled(item.joints, resting)
    if wanted(only, FailureMode.DROP):
        fine = drop(held.sound(), item.start, settings, held=True)
        with shared_world(engine, urdf, overlay, plane=False, timestep_s=settings.coarse_timestep_s) as coarse:
            found["drops"] = fine, drop(coarse.ready(), item.start, settings, held=True)
    if wanted(only, FailureMode.RESET):
        found["resets"] = tuple(
            held_reset(held.sound(), item, share, settings, limits) for share in held_starts(settings)
        )
    return Interaction(engine=engine).model_copy(update=found), rest


def drop(world: World, positions: Mapping[str, float], settings: EngineSettings, *, held: bool = False) -> Drop:
    """Drop the object from ``fall_height_m`` on a plane and watch it until it is still, at most ``fall_s``; from no
    height, and over no plane, where its root is ``held``."""
    height = 0.0 if held else settings.fall_height_m
    world.place(positions, height_m=height)
    seen = watch(world, settings.fall_s, settings)
    return Drop(
        timestep_s=world.timestep_s,
        height_m=height,
        seconds=seen.seconds,
        peak_speed_m_s=seen.peak,
        final_speed_m_s=seen.final,
        sink_m=max(0.0, -capped(world.lowest_m())) if seen.finite and not held else 0.0,
        finite=seen.finite,
    )


def perturbed(
    free: SharedWorld,
    item: Mechanism,
    resting: Resting,
    support: SupportPolygon,
    settings: EngineSettings,
    limits: Thresholds,
) -> tuple[Reset, ...]:
    """The perturbed starts, compared with how the object rests when it is set down undisturbed."""
    # Every second corner of a box gives a tetrahedron: four starts that still tilt in every direction.
    chosen = starts(settings)[:: 2 if len(item.joints) > MANY_JOINTS else 1]
    return tuple(reset(free.sound(), item, shift, tilt, resting, support, settings, limits) for shift, tilt in chosen)
