"""A spring from the forces at its start and end: stiffness, preload and armature that a hand can compute."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asset2sim.physics.dynamics import joint_terms
from asset2sim.physics.mass_matrix import Pull
from asset2sim.physics.terms import JointLoad, JointTerms
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source

SETTINGS = PhysicsSettings()
STEP = SETTINGS.coarse_timestep_s
TRAVEL = 4e-3


def terms(
    mass: float = 1e-3, *, weight: float = 0.0, rest: float = 0.0, reach: float = 1.0, travel: float = TRAVEL,
    lower: float = 0.0, **stated: object,
) -> JointTerms:  # fmt: skip
    """The terms of a key of 1 g that moves from 0 to 4 mm; ``weight`` is gravity's pull towards larger positions, N."""
    moved = JointLoad(
        prismatic=True, inertia=mass, least=mass, held=mass, pull=Pull(rest, weight, 0.0, True), lower=lower,
        upper=travel, closed=0.0, open=travel, rest=rest, reach=reach,
    )  # fmt: skip
    proposal = JointProposal.model_validate({"name": "j", **stated})
    return joint_terms(
        proposal, moved, holds=False, source=Source.MODEL, authored_damping=None, settings=SETTINGS
    )  # fmt: skip


def press(found: JointTerms, position: float, weight: float = 0.0) -> float:
    """What a finger needs to hold the key there, pressing towards larger positions, N."""
    return -found.stiffness.value * (found.spring_reference - position) - weight


@pytest.mark.parametrize("weight", [0.0, 0.01, -0.2])
def test_a_key_starts_and_ends_at_what_is_proposed_whatever_it_weighs(weight: float) -> None:
    found = terms(weight=weight, press_start=0.45, press_end=0.65)
    assert press(found, 0.0, weight) == pytest.approx(0.45)
    assert press(found, TRAVEL, weight) == pytest.approx(0.65)
    assert found.stiffness.source is Source.MODEL and found.stiffness.value == pytest.approx(0.2 / TRAVEL)


def test_pressed_the_other_way_it_feels_the_same() -> None:
    found = terms(rest=TRAVEL, press_start=0.45, press_end=0.65)
    assert -press(found, TRAVEL) == pytest.approx(0.45) and -press(found, 0.0) == pytest.approx(0.65)


def test_the_armature_bears_the_spring_at_the_coarse_step_and_damping_is_what_the_part_alone_bears() -> None:
    found = terms(press_start=0.45, press_end=0.65)
    total = 1e-3 + found.armature
    assert found.stiffness.value * STEP**2 / total <= SETTINGS.max_stiffness_step * (1.0 + 1e-9)
    assert 0.45 * STEP**2 / total <= SETTINGS.max_press_step * TRAVEL * (1.0 + 1e-9)
    assert found.armature == pytest.approx(0.45 * STEP**2 / (SETTINGS.max_press_step * TRAVEL) - 1e-3), "the preload's"
    assert found.damping.value <= SETTINGS.max_damping_step * 1e-3 / STEP * (1.0 + 1e-9)


def test_a_hinge_is_pressed_at_its_far_edge() -> None:
    found = terms(reach=0.2, travel=0.5, mass=0.01, press_start=15.0, press_end=25.0)
    assert press(found, 0.0) == pytest.approx(3.0) and press(found, 0.5) == pytest.approx(5.0)


def test_a_heavy_part_needs_no_armature() -> None:
    assert terms(mass=1.0, press_start=0.45, press_end=0.65).armature == 0.0


def test_without_a_stop_behind_it_a_part_rests_at_zero_force_and_friction_stops_its_swing() -> None:
    found = terms(lower=-TRAVEL / 2.0, press_start=0.4, press_end=0.6)
    assert press(found, 0.0) == pytest.approx(0.0) and press(found, TRAVEL) == pytest.approx(0.6)
    assert found.armature > 0.0 and found.friction.value == pytest.approx(0.2 * 0.6)
    assert terms(mass=1.0, lower=-TRAVEL / 2.0, press_start=0.4, press_end=0.6).friction.value == 0.0


def test_forces_that_need_too_much_armature_are_lowered_together_and_say_so() -> None:
    found = terms(travel=1e-4, press_start=10.0, press_end=15.0)
    assert found.armature == pytest.approx(SETTINGS.max_armature_ratio * 1e-3)
    assert press(found, 1e-4) / press(found, 0.0) == pytest.approx(1.5) and press(found, 0.0) < 10.0
    assert found.stiffness.source is Source.RULE and found.stiffness.replaced == pytest.approx(5.0 / 1e-4)


@pytest.mark.parametrize(("asked", "borne", "felt"), [(1.6, 1.6, 1.6), (2.0, 1.8, 2.0), (40.0, 1.8, 2.52)])
def test_what_no_armature_bears_of_the_start_is_dry_friction_against_which_the_spring_still_returns(
    asked: float, borne: float, felt: float
) -> None:
    """Of 1 g over 0.1 mm with 10 kg of armature, limits hold 10.001 · 0.5 · 1e-4 m / (1/60 s)² = 1.8 N."""
    found = terms(travel=1e-4, press_start=asked, press_end=1.2 * asked)
    assert press(found, 0.0) == pytest.approx(borne, rel=1e-3)
    assert press(found, 0.0) + found.friction.value == pytest.approx(felt, rel=1e-3)
    assert found.friction.value < 0.5 * press(found, 0.0)


def test_one_force_gives_the_other() -> None:
    assert press(terms(press_end=1.0), 0.0) == pytest.approx(0.7)
    assert press(terms(press_start=0.7), TRAVEL) == pytest.approx(1.0)
    assert press(terms(press_start=0.7, press_end=0.1), TRAVEL) > 0.7, "a spring's force rises"


def test_a_stated_stiffness_or_a_slow_return_counts_before_the_press() -> None:
    press_on = {"press_start": 0.45, "press_end": 0.65}
    assert terms(**press_on, stiffness=0.1).stiffness.value == pytest.approx(0.1)
    assert terms(**press_on, returns_s=1.0).armature == 0.0
    assert terms(**press_on, returns_s=0.15) == terms(**press_on), "its own spring is that quick"
    assert terms(**press_on, spring_hz=5.0) == terms(**press_on)


@given(
    mass=st.floats(1e-6, 10.0), start=st.floats(0.0, 1e3), end=st.floats(0.0, 1e3), travel=st.floats(1e-5, 1.0),
    weight=st.floats(-100.0, 100.0), lower=st.floats(-1.0, 0.0),
)  # fmt: skip
@settings(deadline=None, derandomize=True)
def test_whatever_is_proposed_the_spring_is_simulable(
    mass: float, start: float, end: float, travel: float, weight: float, lower: float
) -> None:
    found = terms(mass, weight=weight, travel=travel, lower=lower, press_start=start, press_end=end)
    numbers = (found.stiffness.value, found.spring_reference, found.armature, found.damping.value, found.friction.value)
    assert all(math.isfinite(number) for number in numbers)
    assert 0.0 <= found.armature <= SETTINGS.max_armature_ratio * mass * (1.0 + 1e-9)
    share = found.stiffness.value * STEP**2 / (mass + found.armature)
    assert 0.0 <= share <= SETTINGS.max_stiffness_step * (1.0 + 1e-6)
    assert found.damping.value * STEP / mass <= SETTINGS.max_damping_step * (1.0 + 1e-9)


def test_a_press_that_no_finger_feels_is_none() -> None:
    """The smallest of numbers would divide by zero."""
    assert (
        terms(press_end=5e-324).stiffness.value == 0.0 and terms(press_start=5e-324, press_end=5e-324).armature == 0.0
    )
