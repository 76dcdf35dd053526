"""Deviation from an expert reference."""

from pathlib import Path

import pytest

from asset2sim.metrics.reference import Deviation, Reference, deviation_line, deviations, read_references
from tests.factories import make_record

HEADER = "asset_id,category,gensim2_task,scale,joint,joint_position\n"


def test_the_task_that_articulates_is_the_one_to_compare_with(tmp_path: Path) -> None:
    file = tmp_path / "reference.csv"
    rows = "1,Box,box_rotate,0.2,joint_0,-0.5\n1,Box,box_move,0.3,joint_1,0\n2,Bag,bag_lift,0.1,joint_1,0\n"
    file.write_text(HEADER + rows, encoding="utf-8")
    assert read_references(file) == {"1": Reference(0.2, "joint_0", -0.5), "2": Reference(0.1, "joint_1", 0.0)}


def test_a_dataset_without_references_has_none(tmp_path: Path) -> None:
    assert read_references(tmp_path / "reference.csv") == {}


def test_deviations_by_hand() -> None:
    record = make_record("a")
    assert record.overlay is not None
    hinge = next(joint for joint in record.overlay.joints if joint.type == "revolute")
    references = {"a": Reference(2.0 * record.overlay.scale, hinge.name, hinge.initial_position + 6.283185307 + 0.25)}
    (found,) = deviations([record], references)
    assert found.scale == pytest.approx(0.5) and found.joint_rad == pytest.approx(0.25) and found.stated
    assert deviations([record], {"other": references["a"]}) == ()


def test_the_line_leaves_unstated_scales_out_and_says_so() -> None:
    line = deviation_line([Deviation("a", 0.1, True, 0.2), Deviation("b", 0.9, False, None)])
    assert line == (
        "off the expert reference: scale 10.0 % over 1 assets (50.0 % over 2, those whose reference states no scale "
        "included); first joint position 0.20 rad over 1 hinges"
    )
