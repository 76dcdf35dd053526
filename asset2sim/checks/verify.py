"""Verify one written asset: the paper's checks and interaction, engine after engine in a process that can be killed."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import cache, partial
from pathlib import Path

import numpy as np

from asset2sim.assets.authored_overlap import authored_shapes, overlap_cause
from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.collision_points import know_points
from asset2sim.checks.at_rest import CHECK as AT_REST
from asset2sim.checks.declared_check import run_for
from asset2sim.checks.mechanism import Mechanism, mechanism
from asset2sim.checks.rest import measure, measurement
from asset2sim.checks.rig import CauseOf, Rig, opener_of, shared_world
from asset2sim.checks.set_down import Clouds, point_clouds
from asset2sim.checks.verdict import verdicts_of
from asset2sim.engines.child import ChildOutcome, in_child, in_children
from asset2sim.engines.registry import engine_version, installed, require
from asset2sim.engines.static_object import contact_points
from asset2sim.engines.world import Opener
from asset2sim.physics.kinematics import link_to_root, tree_of, written_joints
from schemas.base import Frozen
from schemas.errors import UsageError
from schemas.interaction import EngineReport, Interaction, Measurement
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Settings, Thresholds
from schemas.vocabulary import Engine, FailureMode, OverlapCause


def run_checks(
    engine: Engine,
    urdf: Path,
    overlay: PhysicsOverlay,
    settings: EngineSettings,
    limits: Thresholds,
    *,
    cause: CauseOf,
    only: FailureMode | None = None,
    opener: Opener | None = None,
    read: Callable[[], tuple[Mechanism, Clouds]] | None = None,
) -> tuple[Measurement | None, Interaction]:
    """Run every check on a written asset in its initial state, or ``only`` one interaction check and those that it
    needs, without the paper's measurement; in worlds that ``opener`` opens in place of the engine's own. ``read`` gives
    what is read of the file before.

    ``limits`` state how deep an overlap stops a sweep, and which records are worth a second, single run; verdicts are
    made in ``known_checks``. Raises AssetError (engine_refused) where the engine refuses the file.
    """
    item, clouds = read() if read is not None else (mechanism(urdf, overlay), point_clouds(urdf))
    whole = only is None
    found: dict[str, object] = {}
    opener = opener or opener_of(engine)
    with ExitStack() as stack:
        held, free = (
            stack.enter_context(shared_world(opener, urdf, overlay, plane=plane, timestep_s=settings.timestep_s))
            for plane in (False, True)
        )
        rig = Rig(engine, urdf, overlay, settings, limits, cause, item, clouds, held, free, opener, whole)
        # First, while the world is fresh: contact caches make Φ depend slightly on earlier poses.
        points = contact_points(held.ready(), item.start) if whole else []
        for check in run_for(only):
            if not check.on_plane:
                free.close()
            if check.measure is not None:
                found |= check.measure(rig)
        rest = rig.down().rest if whole else None
    measured = None if rest is None else measurement(engine, points, rest, overlay.initial_positions, settings)
    return measured, interaction_of(engine, found)


def interaction_of(engine: Engine, found: Mapping[str, object]) -> Interaction:
    """The records by their fields; those of checks from outside the package in ``further``."""
    own = {name: records for name, records in found.items() if name in Interaction.model_fields}
    further = {
        name: tuple(item.model_dump(mode="json") for item in records if isinstance(item, Frozen))
        for name, records in found.items()
        if name not in own and isinstance(records, tuple | list)
    }
    return Interaction(engine=engine).model_copy(update=own | {"further": further})


def engines_of(settings: EngineSettings) -> tuple[Engine, ...]:
    """The engines to verify in. Raises UsageError for one that is not installed, or decides without checking."""
    for engine in settings.verify or ():
        require(engine)
    engines = settings.verify or installed()
    if settings.decide is not None and not set(settings.decide) <= set(engines):
        stated, there = (", ".join(names) for names in (settings.decide, engines))
        raise UsageError(f"--verify names {stated}, of which some do not check: choose among {there}")
    return engines


def verify(
    engines: Sequence[Engine],
    urdf: Path,
    overlay: PhysicsOverlay,
    cause: CauseOf,
    settings: Settings,
    only: FailureMode | None = None,
) -> tuple[EngineReport, ...]:
    """A report from each engine of every check, or ``only`` of the one that shows this failure, on the URDF in the
    overlay's initial state, with the verdict on it; an engine that dies costs only its report. ``cause`` says of two
    overlapping links whether the authored meshes overlap or only their hulls."""
    # What all engines read of the file is read once in the process that they share.
    read = cache(lambda: (mechanism(urdf, overlay), point_clouds(urdf)))
    own, seen = settings.engine, partial(run_checks, limits=settings.thresholds, cause=cause, only=only, read=read)
    know_points(urdf)
    touched: dict[Engine, ChildOutcome[tuple[Measurement | None, Interaction]]] = {}
    if own.interact and only not in AT_REST.modes:
        calls = {engine: partial(seen, engine, urdf, overlay, own) for engine in engines}
        touched = in_children(calls, time_limit_s=own.time_limit_s)
    nothing: ChildOutcome[tuple[Measurement | None, Interaction]] = ChildOutcome(None)
    return tuple(report_of(engine, touched.get(engine, nothing), urdf, overlay, settings, only) for engine in engines)


def report_of(
    engine: Engine,
    touched: ChildOutcome[tuple[Measurement | None, Interaction]],
    urdf: Path,
    overlay: PhysicsOverlay,
    settings: Settings,
    only: FailureMode | None,
) -> EngineReport:
    """One engine's report of what came of its checks; where they left no measurement at rest, it is taken now."""
    own = settings.engine
    rested, interaction = touched.value or (None, None)
    measured = ChildOutcome(rested)
    if rested is None and (only is None or only in AT_REST.modes):
        # An engine that dies in an interaction check still leaves its measurement at rest.
        state, friction = overlay.initial_positions, overlay.contact_friction
        rest = partial(measure, engine, urdf, state, friction, own, held=overlay.support.fixed)
        measured = in_child(engine, rest, time_limit_s=own.time_limit_s)
    report = EngineReport(
        engine=engine,
        engine_version=engine_version(engine),
        measurement=measured.value,
        interaction=interaction,
        problem=measured.problem or touched.problem,
        timed_out=measured.timed_out or touched.timed_out,
        died=measured.died or touched.died,
        refused=measured.refused or touched.refused,
        starved=measured.starved or touched.starved,
        seconds=measured.seconds + touched.seconds,
    )
    return report.model_copy(update={"judged": verdicts_of(report, overlay, settings.thresholds)})


def cause_for(extraction: Extraction, overlay: PhysicsOverlay) -> CauseOf:
    """Function that tells whether two links' authored meshes overlap at given joint positions, or only their hulls."""
    features, shapes = extraction.features, authored_shapes(extraction, overlay.scale)
    tree = tree_of(written_joints(features, overlay), overlay.scale)

    def cause(a: str, b: str, positions: Mapping[str, float]) -> OverlapCause:
        poses = link_to_root(tree, features.root, positions)
        return overlap_cause(shapes, a, b, np.linalg.inv(poses[b]) @ poses[a])

    return cause
