"""The experts' choices, as the dataset states them."""

from pathlib import Path

import pytest

from asset2sim.runs.check_request import read_references
from schemas.alignment import Reference
from schemas.errors import UsageError

HEADER = "asset_id,category,gensim2_task,scale,joint,joint_position\n"


def test_the_task_that_articulates_is_the_one_to_compare_with(tmp_path: Path) -> None:
    file = tmp_path / "reference.csv"
    rows = "1,Box,box_rotate,0.2,joint_0,-0.5\n1,Box,box_move,0.3,joint_1,0\n2,Bag,bag_lift,0.1,joint_1,0\n"
    file.write_text(HEADER + rows, encoding="utf-8")
    assert read_references(file) == {"1": Reference(0.2, "joint_0", -0.5), "2": Reference(0.1, "joint_1", 0.0)}


def test_a_dataset_without_references_has_none(tmp_path: Path) -> None:
    assert read_references(tmp_path / "reference.csv") == {}


def test_a_loader_s_default_is_no_expert_s_scale() -> None:
    assert not Reference(1.0, "joint_0", 0.0).states_scale and Reference(0.3, "joint_0", 0.0).states_scale


@pytest.mark.parametrize(
    "text",
    ["id,scale\n1,0.2\n", HEADER + "1,Box,box_rotate,small,joint_0,0\n", HEADER + "1,Box,box_rotate,0,joint_0,0\n",
     HEADER + "1,Box,box_rotate,0.2,joint_0,nan\n", HEADER + "1,Box\n"],
)  # fmt: skip
def test_a_table_that_is_none_is_the_user_s_mistake(tmp_path: Path, text: str) -> None:
    file = tmp_path / "reference.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(UsageError, match=r"reference\.csv: not a table with the columns asset_id"):
        read_references(file)
