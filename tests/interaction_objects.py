"""Objects for the interaction tests: URDFs of boxes, their overlays, and worlds that hold them."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from asset2sim.checks.mechanism import Mechanism, mechanism
from asset2sim.checks.verify import run_checks
from asset2sim.engines.registry import installed, known_engines, open_world
from asset2sim.engines.world import World
from schemas.base import Vector3
from schemas.interaction import Interaction
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Thresholds
from schemas.vocabulary import Engine, FailureMode, OverlapCause, Source
from tests.builders import ORIGIN, UrdfJoint, UrdfLink, bias_of, box, write_urdf
from tests.factories import make_joint

SETTINGS = EngineSettings()
LIMITS = Thresholds()
ENGINES = [pytest.param(engine, marks=[] if engine in installed() else pytest.mark.skip(f"{engine} is not installed"))
           for engine in known_engines()]  # fmt: skip


@dataclass(frozen=True)
class Subject:
    """A written object and its overlay."""

    urdf: Path
    overlay: PhysicsOverlay

    @property
    def item(self) -> Mechanism:
        return mechanism(self.urdf, self.overlay)


def subject(
    folder: Path,
    links: Sequence[UrdfLink],
    joints: Sequence[UrdfJoint],
    *,
    start: Mapping[str, float] | None = None,
    holds: Collection[str] = (),
) -> Subject:
    """The object, its movable joints from closed (lower) to open (upper)."""
    physics = []
    for joint in joints:
        if joint.type == "fixed":
            continue
        endless = joint.type == "continuous"
        changes = {
            "damping": joint.damping,
            "friction": joint.friction,
            "stiffness": joint.stiffness,
            "spring_reference": joint.reference,
            "lower": None if endless else joint.lower,
            "upper": None if endless else joint.upper,
            "closed": 0.0 if endless else joint.lower,
            "open": 0.0 if endless else joint.upper,
            "holds": joint.name in holds,
            "bias": bias_of(joint),
        }
        position = (start or {}).get(joint.name, 0.0)
        physics.append(make_joint(joint.name, joint.type, position).model_copy(update=changes))
    overlay = PhysicsOverlay(
        asset_id="1", scale=1.0, scale_source=Source.RULE, contact_friction=0.8, links=(), joints=tuple(physics)
    )
    return Subject(write_urdf(folder, links, joints), overlay)


def solid(name: str, size: Vector3, at: Vector3 = ORIGIN, mass: float = 1.0) -> UrdfLink:
    """A uniform box of these edges, m, with its centre ``at`` in the link's frame."""
    x, y, z = (edge**2 for edge in size)
    inertia = (mass * (y + z) / 12, 0.0, 0.0, mass * (x + z) / 12, 0.0, mass * (x + y) / 12)
    return UrdfLink(name, mass, at, inertia, ((box(*size), at),))


def bare(name: str, mass: float = 1.0, com: Vector3 = ORIGIN, moment: float = 0.01) -> UrdfLink:
    """A link that collides with nothing."""
    return UrdfLink(name, mass, com, (moment, 0.0, 0.0, moment, 0.0, moment))


@contextmanager
def opened(
    item: Subject, engine: Engine = Engine.PYBULLET, *, plane: bool = False, hz: float = 240.0
) -> Iterator[World]:
    """A world of the object."""
    with open_world(
        engine, item.urdf, plane=plane, timestep_s=1.0 / hz, contact_friction=item.overlay.contact_friction
    ) as world:
        yield world


def hull_cause(a: str, b: str, positions: Mapping[str, float]) -> OverlapCause:
    """Every overlap is a hull's."""
    return OverlapCause.HULL


def authored_cause(a: str, b: str, positions: Mapping[str, float]) -> OverlapCause:
    """Every overlap is authored."""
    return OverlapCause.AUTHORED


def interaction(
    engine: Engine, item: Subject, settings: EngineSettings = SETTINGS, *, only: FailureMode | None = None
) -> Interaction:
    """The interaction checks of a subject in one engine, every overlap a hull's."""
    return run_checks(engine, item.urdf, item.overlay, settings, LIMITS, cause=hull_cause, only=only)[1]
