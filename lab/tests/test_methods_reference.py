"""The human baseline: scale and state from the dataset's table, defaults for the rest, and no model."""

import shutil
from pathlib import Path

import pytest

from asset2sim.assets.authored import ENGINE_MASS_KG
from schemas.asset import AssetRecord, AssetRef
from schemas.vocabulary import FailureMode, Method, Source
from tests.assets import sample
from tests.methods_runs import run, settings_of

HEAD = "asset_id,category,gensim2_task,scale,joint,joint_position\n"
REFERENCE = settings_of(Method.REFERENCE)


@pytest.fixture
def box(tmp_path: Path) -> AssetRef:
    """A box two folders below its dataset."""
    ref = sample("box_wooden")
    folder = tmp_path / "data" / "Box" / ref.asset_id
    shutil.copytree(ref.path, folder)
    return ref.model_copy(update={"path": str(folder)})


def refined(ref: AssetRef, tmp_path: Path, *rows: str, where: str = ".") -> AssetRecord:
    if rows:
        (tmp_path / "data" / where / "reference.csv").write_text(HEAD + "".join(f"{row}\n" for row in rows))
    record, requests = run(ref, tmp_path / "out", REFERENCE)
    assert requests == [] and record.calls == (), "nobody is asked"
    return record


@pytest.mark.system
def test_scale_and_state_are_the_experts_and_the_rest_an_engines(box: AssetRef, tmp_path: Path) -> None:
    record = refined(box, tmp_path, "box_wooden,Box,box_open,0.3,joint_0,0.5", "other,Box,box_open,9,joint_0,0")
    assert record.overlay is not None and (record.overlay.scale, record.overlay.scale_source) == (0.3, Source.USER)
    (joint,) = record.overlay.joints
    assert (joint.initial_position, joint.position_source) == (0.5, Source.USER)
    assert (joint.damping, joint.friction, joint.stiffness) == (0.0, 0.0, 0.0)
    assert {link.mass_kg for link in record.overlay.links} == {ENGINE_MASS_KG}
    assert (tmp_path / "out" / "assets" / "box_wooden" / "mobility.urdf").is_file() and record.reports


@pytest.mark.system
def test_the_nearest_table_counts(box: AssetRef, tmp_path: Path) -> None:
    refined(box, tmp_path, "box_wooden,Box,box_open,0.3,joint_0,0.5")
    record = refined(box, tmp_path, "box_wooden,Box,box_open,0.4,joint_0,0.5", where="Box")
    assert record.overlay is not None and record.overlay.scale == 0.4


@pytest.mark.system
def test_of_several_tasks_the_one_that_articulates_counts(box: AssetRef, tmp_path: Path) -> None:
    rows = ("box_wooden,Box,box_open,0.3,joint_0,0.5", "box_wooden,Box,box_move,0.3,joint_0,0.1")
    record = refined(box, tmp_path, *rows)
    assert record.overlay is not None and record.overlay.joints[0].initial_position == 0.5


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ((), "no reference.csv"),
        (("other,Box,box_open,0.3,joint_0,0.5",), "no row for asset 'box_wooden'"),
        (("box_wooden,Box,box_open,0,joint_0,0.5",), "scale 0"),
        (("box_wooden,Box,box_open,inf,joint_0,0.5",), "scale inf"),
        (("box_wooden,Box,box_open,0.3,joint_0,wide",), "cannot be read"),
    ],
)
def test_without_a_usable_row_there_is_no_estimate(
    box: AssetRef, tmp_path: Path, rows: tuple[str, ...], told: str
) -> None:
    record = refined(box, tmp_path, *rows)
    assert record.failure_mode is FailureMode.NO_VALID_ESTIMATE and told in record.reason, record.reason
    assert record.features is not None and not (tmp_path / "out" / "assets").exists()


@pytest.mark.system
def test_a_joint_that_the_asset_lacks_is_left_out_and_told(box: AssetRef, tmp_path: Path) -> None:
    record = refined(box, tmp_path, "box_wooden,Box,box_open,0.3,joint_9,0.5")
    (finding,) = [item for item in record.findings if item.code == "reference_joint_unknown"]
    assert "joint_9" in finding.message and "joint_0" in finding.message
    assert record.overlay is not None and record.overlay.scale == 0.3
