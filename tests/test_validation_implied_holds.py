"""What is asked to stand where its weight would move it holds, unless the proposal says that it does not."""

from pathlib import Path

import pytest

from asset2sim.validation.validate import validate
from schemas.overlay import JointProposal, Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source
from tests.assets import joint, link, read, robot, shape, written

BODY, LID = link("body", shape("1 1 1", xyz="0 0 0.5")), link("lid", shape("1 1 0.02", xyz="-0.5 0 0.01"))
HINGED = joint("j", "revolute", "body", "lid", xyz="0.5 0 1", axis="0 1 0", limit="0 2.8")
SLIDING = joint("j", "prismatic", "body", "lid", xyz="0.5 0 1.01", axis="-1 0 0", limit="0 0.6")


@pytest.mark.parametrize(
    ("how", "at", "said", "holds", "told"),
    [
        (HINGED, 0.6, None, True, 1),  # falls shut
        (HINGED, 2.0, None, True, 1),  # falls further open
        (HINGED, 2.8, None, True, 0),  # rests on its stop
        (HINGED, 0.6, False, False, 0),  # it swings
        (HINGED, 0.6, True, True, 0),
        (SLIDING, 0.3, None, True, 0),  # level
    ],
)
def test_an_asked_position_that_gravity_leaves_is_held(
    tmp_path: Path, how: str, at: float, said: bool | None, holds: bool, told: int
) -> None:
    item = read(written(tmp_path, robot(BODY, LID, how)))
    proposal = Overlay(
        scale=0.2, joints=(JointProposal(name="j", holds=said),), initial_joint_positions={"j": at}, asked=("j",)
    )
    result, findings = validate(item, proposal, Source.MODEL, 0.5, PhysicsSettings())
    assert result.joints[0].holds is holds
    assert [finding.joint for finding in findings if finding.code == "holds_implied"] == ["j"] * told
