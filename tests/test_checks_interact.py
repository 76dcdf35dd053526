"""All interaction tests of one object in each engine, and a world that is loaded afresh once it is spoilt."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from asset2sim.checks import verify as verifying
from asset2sim.checks.declared_check import interaction_verdicts
from asset2sim.checks.mechanism import Mechanism, mechanism
from asset2sim.checks.rest import measure
from asset2sim.checks.rig import opener_of, shared_world
from asset2sim.checks.verify import run_checks, verify
from asset2sim.engines.child import ChildOutcome
from asset2sim.engines.registry import installed
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings
from schemas.support import Support, SupportKind
from schemas.vocabulary import Engine, FailureMode, Source
from tests.assets import NO_VIEWS
from tests.builders import UrdfJoint
from tests.interaction_objects import ENGINES, LIMITS, SETTINGS, Subject, hull_cause, interaction, solid, subject

pytestmark = pytest.mark.system


def cabinet(folder: Path, *, drawer_friction: float = 4.0) -> Subject:
    """A squat cabinet with a drawer that must hold, a lid that gravity closes and a knob on the drawer."""
    links = [
        solid("body", (0.5, 0.5, 0.3), mass=12.0),
        solid("drawer", (0.3, 0.3, 0.1), mass=1.0),
        solid("lid", (0.3, 0.3, 0.01), (0.15, 0.0, 0.0), 0.4),
        solid("knob", (0.02, 0.02, 0.02), mass=0.05),
    ]
    joints = [
        UrdfJoint("slide", "prismatic", "body", "drawer", (1.0, 0.0, 0.0), (0.41, 0.0, 0.0), 0.0, 0.2, 10.0,
                  drawer_friction),
        UrdfJoint("hinge", "revolute", "body", "lid", (0.0, -1.0, 0.0), (-0.15, 0.0, 0.2), 0.0, 1.4, 0.1),
        UrdfJoint("turn", "continuous", "drawer", "knob", (1.0, 0.0, 0.0), (0.17, 0.0, 0.0), -3.0, 3.0, 1e-4, 1e-3),
    ]  # fmt: skip
    return subject(folder, links, joints, holds=["slide"])


@pytest.mark.parametrize("engine", ENGINES)
def test_an_object_that_behaves_passes_every_test(tmp_path: Path, engine: Engine) -> None:
    item = cabinet(tmp_path, drawer_friction=30.0)
    seen = interaction(engine, item)
    verdicts = interaction_verdicts(seen, item.overlay, LIMITS)
    assert [verdict.reason for verdict in verdicts if not verdict.passed] == []
    counts = {mode: sum(1 for verdict in verdicts if verdict.test is mode) for mode in FailureMode}
    assert counts[FailureMode.DROP] == 2 and counts[FailureMode.RESET] == 8
    assert counts[FailureMode.NUDGE] == counts[FailureMode.JAM] == 3
    assert counts[FailureMode.HOLD] == counts[FailureMode.RELEASE] == 1
    assert {record.joint: record.by for record in seen.releases} == {"hinge": "gravity"}
    assert len(seen.openings) == 3 and seen.openings[0].opening == pytest.approx(30.0, rel=0.03)


def test_the_same_object_gives_the_same_record(tmp_path: Path) -> None:
    item = cabinet(tmp_path)
    one, two = (interaction(Engine.PYBULLET, item) for _ in range(2))
    assert one == two


@pytest.mark.parametrize("engine", ENGINES)
def test_the_measurement_at_rest_from_shared_worlds_is_that_of_its_own(tmp_path: Path, engine: Engine) -> None:
    item = cabinet(tmp_path)
    held = Support(kind=SupportKind.FIXED, source=Source.USER, confidence=1.0)
    for overlay in (item.overlay, item.overlay.model_copy(update={"support": held})):
        own = (overlay.initial_positions, overlay.contact_friction, SETTINGS)
        alone = measure(engine, item.urdf, *own, held=overlay.support.fixed)
        assert run_checks(engine, item.urdf, overlay, SETTINGS, LIMITS, cause=hull_cause)[0] == alone
    assert run_checks(engine, item.urdf, overlay, SETTINGS, LIMITS, cause=hull_cause, only=FailureMode.JAM)[0] is None


@pytest.mark.parametrize(
    ("mode", "records"),
    [
        (FailureMode.DROP, {"drops"}),
        (FailureMode.RESET, {"resets"}),
        (FailureMode.JAM, {"sweeps"}),
        (FailureMode.HOLD, {"holds"}),
        (FailureMode.NUDGE, {"nudges"}),
        (FailureMode.RELEASE, {"sweeps", "releases"}),
    ],
)
def test_one_test_alone_shows_what_it_shows_among_all(tmp_path: Path, mode: FailureMode, records: set[str]) -> None:
    item = cabinet(tmp_path)
    whole, alone = (interaction(Engine.PYBULLET, item, only=only) for only in (None, mode))
    kinds = {"drops", "resets", "sweeps", "holds", "openings", "nudges", "releases"}
    assert {kind for kind in kinds if getattr(alone, kind)} == records
    shown = [
        {test.subject: test.passed for test in interaction_verdicts(seen, item.overlay, LIMITS) if test.test is mode}
        for seen in (whole, alone)
    ]
    assert shown[0] == shown[1] and shown[0]


def test_no_resets_can_be_asked_for(tmp_path: Path) -> None:
    item = cabinet(tmp_path)
    few = EngineSettings(resets=0, sweep_samples=5)
    seen = interaction(Engine.PYBULLET, item, few)
    assert seen.resets == () and len(seen.drops) == 2


def test_a_spoilt_world_is_loaded_afresh(tmp_path: Path) -> None:
    item = cabinet(tmp_path)
    with shared_world(opener_of(Engine.PYBULLET), item.urdf, item.overlay, plane=False, timestep_s=1 / 240) as held:
        world = held.ready()
        assert held.sound() is world
        world.place({"slide": float("nan")})
        fresh = held.sound()
        assert fresh is not world and np.isfinite(fresh.positions()).all()


def test_engines_that_share_a_process_read_the_file_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    item, calls = cabinet(tmp_path), list[Path]()

    def counted(urdf: Path, overlay: PhysicsOverlay) -> Mechanism:
        calls.append(urdf)
        return mechanism(urdf, overlay)

    monkeypatch.setattr(verifying, "mechanism", counted)

    def here(work: Mapping[Engine, Callable[[], object]], time_limit_s: float) -> dict[Engine, ChildOutcome[object]]:
        return {engine: ChildOutcome(call()) for engine, call in work.items()}

    monkeypatch.setattr(verifying, "in_children", here)
    verify(installed(), item.urdf, item.overlay, hull_cause, NO_VIEWS, FailureMode.HOLD)
    assert len(calls) == 1
