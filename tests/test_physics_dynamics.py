"""Damping, friction and stiffness of one joint: from what it moves, bounded by the time step, never silently."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.physics.dynamics import joint_terms
from asset2sim.physics.mass_matrix import Pull
from asset2sim.physics.terms import JointLoad, JointTerms, Term
from asset2sim.physics.timing import glide_distance
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source

SETTINGS = PhysicsSettings()
STEP = SETTINGS.coarse_timestep_s


def terms(
    inertia: float = 0.1,
    *,
    prismatic: bool = False,
    load: float = 0.0,
    hold_friction: float = 0.0,
    holds: bool = False,
    rest: float = 0.0,
    lower: float | None = -1.0,
    upper: float | None = 1.0,
    closed: float = 0.0,
    least: float | None = None,
    held: float | None = None,
    slope: float = 0.0,
    authored: float | None = None,
    proposal: JointProposal | None = None,
    **stated: object,
) -> JointTerms:
    """The terms of a hinge of 0.1 kg·m² unless said otherwise, whose load is gravity's at position zero; ``stated``
    holds the proposal's fields."""
    moved = JointLoad(
        prismatic=prismatic, inertia=inertia, least=least or inertia, held=held or inertia,
        pull=Pull(rest, load, slope, prismatic), lower=lower, upper=upper, closed=closed,
        open=1.0 if upper is None else upper, rest=rest, hold_friction=hold_friction,
    )  # fmt: skip
    return joint_terms(
        proposal or JointProposal.model_validate({"name": "j", **stated}), moved,
        holds=holds, source=Source.MODEL, authored_damping=authored, settings=SETTINGS,
    )  # fmt: skip


def check(term: Term, value: float, source: Source, replaced: float | None = None) -> None:
    assert term.value == pytest.approx(value)
    assert (term.source, term.replaced) == (source, replaced)


def test_coasting_gives_inertia_over_time() -> None:
    assert terms(0.1, coast_s=0.5).damping == Term(0.2, Source.MODEL)


def test_without_a_word_a_joint_coasts_for_the_default_time() -> None:
    check(terms(0.1).damping, 0.1 / SETTINGS.default_coast_s, Source.RULE)


def test_damping_is_taken_as_stated_then_as_felt_then_as_authored() -> None:
    assert terms(damping=0.3, coast_s=1.0, authored=0.7).damping == Term(0.3, Source.MODEL)
    assert terms(coast_s=1.0, authored=0.7).damping == Term(0.1, Source.MODEL)
    assert terms(authored=0.7).damping == Term(0.7, Source.AUTHORED)
    assert terms(authored=0.0).damping.source is Source.RULE  # a dataset's zero is no statement


def test_damping_that_would_explode_is_bounded_by_the_step_and_says_so() -> None:
    # 0.15 N·m·s/rad on a key of 1e-5 kg·m²: c Δt / I would be 250.
    found = terms(1e-5, damping=0.15).damping
    check(found, 0.5 * 1e-5 * 60.0, Source.RULE, 0.15)


def test_a_spring_bounces_at_the_frequency_asked_for() -> None:
    found = terms(0.1, spring_hz=2.0).stiffness
    assert found.source is Source.MODEL
    assert math.sqrt(found.value / 0.1) / (2.0 * math.pi) == pytest.approx(2.0)


def test_a_spring_too_stiff_for_the_step_is_bounded() -> None:
    found = terms(0.1, stiffness=1e6).stiffness
    check(found, SETTINGS.max_stiffness_step * 0.1 * 3600.0, Source.RULE, 1e6)


def test_a_passive_joint_has_no_stiffness_and_says_who_said_so() -> None:
    assert terms().stiffness == Term(0.0, Source.RULE)
    assert terms(stiffness=0.0).stiffness == Term(0.0, Source.MODEL)


def test_a_spring_is_damped_enough_not_to_ring() -> None:
    found = terms(0.1, spring_hz=1.0, coast_s=1e6)
    ratio = found.damping.value / (2.0 * math.sqrt(found.stiffness.value * 0.1))
    assert ratio == pytest.approx(SETTINGS.spring_damping_ratio)
    assert found.damping.replaced == pytest.approx(1e-7)


def test_a_loaded_spring_is_preloaded_against_its_stop() -> None:
    found = terms(0.1, spring_hz=2.0, load=-0.4, rest=0.2, upper=0.2)
    # At rest the spring alone then pushes with 1.5 times what gravity pulls; without a stop, with just as much.
    push = found.stiffness.value * (found.spring_reference - 0.2)
    assert push == pytest.approx(SETTINGS.preload_margin * 0.4)
    free = terms(0.1, spring_hz=2.0, load=-0.4, rest=0.2)
    assert free.stiffness.value * (free.spring_reference - 0.2) == pytest.approx(0.4)
    assert terms(0.1, load=-0.4, rest=0.2).spring_reference == 0.2


def test_friction_holds_more_than_the_load_where_the_joint_must_stay() -> None:
    assert terms(friction=0.1, hold_friction=3.0, holds=True).friction == Term(3.0, Source.RULE, 0.1)
    assert terms(friction=0.1).friction == Term(0.1, Source.MODEL)
    assert terms(friction=9.0, hold_friction=3.0, holds=True).friction == Term(9.0, Source.MODEL)


def test_friction_that_nobody_states_follows_the_inertia_and_the_kind_of_joint() -> None:
    check(terms(0.1).friction, 0.1 * SETTINGS.default_friction_rad_s2, Source.RULE)
    check(terms(0.1, prismatic=True).friction, 0.1 * SETTINGS.default_friction_m_s2, Source.RULE)


def test_what_returns_by_itself_has_no_friction_and_what_swings_freely_has_little() -> None:
    assert terms(spring_hz=1.0).friction == Term(0.0, Source.RULE)
    free = terms(0.1, proposal=JointProposal(name="j", holds=False)).friction
    check(free, SETTINGS.free_friction_share * 0.1 * SETTINGS.default_friction_rad_s2, Source.RULE)


def test_the_bound_is_that_of_the_least_inertia_over_the_range() -> None:
    found = terms(0.1, least=0.01, damping=9.0, stiffness=1e6)
    check(found.damping, 0.5 * 0.01 * 60.0, Source.RULE, 9.0)
    check(found.stiffness, SETTINGS.max_stiffness_step * 0.01 * 3600.0, Source.RULE, 1e6)


def test_a_drawer_that_stops_within_ten_centimetres_is_braked_evenly() -> None:
    # v₀ = 0.3 m/s, d = 0.1 m: c = (1 - ln 2) m v₀ / d, f = c v₀; then v' = -(c v + f) / m stops it at d.
    found = terms(2.0, prismatic=True, stops_within=0.1)
    c = (1.0 - math.log(2.0)) * 2.0 * 0.3 / 0.1
    check(found.damping, c, Source.MODEL)
    check(found.friction, c * 0.3, Source.MODEL)
    tau, a = 2.0 / c, c * 0.3 / 2.0
    assert tau * 0.3 - a * tau**2 * math.log(1.0 + 0.3 / (a * tau)) == pytest.approx(0.1)


def test_stopping_keeps_stated_friction_and_what_holds() -> None:
    found = terms(2.0, prismatic=True, stops_within=0.1, friction=0.2)
    assert found.friction == Term(0.2, Source.MODEL)
    assert glide_distance(0.3, 2.0 / found.damping.value, 0.1) == pytest.approx(0.1)
    # Friction of 1.5 · 4 N stops 2 kg within 15 mm: that is within what was asked.
    held = terms(2.0, prismatic=True, stops_within=0.1, hold_friction=6.0, holds=True)
    assert held.friction == Term(6.0, Source.MODEL) and held.unmet == ()


def test_a_stop_that_damping_may_not_give_is_left_to_friction() -> None:
    found = terms(2.0, prismatic=True, stops_within=0.002)
    assert found.damping.value == pytest.approx(0.5 * 2.0 * 60.0)
    assert glide_distance(0.3, 2.0 / found.damping.value, found.friction.value / 2.0) == pytest.approx(0.002, rel=1e-3)


def test_gliding_is_friction_alone_or_damping_alone_at_its_ends() -> None:
    assert glide_distance(0.3, 0.5, 0.0) == pytest.approx(0.15)
    assert glide_distance(0.3, 1e12, 0.9) == pytest.approx(0.05)


def test_a_slider_that_its_weight_shuts_falls_with_constant_force() -> None:
    # 2 kg hang 0.4 m open; from half open c v' settles: way = F / c (t - m / c (1 - exp(-c t / m))), friction in F.
    found = terms(2.0, prismatic=True, load=-19.62, lower=0.0, upper=0.4, closes_s=0.4)
    c, f = found.damping.value, found.friction.value
    assert c < 0.5 * 2.0 * 60.0 and found.damping.source is Source.MODEL and found.unmet == ()
    way = (19.62 - f) / c * (0.4 - 2.0 / c * (1.0 - math.exp(-c * 0.4 / 2.0)))
    assert way == pytest.approx(0.9 * 0.2, rel=5e-3)


def test_a_lid_that_falls_too_fast_for_damping_gets_friction() -> None:
    # A lid of 0.1 kg m² whose weight pulls with 5 cos q N·m, open to 1.6 rad, closed and level at 0.
    found = terms(0.1, load=-5.0, slope=0.0, lower=0.0, upper=1.6, closes_s=1.5)
    assert found.damping.value == pytest.approx(0.5 * 0.1 * 60.0)
    weakest = 5.0 * math.cos(0.8)
    assert 0.0 < found.friction.value <= 0.8 * weakest * (1.0 + 1e-9), "it still falls by itself"


@pytest.mark.parametrize("load", [0.0, 5.0])
def test_what_gravity_does_not_shut_is_told(load: float) -> None:
    found = terms(0.1, load=load, lower=0.0, upper=1.6, closes_s=1.5, coast_s=0.5, holds=False)
    check(found.damping, 0.2, Source.MODEL)
    (miss,) = found.unmet
    assert (miss.wish, miss.asked, miss.achieved) == ("closes_s", 1.5, None) and "gravity" in miss.why


def test_what_must_hold_does_not_fall_shut() -> None:
    found = terms(0.1, load=-5.0, hold_friction=7.5, lower=0.0, upper=1.6, closes_s=1.5, holds=True)
    assert found.friction.value == pytest.approx(7.5) and found.unmet[0].wish == "closes_s"


def test_a_key_that_nothing_weighs_on_returns_as_a_critically_damped_spring() -> None:
    found = terms(0.1, lower=-0.5, upper=0.0, returns_s=0.5)
    w = 3.8897 / 0.5
    check(found.stiffness, w**2 * 0.1, Source.MODEL)
    assert found.damping.value == pytest.approx(2.0 * w * 0.1, rel=5e-3) and found.unmet == ()
    assert found.friction.value == 0.0


def test_a_return_that_the_step_does_not_bear_is_told() -> None:
    found = terms(0.1, lower=-0.5, upper=0.0, returns_s=0.01)
    assert found.stiffness.source is Source.RULE and found.damping.value <= 0.5 * 0.1 * 60.0
    (miss,) = found.unmet
    assert miss.wish == "returns_s" and miss.achieved is not None and miss.achieved > 0.02


def test_a_wish_gives_way_to_damping_that_is_stated() -> None:
    assert terms(0.1, damping=0.3, stops_within=0.4).damping == Term(0.3, Source.MODEL)


@given(
    inertia=st.floats(1e-8, 1e3),
    damping=st.none() | st.floats(0.0, 1e4),
    coast=st.none() | st.floats(1e-3, 1e3),
    stiffness=st.none() | st.floats(0.0, 1e6),
    hertz=st.none() | st.floats(0.01, 100.0),
    friction=st.none() | st.floats(0.0, 1e3),
    closes=st.none() | st.floats(1e-2, 1e2),
    stops=st.none() | st.floats(1e-4, 10.0),
    returns=st.none() | st.floats(1e-3, 1e2),
    load=st.floats(-100.0, 100.0),
    holds=st.booleans(),
)
@settings(deadline=None, derandomize=True)
def test_whatever_is_proposed_the_terms_are_simulable_and_honest(
    inertia: float,
    damping: float | None,
    coast: float | None,
    stiffness: float | None,
    hertz: float | None,
    friction: float | None,
    closes: float | None,
    stops: float | None,
    returns: float | None,
    load: float,
    holds: bool,
) -> None:
    found = terms(
        inertia, load=load, hold_friction=SETTINGS.hold_margin * abs(load) if holds else 0.0, holds=holds,
        damping=damping, coast_s=coast, stiffness=stiffness, spring_hz=hertz, friction=friction,
        closes_s=closes, stops_within=stops, returns_s=returns,
    )  # fmt: skip
    assert 0.0 <= found.damping.value * STEP / inertia <= SETTINGS.max_damping_step * (1.0 + 1e-9)
    assert 0.0 <= found.stiffness.value * STEP**2 / inertia <= SETTINGS.max_stiffness_step * (1.0 + 1e-9)
    assert found.friction.value >= (SETTINGS.hold_margin * abs(load) if holds else 0.0)
    for term, stated in ((found.damping, damping), (found.stiffness, stiffness), (found.friction, friction)):
        # A number that was changed is no longer the model's, and the model's number is kept beside it.
        if term.replaced is not None:
            assert term.source is Source.RULE and term.replaced != term.value
        elif stated:
            assert term == Term(stated, Source.MODEL)
