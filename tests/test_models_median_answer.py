"""The median of several answers: numbers, votes, and what hangs together."""

import pytest

from asset2sim.models.answers import median_answer
from schemas.overlay import Content, JointProposal, LinkProposal, Overlay
from schemas.support import SupportKind, SupportProposal


def test_one_wild_answer_of_three_moves_nothing() -> None:
    said = [
        Overlay(
            scale=scale,
            initial_joint_positions={"lid": at},
            links=(LinkProposal(name="body", density_kg_m3=density, wall_m=0.002, com=(0.0, at, 0.0)),),
            joints=(JointProposal(name="lid", holds=holds, coast_s=0.5),),
            asked=("lid",),
            uncertainty={"scale": 0.2},
        )
        for scale, at, density, holds in ((0.2, 0.3, 900.0, True), (0.22, 0.4, 1000.0, True), (20.0, 3.0, 9e3, False))
    ]
    found = median_answer(said)
    assert (found.scale, found.initial_joint_positions, found.asked) == (0.22, {"lid": 0.4}, ("lid",))
    assert found.links[0].density_kg_m3 == 1000.0 and found.links[0].com == (0.0, 0.4, 0.0)
    assert found.joints[0].holds is True and found.uncertainty == {"scale": 0.2}
    assert "median of 3 answers" in found.notes


def test_what_few_answers_state_is_left_out() -> None:
    bare, full = Overlay(scale=1.0), Overlay(scale=1.0, initial_joint_positions={"lid": 0.4}, asked=("lid",))
    found = median_answer([full, bare, bare])
    assert found.initial_joint_positions == {} and found.asked == ()
    assert median_answer([full, full, bare]).initial_joint_positions == {"lid": 0.4}


def test_what_hangs_together_comes_of_one_answer() -> None:
    def motor(kilograms: float) -> LinkProposal:
        inertia = (kilograms, 0.0, 0.0, kilograms, 0.0, kilograms)
        return LinkProposal(name="body", inertia=inertia, contents=(Content(name="motor", mass_kg=kilograms),))

    found = median_answer([Overlay(scale=1.0, links=(motor(kilograms),)) for kilograms in (3.0, 1.0, 2.0)])
    assert found.links == (motor(2.0),)
    kinds = (SupportKind.FIXED, SupportKind.HANDHELD, SupportKind.FIXED)
    held = [
        Overlay(scale=1.0, support=SupportProposal(kind=kind, confidence=0.1 * n)) for n, kind in enumerate(kinds, 1)
    ]
    assert median_answer(held).support == SupportProposal(kind=SupportKind.FIXED, confidence=0.1)


def test_a_link_keeps_what_it_weighs_by_though_every_answer_says_it_another_way() -> None:
    ways = (
        {"wall_m": 0.002, "density_kg_m3": 900.0},
        {"hollow_factor": 0.3, "density_kg_m3": 1000.0},
        {"mass_kg": 2.0},
    )
    found = median_answer([Overlay(scale=1.0, links=(LinkProposal(name="body", **way),)) for way in ways])
    (link,) = found.links
    assert link.wall_m == 0.002 and link.density_kg_m3 == 950.0 and link.mass_kg is None


def test_one_answer_is_its_own_median_and_none_has_none() -> None:
    only = Overlay(scale=0.3, notes=("sure",))
    assert median_answer([only]) is only
    with pytest.raises(ValueError, match="no answer"):
        median_answer([])
