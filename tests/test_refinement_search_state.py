"""The search over joint positions: on the planted crossing flaps in PyBullet, and on a Φ known in closed form."""

import math
from collections.abc import Mapping
from pathlib import Path

import pytest

from asset2sim.engines.contacts import ContactPoint, penetration
from asset2sim.engines.static_object import contacts_at
from asset2sim.models.prompts import TriedProposal
from asset2sim.refinement.position_bands import Band, Evaluator, band_of, objective
from asset2sim.refinement.search_state import Ask, focus_joints, refine_state
from schemas.asset import AssetRecord
from schemas.features import JointFeatures
from schemas.finding import TraceStep
from schemas.interaction import ContactPair
from schemas.mechanism import Bias
from schemas.settings import SearchSettings
from schemas.vocabulary import FailureMode, Source
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, near, prior, sample
from tests.builders import joint_features
from tests.factories import make_joint

SEARCH = SearchSettings()
ACCEPTABLE = NO_VIEWS.thresholds.penetration_m
Pose = dict[str, float]


@pytest.fixture(scope="module")
def flaps(tmp_path_factory: pytest.TempPathFactory) -> tuple[AssetRecord, Path]:
    out = tmp_path_factory.mktemp("flaps")
    return refine_asset(sample("planted_crossed_flaps"), out, NO_VIEWS, prior), out


def state_steps(record: AssetRecord) -> list[TraceStep]:
    return [step for step in record.trace if step.proposer not in ("shape", "dynamics", "range")]


@pytest.mark.system
def test_crossing_flaps_are_parted(flaps: tuple[AssetRecord, Path]) -> None:
    record, out = flaps
    assert record.failure_mode is FailureMode.NONE and record.overlay is not None
    assert record.measurement is not None and record.measurement.penetration_m <= SEARCH.target_phi_m
    first = record.trace[0]
    assert first.proposer == "request" and first.phi_before_m == first.phi_after_m > ACCEPTABLE, "they did cross"
    urdf = out / "assets" / "planted_crossed_flaps" / "mobility.urdf"
    fresh = penetration(contacts_at(urdf, record.overlay.initial_positions, NO_VIEWS.engine))
    assert near(fresh, record.measurement.penetration_m, 1e-9), "a world of its own sees the same"
    steps = state_steps(record)
    assert steps[-1].phi_after_m < first.phi_before_m


@pytest.mark.system
def test_accepted_steps_lower_phi_and_rejected_ones_change_nothing(flaps: tuple[AssetRecord, Path]) -> None:
    record, _ = flaps
    assert any(step.accepted for step in record.trace[1:])
    assert [step.step for step in record.trace] == list(range(len(record.trace)))
    for step in state_steps(record):
        if step.proposer == "request":  # a search begins anew from the requested state
            phi = step.phi_after_m
            continue
        assert step.phi_before_m == phi and step.evaluations >= 1
        if step.proposer == "return":  # a mended pose on its way back to the requested one: still as good as wanted
            assert step.phi_after_m <= SEARCH.target_phi_m and step.moved
        elif step.accepted:
            assert step.phi_after_m < step.phi_before_m and step.moved
            phi = step.phi_after_m
        else:
            assert not step.moved


@pytest.mark.system
def test_closed_flaps_stay_closed(flaps: tuple[AssetRecord, Path]) -> None:
    record, _ = flaps
    assert record.overlay is not None
    for part in record.overlay.joints:
        assert part.lower is not None and part.upper is not None
        away = abs(part.initial_position - part.closed)
        assert away <= SEARCH.state_tolerance * (part.upper - part.lower) + 1e-9, part.name
        assert (part.position_source is Source.SEARCH) == (away > 0.0)
    moved = {finding.joint for finding in record.findings if finding.code == "state_moved"}
    assert moved == {part.name for part in record.overlay.joints if part.position_source is Source.SEARCH}


@pytest.mark.system
def test_two_searches_are_the_same(flaps: tuple[AssetRecord, Path], tmp_path: Path) -> None:
    again = refine_asset(sample("planted_crossed_flaps"), tmp_path, NO_VIEWS, prior)
    assert again.trace == flaps[0].trace and again.overlay == flaps[0].overlay


def hinged(name: str, parent: str, child: str) -> JointFeatures:
    ends = {"lower": 0.0, "upper": 1.0, "closed": 0.0, "open": 1.0, "openness_confidence": 1.0}
    return joint_features(name, "revolute", parent, child).model_copy(update=ends)


TWO = (hinged("a", "body", "left"), hinged("b", "body", "right"))


class Overlap:
    """Contacts between two flaps that are ``deepest`` − q_a − q_b deep, and every pose that was asked for."""

    def __init__(self, deepest: float) -> None:
        self.deepest = deepest
        self.seen: list[Pose] = []

    def __call__(self, pose: Mapping[str, float]) -> list[ContactPoint]:
        self.seen.append(dict(pose))
        return [ContactPoint("left", "right", pose["a"] + pose["b"] - self.deepest)]


def found(
    overlap: Overlap,
    settings: SearchSettings = SEARCH,
    alternatives: Pose | None = None,
    ask: Ask | None = None,
    reach: float = 0.1,
) -> tuple[Pose, float, tuple[TraceStep, ...]]:
    bands = {name: Band(0.0, 0.0, reach, 1.0) for name in ("a", "b")}
    evaluator = Evaluator(overlap, settings.max_evaluations)
    return refine_state(
        "thing", TWO, {"a": 0.0, "b": 0.0}, bands, alternatives or {}, evaluator, settings, ACCEPTABLE, ask
    )


def test_nothing_is_moved_where_nothing_overlaps() -> None:
    pose, phi, trace = found(Overlap(0.0))
    assert pose == {"a": 0.0, "b": 0.0} and phi == 0.0 and len(trace) == 1


def test_the_way_back_is_halved_until_it_just_parts() -> None:
    pose, phi, trace = found(Overlap(0.03))
    assert phi <= SEARCH.target_phi_m and pose["b"] == 0.0
    # The line's first step that parts them is 0.0333 rad; six halvings of the way to it leave half a thousandth.
    least = 0.03 - SEARCH.target_phi_m
    assert least - 1e-12 <= pose["a"] <= least + 0.1 / 3 / 2**6 + 1e-12, "no further than it takes"
    for step in trace[1:]:
        assert not step.accepted or step.phi_after_m < step.phi_before_m or step.phi_after_m <= SEARCH.target_phi_m


def test_both_flaps_are_moved_where_one_is_not_enough() -> None:
    pose, phi, trace = found(Overlap(0.15))
    assert phi <= SEARCH.target_phi_m and 0.0 < pose["a"] <= 0.1 and 0.0 < pose["b"] <= 0.1
    assert {name for step in trace for name in step.moved} == {"a", "b"}


@pytest.mark.parametrize("deepest", [0.05, 0.15, 0.5, 5.0])
def test_no_pose_outside_the_band_is_ever_taken(deepest: float) -> None:
    overlap = Overlap(deepest)
    pose, phi, _ = found(overlap)
    tried = list(overlap.seen)
    assert all(0.0 <= value <= 0.1 + 1e-12 for seen in tried for value in seen.values())
    assert near(phi, penetration(overlap(pose))), "the Φ that is answered is that of the pose"
    assert phi <= min(penetration(overlap(seen)) for seen in tried) / (1.0 - SEARCH.least_gain) + SEARCH.target_phi_m


def test_a_state_is_not_left_for_a_gain_that_is_small() -> None:
    pose, phi, trace = found(Overlap(5.0))
    assert pose == {"a": 0.0, "b": 0.0} and phi == 5.0
    assert [step.accepted for step in trace] == [True] + [False] * (len(trace) - 1) and len(trace) > 3


def test_two_runs_ask_for_the_same_poses() -> None:
    first, second = Overlap(0.5), Overlap(0.5)
    assert found(first) == found(second) and first.seen == second.seen


@pytest.mark.parametrize("budget", [1, 10, 60])
def test_the_budget_is_kept(budget: int) -> None:
    overlap = Overlap(0.5)
    found(overlap, SearchSettings(max_evaluations=budget))
    # Naming the colliding pairs of the best pose costs one evaluation on top.
    assert len(overlap.seen) <= budget + 2


def test_a_joint_that_nobody_asked_for_may_start_at_its_authored_zero() -> None:
    # A gain of half is more than the bands can bring, so that both flaps are still where they were.
    pose, phi, trace = found(Overlap(0.5), SearchSettings(least_gain=0.5), alternatives={"b": 0.9})
    assert pose["b"] == 0.9 and phi == 0.0
    assert [step.proposer for step in trace if step.accepted][-1] == "authored"


def test_joints_that_are_alike_start_at_their_authored_zero_together() -> None:
    """Two temples that cross where both are folded: one unfolded would part them."""
    pose, phi, _ = found(Overlap(0.5), SearchSettings(least_gain=0.5), alternatives={"a": 0.9, "b": 0.8})
    assert pose == {"a": 0.9, "b": 0.8} and phi == 0.0


def test_a_models_pose_that_gains_too_little_is_refused_and_told() -> None:
    asked: list[tuple[tuple[str, ...], tuple[TriedProposal, ...]]] = []

    def ask(best: Pose, focus: tuple[str, ...], tried: tuple[TriedProposal, ...]) -> Pose:
        assert best == {"a": 0.0, "b": 0.0}
        asked.append((focus, tried))
        return {"a": 0.1, "b": 0.05}

    # Every line search is cut off by the gain it must bring, so that the model is asked at the requested pose.
    pose, phi, trace = found(Overlap(0.5), SearchSettings(least_gain=0.5), ask=ask)
    assert len(asked) == SearchSettings().max_model_calls == 2
    assert asked[0] == (("a", "b"), ())
    (refused,) = asked[1][1]
    assert refused.positions == {"a": 0.1, "b": 0.05} and near(refused.phi_m, 0.35), "it is told what came of it"
    assert pose == {"a": 0.0, "b": 0.0} and phi == 0.5, "it gains too little"
    assert [(step.proposer, step.accepted, step.moved) for step in trace[-2:]] == [("model", False, {})] * 2


def test_a_models_pose_that_lowers_the_overlap_is_taken() -> None:
    # Half of the overlap is more than any line within the bands brings; the model may reach further for what nobody
    # asked a state of.
    poses = iter([{"a": 0.0, "b": 0.3}, {"a": 0.2, "b": 0.3}])
    overlap = Overlap(0.5)
    pose, phi, trace = found(overlap, SearchSettings(least_gain=0.5), ask=lambda *_: next(poses))
    assert pose["b"] == 0.3 and phi <= SEARCH.target_phi_m
    taken = [step for step in trace if step.proposer == "model"]
    assert [step.accepted for step in taken] == [True, True] and near([s.phi_after_m for s in taken], [0.2, 0.0])


def test_a_model_without_a_pose_ends_the_asking() -> None:
    asked: list[Pose] = []
    settings = SearchSettings(least_gain=0.5, max_model_calls=5)
    _, phi, trace = found(Overlap(0.5), settings, ask=lambda best, *_: asked.append(best))
    assert len(asked) == 1 and phi == 0.5 and "model" not in {step.proposer for step in trace}


def test_a_model_is_not_asked_where_the_search_succeeds() -> None:
    def ask(*_: object) -> Pose:
        raise AssertionError("the model was asked")

    assert found(Overlap(0.05), ask=ask)[1] <= SEARCH.target_phi_m


def test_focus_is_what_parts_the_pair() -> None:
    chain = (hinged("shoulder", "body", "arm"), hinged("elbow", "arm", "hand"), hinged("door", "body", "door"))

    def pair(a: str, b: str) -> ContactPair:
        return ContactPair(link_a=a, link_b=b, depth_m=0.1, penetration_m=0.1, n_points=1)

    everything = ("shoulder", "elbow", "door")
    assert focus_joints(chain, [pair("hand", "door")], everything) == ("elbow", "shoulder", "door")
    assert focus_joints(chain, [pair("arm", "hand")], everything) == ("elbow",), "the shoulder moves both alike"
    assert focus_joints(chain, [pair("arm", "hand"), pair("arm", "door")], ("door",)) == ("door",)
    assert focus_joints(chain, [], everything) == ()


@pytest.mark.parametrize(
    ("position", "closed", "low", "high"),
    [
        (0.0, 0.0, 0.0, 0.02),
        (0.5, 0.0, 0.405, 0.595),
        (1.0, 1.0, 0.98, 1.0),
        (0.95, 0.0, 0.855, 1.0),
        (0.015, 0.0, 0.0, 0.035),
        (0.1, 0.0, 0.06, 0.14),  # what is to be slightly open is not shut, nor far open
        (0.9, 1.0, 0.86, 0.94),
    ],
)
def test_bands(position: float, closed: float, low: float, high: float) -> None:
    part = make_joint("hinge", initial_position=position).model_copy(update={"closed": closed})
    band = band_of(part, SEARCH.state_tolerance, SEARCH.closed_tolerance)
    assert near((band.requested, band.low, band.high, band.span), (position, low, high, 1.0))


def test_what_is_placed_at_the_edge_of_its_band_may_settle_by_what_may_drift_and_stands_as_asked() -> None:
    limits, span = NO_VIEWS.thresholds, 2.1
    part = make_joint("door", initial_position=1.0).model_copy(update={"upper": span, "open": span})
    band = band_of(part, SEARCH.state_tolerance, SEARCH.closed_tolerance)
    assert band.high - band.requested + limits.drift_rad <= limits.state_share * span


def test_a_joint_of_which_nothing_is_asked_may_be_moved_to_its_closed_end() -> None:
    part = make_joint("hinge", initial_position=0.09).model_copy(update={"position_source": Source.RULE})
    assert near(band_of(part, SEARCH.state_tolerance, SEARCH.closed_tolerance).low, 0.0)


def test_flaps_that_cross_are_parted_in_pairs() -> None:
    """Four flaps on one box: neighbours cross unless one pair stands 0.15 rad above the other, and moving one flap of a
    pair alone makes it worse."""
    flaps = {"a1": (1, 0, 0), "b1": (0, 1, 0), "a2": (-1, 0, 0), "b2": (0, -1, 0)}
    joints = tuple(
        hinged(name, "body", f"{name}_link").model_copy(update={"axis_in_root": axis}) for name, axis in flaps.items()
    )

    def contacts(pose: Mapping[str, float]) -> list[ContactPoint]:
        crossed = 0.15 - abs(pose["a1"] - pose["b1"])
        bent = 10.0 * (abs(pose["a1"] - pose["a2"]) + abs(pose["b1"] - pose["b2"]))
        return [ContactPoint("a1_link", "b1_link", -crossed - bent)]

    requested = dict.fromkeys(flaps, 0.2)
    bands = {name: Band(0.2, 0.1, 0.3, 1.0) for name in flaps}
    evaluator = Evaluator(contacts, SEARCH.max_evaluations)
    pose, phi, trace = refine_state("carton", joints, requested, bands, {}, evaluator, SEARCH, ACCEPTABLE)
    assert phi <= SEARCH.target_phi_m and "groups" in {step.proposer for step in trace if step.accepted}
    assert near(pose["a1"], pose["a2"]) and near(pose["b1"], pose["b2"]) and abs(pose["a1"] - pose["b1"]) >= 0.149


def test_the_objective_prices_distance() -> None:
    bands = {"a": Band(0.0, 0.0, 0.1, 2.0)}
    assert math.isclose(objective(0.01, {"a": 0.1}, bands), 0.01 + 1e-3 * (0.1 / 2.0) ** 2)


def test_a_part_that_snaps_to_its_end_is_not_moved_beside_it() -> None:
    switch = make_joint("switch").model_copy(
        update={"initial_position": 0.0, "closed": 0.0, "lower": -0.7, "upper": 0.0, "position_source": Source.RULE}
    )
    snaps = Bias(kind="bistable", slope=1.1, none_at=-0.35, least=-0.39, most=0.39)
    free, held = (
        band_of(item, SEARCH.state_tolerance, SEARCH.closed_tolerance)
        for item in (switch, switch.model_copy(update={"bias": snaps}))
    )
    assert free.low < 0.0 and (held.low, held.high) == (0.0, 0.0)
