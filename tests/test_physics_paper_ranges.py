"""The paper's rule for joint dynamics: its own numbers, whatever the joint moves."""

from pathlib import Path

import pytest

from asset2sim.assets.folder import write_folder
from asset2sim.assets.hulls import collision_hulls
from asset2sim.assets.urdf.read import read_dynamics
from asset2sim.physics.paper_ranges import paper_terms
from asset2sim.physics.terms import Term
from asset2sim.validation.validate import validate
from schemas.overlay import JointProposal, Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import DynamicsRule, Source
from tests.assets import cabinet, near, read, written

PAPER = PhysicsSettings(dynamics=DynamicsRule.PAPER)


def damping(prismatic: bool, **stated: object) -> Term:
    proposal = JointProposal.model_validate({"name": "j", **stated})
    return paper_terms(proposal, prismatic=prismatic, holds=False, rest=0.0, source=Source.MODEL).damping


@pytest.mark.parametrize(
    ("word", "hinge", "slider"),
    [
        ("super low", 0.05, 0.5),
        ("low", (0.05 * 0.15) ** 0.5, (0.5 * 1.5) ** 0.5),
        ("medium", 0.15, 1.5),
        ("high", (0.15 * 0.5) ** 0.5, (1.5 * 5.0) ** 0.5),
        ("super high", 0.5, 5.0),
    ],
)
def test_words_are_places_in_the_papers_range(word: str, hinge: float, slider: float) -> None:
    assert near((damping(False, damping_level=word).value, damping(True, damping_level=word).value), (hinge, slider))
    assert damping(False, damping_level=word).source is Source.MODEL


def test_without_a_word_the_papers_usual_values_stand_and_are_a_rule() -> None:
    assert damping(False) == Term(0.15, Source.RULE) and damping(True) == Term(1.5, Source.RULE)


def test_friction_lies_in_its_range_and_a_stated_number_is_taken() -> None:
    for prismatic, low, high in ((False, 0.005, 0.05), (True, 0.1, 2.0)):
        usual = paper_terms(JointProposal(name="j"), prismatic=prismatic, holds=False, rest=0.0, source=Source.MODEL)
        assert low < usual.friction.value < high and usual.stiffness.value == 0.0
        stated = JointProposal(name="j", friction=7.0, damping=99.0, stiffness=3.0)
        terms = paper_terms(stated, prismatic=prismatic, holds=False, rest=0.0, source=Source.MODEL)
        assert (terms.friction.value, terms.damping.value, terms.stiffness.value) == (7.0, 99.0, 3.0)


def test_what_stays_where_it_is_placed_has_more_damping_and_no_spring() -> None:
    terms = paper_terms(JointProposal(name="j", holds=True), prismatic=False, holds=True, rest=0.0, source=Source.MODEL)
    assert near(terms.damping.value, (0.15 * 0.5) ** 0.5) and terms.stiffness.value == 0.0


@pytest.mark.parametrize(
    ("hertz", "hinge", "slider"), [(0.5, 0.05, 50.0), (1.0, 0.05, 50.0), (5.0, 2.0, 500.0), (20.0, 2.0, 500.0)]
)
def test_a_springs_stiffness_and_damping_lie_in_their_ranges(hertz: float, hinge: float, slider: float) -> None:
    for prismatic, wanted, (low, high) in ((False, hinge, (0.01, 0.2)), (True, slider, (0.2, 5.0))):
        proposal = JointProposal(name="j", spring_hz=hertz)
        terms = paper_terms(proposal, prismatic=prismatic, holds=False, rest=0.3, source=Source.MODEL)
        assert near(terms.stiffness.value, wanted) and low < terms.damping.value < high
        assert terms.spring_reference == 0.3, "the paper knows no preload"


def test_the_setting_reaches_the_urdf_with_no_inertia_bound(tmp_path: Path) -> None:
    item = read(written(tmp_path / "in", cabinet()))
    # A toy: by what it moves its lid would bear far less than 0.5 N·m·s/rad.
    proposal = Overlay(
        scale=0.05,
        joints=(JointProposal(name="lid_hinge", damping_level="super high"), JointProposal(name="knob_turn")),
    )
    overlay, findings = validate(item, proposal, Source.MODEL, 0.5, PAPER)
    folder = write_folder(item, overlay, collision_hulls(item, 0.05), tmp_path / "out", PAPER)
    terms = read_dynamics(folder.urdf)
    assert (terms["lid_hinge"].damping, terms["drawer_slide"].damping, terms["knob_turn"].damping) == (0.5, 1.5, 0.15)
    assert 100.0 * PAPER.max_damping_step * overlay.joints[0].effective_inertia / PAPER.coarse_timestep_s < 0.5
    assert not [finding for finding in findings if "bounded" in finding.code or "coupled" in finding.code]
    usual, _ = validate(item, proposal, Source.MODEL, 0.5, PhysicsSettings())
    assert usual.joints[0].damping < 1e-3
