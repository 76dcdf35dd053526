"""Fixed objects are tested with their root held: nothing falls or tips, and joints are perturbed instead of poses."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from asset2sim.checks.declared_check import interaction_verdicts
from asset2sim.checks.mechanism import Mechanism
from asset2sim.checks.reset import held_start, held_starts
from asset2sim.checks.rest import measure
from schemas.interaction import Interaction
from schemas.settings import EngineSettings
from schemas.support import Support, SupportKind
from schemas.vocabulary import Engine, FailureMode, Source
from tests.builders import UrdfJoint
from tests.factories import make_joint
from tests.interaction_objects import ENGINES, LIMITS, SETTINGS, Subject, interaction, solid, subject

FIXED = Support(kind=SupportKind.FIXED, source=Source.USER, confidence=1.0)
SHORT = EngineSettings(fall_s=4.0, resets=4)


def leaf(folder: Path, **joint: object) -> Subject:
    """A leaf of 10 kg on a post as thin as a broomstick, hinged along ``axis``: free, it falls over."""
    fields: dict[str, object] = {
        "name": "swing", "type": "revolute", "parent": "post", "child": "leaf", "xyz": (0.0, 0.02, 1.0),
        "axis": (0.0, 0.0, 1.0), "lower": 0.0, "upper": 1.5, "damping": 1.0, "friction": 0.5,
    }  # fmt: skip
    hinge = UrdfJoint(**(fields | joint))  # type: ignore[arg-type]
    links = [solid("post", (0.02, 0.02, 2.0), (0.0, 0.0, 1.0)), solid("leaf", (0.02, 0.8, 1.8), (0.0, 0.42, 0.0), 10.0)]
    return subject(folder, links, [hinge], start={"swing": 0.7}, holds={"swing"})


def seen(item: Subject, engine: Engine, support: Support = FIXED, only: FailureMode | None = None) -> Interaction:
    overlay = item.overlay.model_copy(update={"support": support})
    return interaction(engine, replace(item, overlay=overlay), SHORT, only=only)


@pytest.mark.system
@pytest.mark.parametrize("engine", ENGINES)
def test_a_door_passes_fixed_and_falls_over_free(engine: Engine, tmp_path: Path) -> None:
    item = leaf(tmp_path)
    fixed, free = seen(item, engine), seen(item, engine, Support(), FailureMode.STANDS)
    overlay = item.overlay.model_copy(update={"support": FIXED})
    failed = [verdict for verdict in interaction_verdicts(fixed, overlay, LIMITS) if not verdict.passed]
    assert failed == [], "every check passes"
    assert fixed.stand is None and len(fixed.drops) == 2 and len(fixed.resets) == 2
    assert all(drop.height_m == 0.0 for drop in fixed.drops)
    assert free.stand is not None and free.stand.tilt_rad > 0.5, "free, it falls"
    # A hand needs friction over the leaf's 0.82 m, and nothing tips.
    [opening] = [effort for effort in fixed.efforts if effort.way == "opening"]
    assert opening.tips_at_n is None and opening.slides_at_n is None
    assert opening.force_n == pytest.approx(0.5 / math.hypot(0.82, 0.01), rel=0.2)


@pytest.mark.system
@pytest.mark.parametrize("engine", ENGINES)
def test_the_root_stays_and_a_level_hinge_without_friction_does_not(engine: Engine, tmp_path: Path) -> None:
    # Hinged along x under gravity, a leaf that must hold and has no friction falls: fixed objects fail for it.
    item = leaf(tmp_path, axis=(1.0, 0.0, 0.0), lower=-1.5, friction=0.0)
    state, friction = item.overlay.initial_positions, item.overlay.contact_friction
    rest = measure(engine, item.urdf, state, friction, SETTINGS, held=True)
    assert rest.drift_m < 1e-6 and rest.drift_rad < 1e-6, "the root is held"
    found = seen(item, engine, only=FailureMode.RESET)
    overlay = item.overlay.model_copy(update={"support": FIXED})
    moved = [reset.joint_motion for reset in found.resets]
    assert min(moved) > 0.2, "it leaves the way between where it is to be and where it is put"
    assert {v.passed for v in interaction_verdicts(found, overlay, LIMITS) if v.test is FailureMode.RESET} == {False}


def test_perturbed_starts_go_both_ways_and_then_half_as_far() -> None:
    assert held_starts(EngineSettings(resets=8)) == [0.05, -0.05, 0.025, -0.025]
    assert held_starts(EngineSettings(resets=0)) == []


def test_in_perturbed_starts_each_joint_is_moved_both_ways() -> None:
    joints = tuple(make_joint(name, initial_position=0.5) for name in ("first", "second"))
    item = Mechanism("base", (), {}, joints, {}, {}, {}, {})
    starts = [held_start(item, share) for share in held_starts(EngineSettings(resets=4))]
    assert starts == [{"first": 0.55, "second": 0.45}, {"first": 0.45, "second": 0.55}]
