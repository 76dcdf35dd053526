"""What several engines say of one asset: failures, disagreements, what stops a joint; an asset judged as it came."""

from pathlib import Path

import pytest

from asset2sim.assets.urdf.bake import unbake
from asset2sim.checks.verdict import disagreements, failures_of, overall_verdict
from asset2sim.engines.registry import installed
from schemas.interaction import Obstacle, Sweep
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings, Settings, Thresholds
from schemas.vocabulary import (
    CollisionMode,
    Engine,
    Export,
    FailureMode,
    Method,
    OverlapCause,
    Severity,
    StateMode,
    Status,
)
from tasks.measure import obstacles, report_findings
from tasks.pipeline import refine_asset
from tasks.publish import bake
from tests.assets import NO_VIEWS, fingerprint, near, prior, sample
from tests.factories import make_drop, make_measurement, make_motion, make_record, make_report

LIMITS = Thresholds()


def overlay() -> PhysicsOverlay:
    found = make_record().overlay
    assert found is not None
    return found


def test_an_engine_that_died_fails_with_what_became_of_it() -> None:
    dead = make_report(Engine.SAPIEN, measurement=None, interaction=None, problem="sapien crashed: killed by SIGSEGV")
    (failure,) = failures_of(dead, overlay(), LIMITS)
    assert (failure.mode, failure.reason) == (FailureMode.ENGINE_CRASH, dead.problem)
    refused = dead.model_copy(update={"refused": True})
    assert failures_of(refused, overlay(), LIMITS)[0].mode is FailureMode.ENGINE_REFUSED, "it would come again"
    late = dead.model_copy(update={"timed_out": True})
    assert failures_of(late, overlay(), LIMITS)[0].mode is FailureMode.TIMEOUT
    verdict = overall_verdict((make_report(Engine.PYBULLET), dead), overlay(), Settings())
    assert verdict.mode is FailureMode.ENGINE_CRASH
    others = Settings(engine=EngineSettings(decide=(Engine.PYBULLET,)))
    assert overall_verdict((make_report(Engine.PYBULLET), dead), overlay(), others).passed, "it is recorded only"


def test_every_failing_test_is_told_and_the_first_is_the_verdict() -> None:
    bad = make_report(Engine.MUJOCO, measurement=make_measurement(drift_m=0.5, engine="mujoco"))
    assert bad.interaction is not None
    fast = bad.interaction.model_copy(update={"drops": (make_drop(peak_speed_m_s=50.0),)})
    reports = (make_report(Engine.PYBULLET), bad.model_copy(update={"interaction": fast}))
    told = [item for item in report_findings(reports, overlay(), Settings()) if item.severity is Severity.ERROR]
    assert [item.code for item in told] == ["drift", "drop"] and told[0].value == 0.5
    assert overall_verdict(reports, overlay(), Settings()).reason == told[0].message
    refused = make_report(Engine.SAPIEN, measurement=None, interaction=None, problem="no mass", refused=True)
    assert overall_verdict((*reports, refused), overlay(), Settings()).mode is FailureMode.ENGINE_REFUSED


def test_engines_that_disagree_are_told_with_all_numbers() -> None:
    calm = make_report(Engine.PYBULLET)
    wild = make_report(Engine.MUJOCO, measurement=make_measurement(drift_m=0.02, engine="mujoco"))
    (finding,) = disagreements((calm, wild), overlay(), LIMITS)
    assert finding.code == "engines_disagree" and "pybullet 0.0001 m, mujoco 0.02 m" in finding.message
    both = make_report(Engine.PYBULLET, measurement=make_measurement(drift_m=0.03))
    assert disagreements((both, wild), overlay(), LIMITS) == [], "both fail: they agree"


def test_an_oscillating_joint_is_the_failure_s_subject() -> None:
    swings = make_measurement(joints=(make_motion("hinge", 0.5, 9),))
    (failure,) = failures_of(make_report(Engine.PYBULLET, measurement=swings), overlay(), LIMITS)
    assert (failure.mode, failure.subject) == (FailureMode.OSCILLATION, "hinge")


def test_what_stops_a_joint_is_told_once_with_the_deepest_overlap() -> None:
    stops = [
        Obstacle(position=0.4, link_a="door", link_b="body", depth_m=depth, cause=OverlapCause.AUTHORED)
        for depth in (0.002, 0.008)
    ]
    sweep = Sweep(joint="hinge", lower=0.0, upper=1.0, free_share=0.4, obstacles=tuple(stops))
    reports = []
    for engine in (Engine.PYBULLET, Engine.MUJOCO):
        report = make_report(engine)
        assert report.interaction is not None
        seen = report.interaction.model_copy(update={"sweeps": (sweep,)})
        reports.append(report.model_copy(update={"interaction": seen}))
    (finding,) = obstacles(reports, Settings())
    assert finding.joint == "hinge" and "40%" in finding.message and "8 mm (as authored)" in finding.message


@pytest.mark.system
def test_an_asset_as_it_came_is_judged_in_every_engine_and_nothing_is_written(tmp_path: Path) -> None:
    before = fingerprint(Path(sample("laptop_silver").path))
    raw = NO_VIEWS.model_copy(update={"method": Method.RAW})
    record = refine_asset(sample("laptop_silver"), tmp_path, raw, prior)
    assert record.status is Status.FAILED and record.method is Method.RAW and record.calls == ()
    assert [report.engine for report in record.reports] == list(installed())
    assert record.overlay is not None and record.overlay.scale == 1.0
    # What is known of its meshes is kept for the next time, out of sight.
    assert [path.name for path in tmp_path.iterdir()] == [".cache"]
    assert fingerprint(Path(sample("laptop_silver").path)) == before


@pytest.mark.system
def test_interaction_can_be_left_out_and_engines_chosen(tmp_path: Path) -> None:
    few = NO_VIEWS.model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,), interact=False)})
    record = refine_asset(sample("scissors_paper"), tmp_path, few, prior)
    (report,) = record.reports
    assert report.engine is Engine.PYBULLET and report.interaction is None and record.status is Status.OK


@pytest.mark.system
def test_a_baked_state_is_the_urdf_s_zero_can_be_undone_and_keeps_what_overlaps(tmp_path: Path) -> None:
    kept = refine_asset(sample("laptop_silver"), tmp_path / "kept", NO_VIEWS, prior)
    settings = NO_VIEWS.model_copy(update={"state": StateMode.BAKE, "exports": (Export.MJCF,)})
    record = refine_asset(sample("laptop_silver"), tmp_path / "baked", settings, prior)
    assert kept.overlay is not None and record.overlay is not None and record.status is Status.OK
    assert not [finding for finding in record.findings if finding.code == "bake_differs"]
    (was,), (now,) = kept.overlay.joints, record.overlay.joints
    assert now.initial_position == 0.0 and was.initial_position != 0.0
    assert was.lower is not None and now.lower is not None and near(now.lower, was.lower - was.initial_position)
    one, two = (tmp_path / name / "assets" / "laptop_silver" for name in ("kept", "baked"))
    assert unbake((two / "mobility.urdf").read_bytes()) == (one / "mobility.urdf").read_bytes()
    assert (two / "mobility.xml").is_file() and not (one / "mobility.xml").exists()
    _, findings = bake(one / "mobility.urdf", kept.overlay, Settings())
    assert findings == ()


@pytest.mark.system
@pytest.mark.parametrize("mode", list(CollisionMode))
def test_every_collision_mode_refines(tmp_path: Path, mode: CollisionMode) -> None:
    collision = NO_VIEWS.collision.model_copy(update={"mode": mode})
    record = refine_asset(
        sample("storage_sideboard"), tmp_path, NO_VIEWS.model_copy(update={"collision": collision}), prior
    )
    folder = tmp_path / "assets" / "storage_sideboard"
    assert (folder / "mobility.urdf").is_file() and record.reports
    assert (folder / "collision").exists() == (mode is not CollisionMode.KEEP)
    if mode is not CollisionMode.KEEP:
        assert record.status is Status.OK, record.reason
