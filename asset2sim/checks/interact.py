"""All checks of one asset in one engine: loaded once on a plane, once held, once at the coarse step."""

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

from asset2sim.checks.known_checks import run_for
from asset2sim.checks.mechanism import mechanism
from asset2sim.checks.rest import contacts_of, measurement
from asset2sim.checks.rig import CauseOf, Rig, shared_world
from asset2sim.checks.support_polygon import point_clouds
from schemas.base import Frozen
from schemas.interaction import Interaction
from schemas.measurement import Measurement
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Thresholds
from schemas.vocabulary import Engine, FailureMode


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
    made in ``known_checks``. Raises AssetError (engine_refused) where the engine refuses the file.
    """
    item, clouds, whole = mechanism(urdf, overlay), point_clouds(urdf), only is None
    found: dict[str, object] = {}
    with ExitStack() as stack:
        held, free = (
            stack.enter_context(shared_world(engine, urdf, overlay, plane=plane, timestep_s=settings.timestep_s))
            for plane in (False, True)
        )
        rig = Rig(engine, urdf, overlay, settings, limits, cause, item, clouds, held, free, whole)
        # First, while the world is fresh: contact caches make Φ depend slightly on earlier poses.
        points = contacts_of(held.ready(), item.start) if whole else []
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
