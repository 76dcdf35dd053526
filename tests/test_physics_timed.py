"""What a person was promised, watched in each engine at 240 Hz and 60 Hz: a lid that closes, a drawer that stops, a
paddle that returns."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from asset2sim.assets.folder import write_folder
from asset2sim.assets.hulls import collision_hulls
from asset2sim.engines.registry import open_world
from asset2sim.engines.world import World
from asset2sim.validation.validate import validate
from schemas.overlay import JointProposal, LinkProposal, Overlay, PhysicsOverlay
from schemas.vocabulary import Engine, Source
from tests.assets import NO_VIEWS, joint, link, read, robot, shape, written

pytestmark = pytest.mark.system

THING = robot(
    link("body", shape("1 1 1")),
    link("lid", shape("0.3 0.3 0.02", xyz="0.15 0 0")),
    link("drawer", shape("0.5 0.4 0.2")),
    link("paddle", shape("0.02 0.02 0.06", xyz="0 0 -0.03")),
    link("door", shape("0.4 0.02 0.6", xyz="0.2 0 0")),
    joint("lid", "revolute", "body", "lid", xyz="0.6 0 1", axis="0 -1 0", limit="0 1.8"),
    joint("drawer", "prismatic", "body", "drawer", xyz="2 0 0", axis="1 0 0", limit="0 0.4"),
    joint("paddle", "revolute", "body", "paddle", xyz="0 2 0", axis="0 1 0", limit="0 0.5"),
    joint("door", "revolute", "body", "door", xyz="0 -2 0", axis="0 0 1", limit="-2 2"),
)
MASSES = {"body": 30.0, "lid": 0.6, "drawer": 2.0, "paddle": 0.02, "door": 3.0}
WISHES = Overlay(
    scale=1.0,
    links=tuple(LinkProposal(name=name, mass_kg=mass) for name, mass in MASSES.items()),
    joints=(
        JointProposal(name="lid", closes_s=1.5, holds=False),
        JointProposal(name="drawer", stops_within=0.1),
        JointProposal(name="paddle", returns_s=0.25, spring_rest=0.0),
        JointProposal(name="door", stops_within=0.5),
    ),
)


@pytest.fixture(scope="module")
def thing(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, PhysicsOverlay]:
    folder = tmp_path_factory.mktemp("thing")
    item = read(written(folder / "in", THING))
    overlay, findings = validate(item, WISHES, Source.MODEL, 0.5, NO_VIEWS.physics)
    assert not [finding for finding in findings if finding.code.endswith("_unmet")]
    return write_folder(item, overlay, collision_hulls(item, 1.0), folder / "out", NO_VIEWS.physics).urdf, overlay


RATES = [(engine, rate) for engine in Engine for rate in (240.0, 60.0)]


@pytest.fixture(params=RATES, ids=str)
def world(thing: tuple[Path, PhysicsOverlay], request: pytest.FixtureRequest) -> Iterator[World]:
    engine, rate = request.param
    pytest.importorskip(engine.value)
    with open_world(engine, thing[0], plane=False, timestep_s=1.0 / rate, contact_friction=0.5) as opened:
        yield opened


def let_go(world: World, name: str, position: float, speed: float = 0.0) -> Iterator[tuple[float, float]]:
    """(s, position) of one joint, step by step, the others where they rest."""
    world.place({name: position})
    world.kick({name: speed})
    index = world.joint_names.index(name)
    for count in range(1, round(4.0 / world.timestep_s)):
        world.step()
        yield count * world.timestep_s, float(world.positions()[index])


@pytest.mark.parametrize(("name", "start", "seconds"), [("lid", 0.9, 1.5), ("paddle", 0.5, 0.25)])
def test_it_closes_or_returns_in_the_time_asked(world: World, name: str, start: float, seconds: float) -> None:
    arrived = next(time for time, position in let_go(world, name, start) if position <= 0.1 * start)
    assert arrived == pytest.approx(seconds, rel=0.25)


@pytest.mark.parametrize(("name", "speed", "distance"), [("drawer", 0.3, 0.1), ("door", 1.0, 0.5)])
def test_it_stops_within_the_distance_asked(world: World, name: str, speed: float, distance: float) -> None:
    *_, (_, end) = let_go(world, name, 0.1, speed)
    assert end - 0.1 == pytest.approx(distance, rel=0.25)


def test_a_wish_is_the_models_own_number_and_all_terms_are_bearable(thing: tuple[Path, PhysicsOverlay]) -> None:
    _, overlay = thing
    for part in overlay.joints:
        assert part.damping_source is Source.MODEL
        bound = NO_VIEWS.physics.max_damping_step * part.least_inertia / NO_VIEWS.physics.coarse_timestep_s
        assert part.damping <= bound * (1.0 + 1e-9)
