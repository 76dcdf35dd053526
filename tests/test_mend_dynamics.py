"""Mending joint dynamics: a gate on a soft, undamped spring swings untouched until damping and friction are raised."""

from collections.abc import Callable
from pathlib import Path

import pytest

from asset2sim.apply import write_folder, write_urdf
from asset2sim.collision.hulls import collision_hulls
from asset2sim.engines.pybullet_rest import measure
from asset2sim.extraction import Extraction
from asset2sim.metrics.verdict import judge, oscillating_joints
from asset2sim.search.dynamics import Mended, mend_dynamics
from asset2sim.urdf.dynamics import read_dynamics
from asset2sim.validation import validate
from schemas.measurement import JointMotion, Measurement
from schemas.overlay import LinkProposal, Overlay, PhysicsOverlay
from schemas.settings import SearchSettings
from schemas.vocabulary import FailureMode, Severity, Source, Stage
from tests.assets import UNSEEN, joint, link, near, read, robot, shape, written
from tests.factories import make_measurement, make_motion

HEAVY = Overlay(scale=1.0, links=(LinkProposal(name="body", mass_kg=200.0), LinkProposal(name="gate", mass_kg=1.0)))
GATE = robot(
    link("body", shape("1 1 0.2")),
    link("gate", shape("0.3 0.02 0.2", xyz="0.15 0 0")),
    joint("swing", "revolute", "body", "gate", xyz="0 0 0.3", axis="0 0 1", limit="-1.5 1.5"),
)


class Bench:
    """The gate's refined folder, and every overlay that was measured in it."""

    def __init__(self, folder: Path) -> None:
        self.item: Extraction = read(written(folder / "in", GATE))
        calm, _ = validate(self.item, HEAVY, Source.MODEL, 0.5, UNSEEN.physics)
        self.calm = calm
        self.folder = write_folder(self.item, calm, collision_hulls(self.item, 1.0), folder / "out", UNSEEN.physics)
        self.measured: list[PhysicsOverlay] = []

    def measure(self, overlay: PhysicsOverlay) -> Measurement:
        self.measured.append(overlay)
        write_urdf(self.item, overlay, self.folder, UNSEEN.physics)
        return measure(self.folder.urdf, overlay.initial_positions, overlay.contact_friction, UNSEEN.engine)

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
def mended(bench: Bench) -> tuple[Measurement, Mended]:
    loose = bench.swinging()
    before = bench.measure(loose)
    return before, mend_dynamics(bench.item.features, loose, before, UNSEEN, bench.measure)


def test_the_loose_gate_does_oscillate(mended: tuple[Measurement, Mended]) -> None:
    before, _ = mended
    assert oscillating_joints(before, frozenset(), UNSEEN.thresholds) == ("swing",)
    assert judge(before, frozenset(), UNSEEN.thresholds).mode in (FailureMode.OSCILLATION, FailureMode.DRIFT)


def test_it_is_mended(bench: Bench, mended: tuple[Measurement, Mended]) -> None:
    _, result = mended
    assert judge(result.measurement, frozenset(), UNSEEN.thresholds).passed
    (loose,), (part,) = bench.swinging().joints, result.overlay.joints
    assert part.damping > loose.damping and part.damping_source is Source.SEARCH
    assert part.stiffness == loose.stiffness and part.friction == 0.0, "friction would keep a spring from returning"
    bound = UNSEEN.physics.max_damping_step * part.effective_inertia / UNSEEN.physics.coarse_timestep_s
    assert part.damping <= bound * (1.0 + 1e-9)


def test_its_steps_are_in_the_trace_and_its_changes_in_findings(mended: tuple[Measurement, Mended]) -> None:
    _, result = mended
    assert 1 <= len(result.trace) <= UNSEEN.search.mend_rounds
    assert {step.proposer for step in result.trace} == {"dynamics"}
    assert all("swing" in step.reason or "drift" in step.reason for step in result.trace)
    assert result.trace[-1].accepted and [step.step for step in result.trace] == list(range(len(result.trace)))
    (finding,) = result.findings
    assert (finding.stage, finding.severity, finding.code, finding.joint) == (
        Stage.REFINE, Severity.INFO, "dynamics_raised", "swing",
    )  # fmt: skip
    assert finding.value == result.overlay.joints[0].damping


def test_what_was_accepted_is_what_is_written(bench: Bench, mended: tuple[Measurement, Mended]) -> None:
    _, result = mended
    terms = read_dynamics(bench.folder.urdf)["swing"]
    assert near(terms.damping, result.overlay.joints[0].damping, 1e-6)


def test_a_calm_gate_is_left_alone(bench: Bench) -> None:
    before = bench.measure(bench.calm)
    measured = len(bench.measured)
    result = mend_dynamics(bench.item.features, bench.calm, before, UNSEEN, bench.measure)
    assert (result.overlay, result.measurement) == (bench.calm, before)
    assert result.trace == () and result.findings == () and len(bench.measured) == measured


def seen_as(bench: Bench, then: Callable[[int], Measurement]) -> tuple[Mended, list[PhysicsOverlay]]:
    """Mend a gate whose measurement is ``then(0)`` first and ``then(n)`` after its n-th change."""
    asked: list[PhysicsOverlay] = []

    def remeasure(overlay: PhysicsOverlay) -> Measurement:
        asked.append(overlay)
        return then(len(asked))

    return mend_dynamics(bench.item.features, bench.calm, then(0), UNSEEN, remeasure), asked


def swing(drift: float, motion: JointMotion | None = None) -> Measurement:
    return make_measurement(drift_m=drift, joints=(motion or make_motion("swing", 0.01),), settle_motion={"swing": 0.0})


def test_changes_that_measure_worse_are_taken_back(bench: Bench) -> None:
    result, asked = seen_as(bench, lambda n: swing(0.01 if n == 0 else 0.02))
    assert result.overlay == bench.calm and result.findings == () and result.measurement.drift_m == 0.01
    assert result.trace and not any(step.accepted for step in result.trace)
    assert asked[-1] == bench.calm, "the folder holds the accepted overlay again"


def test_the_best_of_all_rounds_is_kept(bench: Bench) -> None:
    drifts = {0: 0.01, 1: 0.02, 2: 0.004, 3: 0.005}
    result, asked = seen_as(bench, lambda n: swing(drifts.get(n, 0.03)))
    assert result.measurement.drift_m == 0.004 and result.overlay == asked[1] == asked[-1]
    assert [step.accepted for step in result.trace] == [False, True, False, False, False]
    assert [finding.joint for finding in result.findings] == ["swing"]


def test_friction_grows_with_damping_where_there_is_no_spring(bench: Bench) -> None:
    result, asked = seen_as(bench, lambda n: swing(0.01 / (n + 1)))
    assert len(asked) == UNSEEN.search.mend_rounds == len(result.trace), "still failing: every round is used"
    first = asked[0].joints[0]
    # The resistance of 2 % of the object's 201 kg on half of the gate's 0.3 m exceeds three times its own friction.
    assert near(first.friction, 0.02 * 201.0 * 9.81 * 0.15, 1e-6) and first.friction_source is Source.SEARCH
    assert near(asked[1].joints[0].friction, 3.0 * first.friction)


@pytest.mark.parametrize("measurement", [swing(0.01, make_motion("swing", 0.0)), make_measurement(penetration_m=0.1)])
def test_what_dynamics_cannot_mend_is_not_tried(bench: Bench, measurement: Measurement) -> None:
    result, asked = seen_as(bench, lambda _: measurement)
    assert not asked and not result.trace


def test_no_rounds_no_change(bench: Bench) -> None:
    settings = UNSEEN.model_copy(update={"search": SearchSettings(mend_rounds=0)})
    result = mend_dynamics(bench.item.features, bench.calm, swing(0.01), settings, bench.measure)
    assert result.overlay == bench.calm and not result.trace
