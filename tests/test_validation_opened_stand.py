"""Whether an open lid pulls its object over: a box whose moments anyone can add up."""

import math
from pathlib import Path

import pytest

from asset2sim.validation.validate import validate
from schemas.overlay import LinkProposal, Overlay
from schemas.thresholds import Thresholds
from schemas.vocabulary import Source
from tests.assets import NO_VIEWS, joint, link, read, robot, shape, written


@pytest.mark.parametrize(
    ("lid_kg", "words_at", "limits", "tips"),
    [
        # Laid back, the lid's middle is 0.2 m behind the hinge, the base's 0.2 m before it: it tips from 1 kg on.
        (0.9, 0.0, Thresholds(), False),
        (1.2, 0.0, Thresholds(), True),
        # Asked to be open there, it is the state that the stands check judges.
        (1.2, math.pi, Thresholds(), False),
        # By a margin of 10 degrees and what a push has, 0.9 kg is too much.
        (0.9, 0.0, Thresholds(stands_margin_rad=0.17, touch_j=0.2), True),
    ],
)
def test_a_lid_that_outweighs_its_box_behind_the_hinge_pulls_it_over(
    tmp_path: Path, lid_kg: float, words_at: float, limits: Thresholds, tips: bool
) -> None:
    urdf = robot(
        link("base", shape("0.4 0.4 0.3", xyz="0 0 0.15")),
        link("lid", shape("0.4 0.4 0.02", xyz="-0.2 0 0.01")),
        joint("hinge", "revolute", "base", "lid", xyz="0.2 0 0.301", axis="0 1 0", limit="0 3.1416"),
    )
    proposal = Overlay(
        scale=1.0,
        links=(LinkProposal(name="base", mass_kg=1.0), LinkProposal(name="lid", mass_kg=lid_kg)),
        initial_joint_positions={"hinge": words_at},
        asked=("links.base.mass_kg", "links.lid.mass_kg", "initial_joint_positions.hinge"),
    )
    box, physics = read(written(tmp_path, urdf), "Box"), NO_VIEWS.physics
    _, findings = validate(box, proposal, Source.MODEL, 0.5, physics, limits=limits)
    assert [finding.joint for finding in findings if finding.code == "tips_when_open"] == (["hinge"] if tips else [])
