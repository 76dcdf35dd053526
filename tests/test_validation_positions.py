"""A closed end that is a guess is said."""

from pathlib import Path

import pytest

from asset2sim.catalog.rows import GUESSES
from asset2sim.validation.validate import validate
from schemas.overlay import Overlay
from schemas.vocabulary import Severity, Source
from tests.assets import NO_VIEWS, joint, link, read, robot, shape, written


def leaf(low: float, high: float, name: str = "door") -> str:
    """A thin leaf on an upright hinge in the middle of its frame, which at half a turn lies as at none."""
    frame = "".join(shape("0.1 0.05 2", xyz=f"0 {y} 1") for y in (-0.85, 0.85))
    return robot(
        link("frame", frame), link(name, shape("0.04 0.8 2", xyz="0 0.4 1")),
        joint("hinge", "revolute", "frame", name, xyz="0 0 0", axis="0 0 1", limit=f"{low} {high}"),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("urdf", "asked", "told"),
    [
        (leaf(0.0, 3.1416), (), True),
        (leaf(0.0, 3.1416), ("hinge", "initial_joint_positions.hinge"), False),
        (leaf(0.0, 1.57), (), False),
        (leaf(0.0, 3.1416, "knob"), (), False),
    ],
)
def test_a_door_whose_closed_end_its_shape_does_not_tell_is_doubtful(
    tmp_path: Path, urdf: str, asked: tuple[str, ...], told: bool
) -> None:
    item = read(written(tmp_path, urdf), "Door")
    proposal = Overlay(scale=1.0, initial_joint_positions={"hinge": 0.0}, asked=asked)
    _, findings = validate(item, proposal, Source.MODEL, 0.5, NO_VIEWS.physics)
    found = [finding for finding in findings if finding.code == "closed_end_guessed"]
    assert bool(found) is told
    assert not told or (found[0].severity is Severity.WARNING and "overrides.csv" in found[0].message)
    assert "closed_end_guessed" in GUESSES
