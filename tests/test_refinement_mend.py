"""The loop over dynamics: what a failing test may change, what is kept, and a gate in PyBullet really mended."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import write_folder, write_urdf
from asset2sim.assets.hulls import link_hulls
from asset2sim.assets.urdf.read import read_dynamics
from asset2sim.checks.at_rest import measurement_verdict, oscillating_joints
from asset2sim.checks.declared_check import Case
from asset2sim.checks.rest import measure
from asset2sim.checks.verdict import failures_of, report_verdict
from asset2sim.refinement.dynamics.mend import Mended, concerned_joints, mend_failures
from asset2sim.refinement.dynamics.remedies import (
    firmer_hold,
    less_damping,
    less_friction,
    lower_mass_ratio,
    more_damping,
    remedies_for,
    with_more_damping,
)
from asset2sim.validation.validate import validate
from schemas.interaction import EngineReport, Interaction, JointMotion, Measurement, Reset
from schemas.overlay import LinkProposal, Overlay, PhysicsOverlay
from schemas.settings import SearchSettings, Settings
from schemas.vocabulary import Engine, FailureMode, Severity, Source, Stage
from tests.assets import NO_VIEWS, joint, link, near, read, robot, shape, written
from tests.factories import make_measurement, make_motion

HEAVY = Overlay(scale=1.0, links=(LinkProposal(name="body", mass_kg=200.0), LinkProposal(name="gate", mass_kg=1.0)))
GATE = robot(
    link("body", shape("1 1 0.2")),
    link("gate", shape("0.3 0.02 0.2", xyz="0.15 0 0")),
    joint("swing", "revolute", "body", "gate", xyz="0 0 0.3", axis="0 0 1", limit="-1.5 1.5"),
)


def report(measurement: Measurement | None, engine: Engine = Engine.PYBULLET, **more: object) -> EngineReport:
    return EngineReport.model_validate(
        {"engine": engine, "engine_version": "1", "measurement": measurement, "seconds": 0.1} | more
    )


class Bench:
    """The gate's refined folder, and every overlay that was measured in it."""

    def __init__(self, folder: Path) -> None:
        self.item: Extraction = read(written(folder / "in", GATE))
        self.calm, _ = validate(self.item, HEAVY, Source.MODEL, 0.5, NO_VIEWS.physics)
        hulls = {name: link_hulls(geometry, 1.0) for name, geometry in self.item.geometry.items()}
        self.folder = write_folder(self.item, self.calm, hulls, folder / "out", NO_VIEWS.physics)
        self.measured: list[PhysicsOverlay] = []

    def verify(
        self, overlay: PhysicsOverlay, engines: Sequence[Engine], only: FailureMode | None = None
    ) -> tuple[EngineReport, ...]:
        assert list(engines) == [Engine.PYBULLET]
        self.measured.append(overlay)
        write_urdf(self.item, overlay, self.folder, NO_VIEWS.physics)
        friction = overlay.contact_friction
        positions = overlay.initial_positions
        return (report(measure(Engine.PYBULLET, self.folder.urdf, positions, friction, NO_VIEWS.engine)),)

    def swinging(self) -> PhysicsOverlay:
        """A spring of 2 Hz with a fiftieth of critical damping and no friction, drawn 0.5 rad."""
        (part,) = self.calm.joints
        k = (2.0 * 3.14159 * 2.0) ** 2 * part.effective_inertia
        loose = {
            "stiffness": k, "spring_reference": 0.5, "friction": 0.0, "initial_position": 0.0,
            "damping": 0.02 * 2.0 * (k * part.effective_inertia) ** 0.5,
        }  # fmt: skip
        return self.calm.model_copy(update={"joints": (part.model_copy(update=loose),)})


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(tmp_path_factory.mktemp("gate"))


@pytest.fixture(scope="module")
def mended(bench: Bench) -> tuple[EngineReport, Mended]:
    loose = bench.swinging()
    before = bench.verify(loose, [Engine.PYBULLET])
    return before[0], mend_failures(bench.item.features, loose, before, NO_VIEWS, bench.verify)


@pytest.mark.system
def test_the_loose_gate_does_oscillate(mended: tuple[EngineReport, Mended]) -> None:
    before = mended[0].measurement
    assert before is not None and oscillating_joints(before, frozenset(), NO_VIEWS.thresholds) == ("swing",)
    assert measurement_verdict(before, frozenset(), NO_VIEWS.thresholds).mode in (
        FailureMode.OSCILLATION,
        FailureMode.DRIFT,
    )


@pytest.mark.system
def test_it_is_mended(bench: Bench, mended: tuple[EngineReport, Mended]) -> None:
    _, result = mended
    assert report_verdict(result.reports[0], result.overlay, NO_VIEWS.thresholds).passed
    (loose,), (part,) = bench.swinging().joints, result.overlay.joints
    assert part.damping > loose.damping and part.damping_source is Source.SEARCH
    assert part.friction == 0.0, "friction would keep a spring from returning"
    bound = NO_VIEWS.physics.max_damping_step * part.least_inertia / NO_VIEWS.physics.coarse_timestep_s
    assert part.damping <= bound * (1.0 + 1e-9)


@pytest.mark.system
def test_its_steps_are_in_the_trace_and_its_changes_in_findings(mended: tuple[EngineReport, Mended]) -> None:
    _, result = mended
    assert 1 <= len(result.trace) <= NO_VIEWS.search.mend_rounds
    assert {step.proposer for step in result.trace} == {"mend"} and result.trace[-1].accepted
    assert all(step.test is not None and step.test.startswith("pybullet ") for step in result.trace)
    assert result.findings and {item.code for item in result.findings} == {"mended"}
    last = [item for item in result.findings if "damping" in item.message][-1]
    assert (last.stage, last.severity, last.joint) == (Stage.REFINE, Severity.INFO, "swing")
    assert last.value == result.overlay.joints[0].damping and "failed in pybullet" in last.message


@pytest.mark.system
def test_what_was_accepted_is_what_is_written(bench: Bench, mended: tuple[EngineReport, Mended]) -> None:
    _, result = mended
    terms = read_dynamics(bench.folder.urdf)["swing"]
    assert near(terms.damping, result.overlay.joints[0].damping, 1e-6)


@pytest.mark.system
def test_a_calm_gate_is_left_alone(bench: Bench) -> None:
    before = bench.verify(bench.calm, [Engine.PYBULLET])
    measured = len(bench.measured)
    result = mend_failures(bench.item.features, bench.calm, before, NO_VIEWS, bench.verify)
    assert (result.overlay, result.reports) == (bench.calm, before)
    assert result.trace == () and result.findings == () and len(bench.measured) == measured


def swing(drift: float, motion: JointMotion | None = None) -> Measurement:
    return make_measurement(drift_m=drift, joints=(motion or make_motion("swing", 0.01),), settle_motion={"swing": 0.0})


Seen = Callable[[int, Engine], Measurement | None]


def seen_as(
    bench: Bench, then: Seen, engines: tuple[Engine, ...] = (Engine.PYBULLET,)
) -> tuple[Mended, list[tuple[PhysicsOverlay, tuple[Engine, ...], FailureMode | None]]]:
    """Mend a gate that measures ``then(0, engine)`` first and ``then(n, engine)`` after the n-th overlay is tried."""
    asked: list[tuple[PhysicsOverlay, tuple[Engine, ...], FailureMode | None]] = []
    tried: list[PhysicsOverlay] = [bench.calm]

    def verify(overlay: PhysicsOverlay, wanted: Sequence[Engine], only: FailureMode | None) -> tuple[EngineReport, ...]:
        asked.append((overlay, tuple(wanted), only))
        if overlay not in tried:
            tried.append(overlay)
        return tuple(report(then(tried.index(overlay), engine), engine) for engine in wanted)

    first = tuple(report(then(0, engine), engine) for engine in engines)
    return mend_failures(bench.item.features, bench.calm, first, NO_VIEWS, verify), asked


def test_changes_that_measure_worse_are_taken_back(bench: Bench) -> None:
    result, asked = seen_as(bench, lambda n, _: swing(0.01 if n == 0 else 0.02))
    assert result.overlay == bench.calm and result.findings == ()
    assert result.trace and not any(step.accepted for step in result.trace)
    assert asked[-1][0] == bench.calm, "the folder holds the accepted overlay again"
    assert {only for _, _, only in asked[:-1]} == {FailureMode.DRIFT}, "of what does not help, nothing else is asked"


def test_remedies_go_on_from_a_step_that_helps_a_little_and_all_checks_run_once_at_the_end(bench: Bench) -> None:
    result, asked = seen_as(bench, lambda n, _: swing(0.0 if n == 3 else 0.1 / (n + 1)))
    assert [step.accepted for step in result.trace] == [True, True, True]
    assert [only for _, _, only in asked] == [FailureMode.DRIFT] * 3 + [None]
    damping = [overlay.joints[0].damping for overlay, _, _ in asked]
    assert damping == sorted(damping) and result.overlay == asked[-1][0] != bench.calm
    assert result.trace[0].value_before == 0.1 and result.trace[0].value_after == 0.05


def test_steps_that_help_and_never_suffice_are_taken_back(bench: Bench) -> None:
    result, asked = seen_as(bench, lambda n, _: swing(0.1 / (n + 1)))
    assert result.overlay == bench.calm == asked[-1][0]
    assert [item.code for item in result.findings] == ["mend_rounds_spent"]
    assert len(result.trace) == NO_VIEWS.search.mend_rounds and not any(step.accepted for step in result.trace)
    assert {only for _, _, only in asked[:-1]} == {FailureMode.DRIFT}


def test_what_helps_one_engine_and_breaks_another_is_not_kept(bench: Bench) -> None:
    def then(n: int, engine: Engine) -> Measurement:
        good = (engine is Engine.MUJOCO) == (n == 0)
        return swing(1e-5 if good else 0.01)

    result, asked = seen_as(bench, then, (Engine.PYBULLET, Engine.MUJOCO))
    assert result.overlay == bench.calm and not any(step.accepted for step in result.trace)
    assert [asked[n][1:] for n in range(3)] == [
        ((Engine.PYBULLET,), FailureMode.DRIFT),
        ((Engine.PYBULLET,), None),
        ((Engine.MUJOCO,), None),
    ]
    assert asked[-1] == (bench.calm, (Engine.PYBULLET, Engine.MUJOCO), None)


def test_what_breaks_a_second_engine_is_not_verified_in_a_third(bench: Bench) -> None:
    def then(n: int, engine: Engine) -> Measurement:
        return swing(0.01 if (engine is Engine.PYBULLET) == (n == 0) else 1e-5)

    result, asked = seen_as(bench, then, (Engine.PYBULLET, Engine.MUJOCO, Engine.SAPIEN))
    assert result.overlay == bench.calm and not any(step.accepted for step in result.trace)
    wanted = [engines for overlay, engines, _ in asked if overlay != bench.calm]
    assert (Engine.MUJOCO,) in wanted and (Engine.SAPIEN,) not in wanted


def test_what_only_moves_a_failure_to_another_start_is_not_verified_further(bench: Bench) -> None:
    still = Reset(
        offset_m=(0.02, 0.02, 0.02), tilt_rad=(0.03, 0.0, 0.0), peak_speed_m_s=1.0, final_speed_m_s=0.0,
        turned_rad=0.0, joint_motion=0.0, finite=True,
    )  # fmt: skip
    moving = still.model_copy(update={"final_speed_m_s": 0.5})
    asked: list[FailureMode | None] = []

    def seen(*resets: Reset) -> EngineReport:
        return report(None, interaction=Interaction(engine=Engine.PYBULLET, resets=resets, tip_rise_m=1.0))

    def verify(
        overlay: PhysicsOverlay, engines: Sequence[Engine], only: FailureMode | None
    ) -> tuple[EngineReport, ...]:
        asked.append(only)
        return (seen(still, moving),)

    result = mend_failures(bench.item.features, bench.calm, (seen(moving, still),), NO_VIEWS, verify)
    assert result.overlay == bench.calm and not any(step.accepted for step in result.trace)
    assert len(asked) > 1 and set(asked[:-1]) == {FailureMode.RESET}


def test_an_engine_that_dies_on_a_proposal_is_no_improvement(bench: Bench) -> None:
    asked = 0

    def verify(
        overlay: PhysicsOverlay, engines: Sequence[Engine], only: FailureMode | None
    ) -> tuple[EngineReport, ...]:
        nonlocal asked
        asked += 1
        return (report(None, problem="pybullet was killed by SIGSEGV"),)

    result = mend_failures(bench.item.features, bench.calm, (report(swing(0.01)),), NO_VIEWS, verify)
    assert asked and result.overlay == bench.calm and not any(step.accepted for step in result.trace)


def test_what_no_parameter_can_mend_is_not_tried(bench: Bench) -> None:
    result, asked = seen_as(bench, lambda *_: make_measurement(penetration_m=0.1))
    assert not asked and not result.trace


def test_no_rounds_no_change(bench: Bench) -> None:
    settings = NO_VIEWS.model_copy(update={"search": SearchSettings(mend_rounds=0)})
    result = mend_failures(bench.item.features, bench.calm, (report(swing(0.01)),), settings, bench.verify)
    assert result.overlay == bench.calm and not result.trace


def case(bench: Bench) -> Case:
    return Case(bench.item.features, NO_VIEWS, ("swing",))


def test_friction_grows_with_damping_where_there_is_no_spring(bench: Bench) -> None:
    first = with_more_damping(case(bench), bench.calm)
    assert first is not None
    # The resistance of 2 % of the object's 201 kg on half of the gate's 0.3 m exceeds three times its own friction.
    assert near(first.joints[0].friction, 0.02 * 201.0 * 9.81 * 0.15, 1e-6)
    second = with_more_damping(case(bench), first)
    assert second is not None and near(second.joints[0].friction, 3.0 * first.joints[0].friction)


def test_what_rocks_on_under_little_rolling_resistance_gets_that_of_a_foot_at_once(bench: Bench) -> None:
    """Steps that do not help are taken back, so that doubling alone would never come to it."""
    limit = NO_VIEWS.thresholds.final_speed_m_s
    made = [item.change(case(bench), bench.calm) for item in remedies_for(FailureMode.RESET, limit, NO_VIEWS)]
    assert [item.rolling_friction_m for item in made if item is not None] == [0.0, 5e-4, 2e-3]


def test_a_spring_gets_no_friction(bench: Bench) -> None:
    loose = bench.swinging()
    damped = with_more_damping(case(bench), loose)
    assert damped is not None and damped.joints[0].friction == 0.0


def test_damping_stays_within_the_time_step(bench: Bench) -> None:
    overlay: PhysicsOverlay | None = bench.calm
    for _ in range(20):
        again = more_damping(case(bench), overlay) if overlay is not None else None
        if again is None:
            break
        overlay = again
    else:
        pytest.fail("damping grows without bound")
    assert overlay is not None
    part = overlay.joints[0]
    bound = NO_VIEWS.physics.max_damping_step * part.least_inertia / NO_VIEWS.physics.coarse_timestep_s
    assert near(part.damping, bound, 1e-3)
    halved = less_damping(case(bench), overlay)
    assert halved is not None and near(halved.joints[0].damping, part.damping / 2.0)


def test_light_links_gain_mass_only_where_others_hang_on_them(bench: Bench) -> None:
    assert lower_mass_ratio(case(bench), bench.calm) is None, "nothing hangs on the gate"
    weights = {"body": 0.1, "gate": 200.0}
    links = tuple(item.model_copy(update={"mass_kg": weights[item.name]}) for item in bench.calm.links)
    closer = lower_mass_ratio(case(bench), bench.calm.model_copy(update={"links": links}))
    assert closer is not None and min(item.mass_kg for item in closer.links) >= 200.0 / 100.0 * (1.0 - 1e-9)


def test_a_joint_that_must_hold_is_not_freed(bench: Bench) -> None:
    (part,) = bench.calm.joints
    holding = bench.calm.model_copy(update={"joints": (part.model_copy(update={"holds": True}),)})
    assert less_friction(case(bench), holding) is None
    firm = firmer_hold(case(bench), holding)
    assert firm is not None and firm.joints[0].friction == pytest.approx(1.5 * part.friction)


def test_what_slips_after_a_reset_is_what_is_mended(tmp_path: Path) -> None:
    slipped = Reset(
        offset_m=(0.0, 0.0, 0.02), tilt_rad=(0.0, 0.0, 0.0), peak_speed_m_s=1.0, final_speed_m_s=0.0, turned_rad=0.0,
        joint_motion=0.3, joint="swing", finite=True,
    )  # fmt: skip
    seen = Interaction(engine=Engine.PYBULLET, drops=(), resets=(slipped,), support_m=0.1)
    told = report(None, interaction=seen)
    overlay = Bench(tmp_path).calm
    (failure,) = failures_of(told, overlay, NO_VIEWS.thresholds)
    assert failure.mode is FailureMode.RESET and "joint 'swing', which must hold" in failure.reason
    assert concerned_joints(overlay, (told,), failure, Settings()) == ("swing",)
    still_moving = failure.__class__(failure.engine, failure.mode, failure.subject, "", 1.0, 0.05)
    assert concerned_joints(overlay, (told,), still_moving, Settings()) == (), "a part that will not rest may be any"
