"""Damping, friction and stiffness of one joint: from what it moves, bounded by the time step, never silently."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.physics.dynamics import JointTerms, Term, joint_terms
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
    hold_load: float = 0.0,
    holds: bool = False,
    rest: float = 0.0,
    stopped: bool = True,
    authored: float | None = None,
    proposal: JointProposal | None = None,
    **stated: object,
) -> JointTerms:
    """The terms of a hinge of 0.1 kg·m² unless said otherwise; ``stated`` holds the proposal's fields."""
    return joint_terms(
        proposal or JointProposal.model_validate({"name": "j", **stated}),
        prismatic=prismatic, inertia=inertia, load=load, hold_load=hold_load, holds=holds, rest=rest, stopped=stopped,
        source=Source.MODEL, authored_damping=authored, settings=SETTINGS,
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
    found = terms(0.1, spring_hz=2.0, load=-0.4, rest=0.2)
    # At rest the spring alone then pushes with 1.5 times what gravity pulls; without a stop, with just as much.
    push = found.stiffness.value * (found.spring_reference - 0.2)
    assert push == pytest.approx(SETTINGS.hold_margin * 0.4)
    free = terms(0.1, spring_hz=2.0, load=-0.4, rest=0.2, stopped=False)
    assert free.stiffness.value * (free.spring_reference - 0.2) == pytest.approx(0.4)
    assert terms(0.1, load=-0.4, rest=0.2).spring_reference == 0.2


def test_friction_holds_more_than_the_load_where_the_joint_must_stay() -> None:
    assert terms(friction=0.1, hold_load=2.0, holds=True).friction == Term(3.0, Source.RULE, 0.1)
    assert terms(friction=0.1, hold_load=2.0).friction == Term(0.1, Source.MODEL)
    assert terms(friction=9.0, hold_load=2.0, holds=True).friction == Term(9.0, Source.MODEL)


def test_friction_that_nobody_states_follows_the_inertia_and_the_kind_of_joint() -> None:
    check(terms(0.1).friction, 0.1 * SETTINGS.default_friction_rad_s2, Source.RULE)
    check(terms(0.1, prismatic=True).friction, 0.1 * SETTINGS.default_friction_m_s2, Source.RULE)


def test_what_returns_by_itself_has_no_friction_and_what_swings_freely_has_little() -> None:
    assert terms(spring_hz=1.0).friction == Term(0.0, Source.RULE)
    free = terms(0.1, proposal=JointProposal(name="j", holds=False)).friction
    check(free, SETTINGS.free_friction_share * 0.1 * SETTINGS.default_friction_rad_s2, Source.RULE)


@given(
    inertia=st.floats(1e-8, 1e3),
    damping=st.none() | st.floats(0.0, 1e4),
    coast=st.none() | st.floats(1e-3, 1e3),
    stiffness=st.none() | st.floats(0.0, 1e6),
    hertz=st.none() | st.floats(0.01, 100.0),
    friction=st.none() | st.floats(0.0, 1e3),
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
    load: float,
    holds: bool,
) -> None:
    found = terms(
        inertia, load=load, hold_load=abs(load), holds=holds,
        damping=damping, coast_s=coast, stiffness=stiffness, spring_hz=hertz, friction=friction,
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
