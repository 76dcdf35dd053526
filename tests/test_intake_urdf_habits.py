"""URDFs as other tools write them: what each means is read, and what was passed over is said."""

from pathlib import Path

import pytest

from asset2sim.assets.urdf.document import read_document
from asset2sim.assets.urdf.read import passing_pairs
from schemas.errors import AssetError
from tests.assets import box_obj, joint, link, mesh, read, robot, shape, written

HEAD = '<?xml version="1.0"?>'


def door(more: str = "", name: str = "door") -> str:
    return robot(link("a", shape("1 1 1")), link(name, shape("1 0.1 1")),
                 joint("hinge", "revolute", "a", name, axis="0 0 1", more=more))  # fmt: skip


@pytest.mark.parametrize("encoding", ["latin-1", "latin1", "cp1252", "utf8"])
def test_names_in_an_encoding_that_only_python_calls_so(tmp_path: Path, encoding: str) -> None:
    text = door('<limit lower="0" upper="1"/>', "t\u00fcr").replace(
        HEAD, f'<?xml version="1.0" encoding="{encoding}"?>'
    )
    folder = written(tmp_path, "")
    (folder / "mobility.urdf").write_bytes(text.encode(encoding))
    assert read(folder).features.joint("hinge").child == "t\u00fcr"


def test_an_encoding_that_nothing_knows_is_told(tmp_path: Path) -> None:
    text = door().replace(HEAD, '<?xml version="1.0" encoding="mine"?>')
    with pytest.raises(AssetError, match=r"mobility\.urdf: not readable as XML"):
        read(written(tmp_path, text))


@pytest.mark.parametrize("reference", ["Meshes/B.OBJ", "meshes/B.obj", "MESHES/b.obj", "package://thing/Meshes/b.OBJ",
                                       "Meshes\\b.obj"])  # fmt: skip
def test_files_are_found_where_their_letters_are_small_and_large(tmp_path: Path, reference: str) -> None:
    text = robot(link("a", mesh(reference)))
    folder = written(tmp_path / "thing", text, {"meshes/b.obj": box_obj((0, 0, 0), (0.1, 0.2, 0.3))})
    found = read(folder)
    assert found.features.closed_size == pytest.approx((0.1, 0.2, 0.3))
    assert "spelt_otherwise" in [finding.code for finding in found.findings]
    (folder / "meshes" / "B.Obj").write_text(box_obj((0, 0, 0), (1, 1, 1)))
    (folder / "meshes" / "b.obj").rename(folder / "meshes" / "b.OBj")
    with pytest.raises(AssetError, match="is not there"):
        read(folder)  # which of the two is meant


def test_letters_lead_to_nothing_outside(tmp_path: Path) -> None:
    (tmp_path / "Other").mkdir()
    (tmp_path / "Other" / "b.obj").write_text(box_obj((0, 0, 0), (1, 1, 1)))
    with pytest.raises(AssetError, match=r"not there|outside"):
        read(written(tmp_path / "thing", robot(link("a", mesh("../other/B.obj")))))


def test_a_spherical_joint_is_three_hinges_whose_links_pass(tmp_path: Path) -> None:
    text = robot(link("a", shape("1 1 1")), link("b", shape("0.1 0.1 1")), joint("ball", "spherical", "a", "b"))
    folder = written(tmp_path, text)
    found = read(folder)
    turns = {item.axis_in_root for item in found.features.movable_joints}
    assert turns == {(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)}
    assert ("a", "b") in passing_pairs(read_document(folder / "mobility.urdf").robot)
    assert "joint_in_steps" in [finding.code for finding in found.findings]


def test_a_link_of_boxes_without_a_size_is_a_frame(tmp_path: Path) -> None:
    text = robot(link("origin", shape("0 0 0")), link("a", shape("1 1 1")), joint("on", "fixed", "origin", "a"))
    found = read(written(tmp_path, text))
    assert not found.features.link("origin").has_geometry and found.features.link("a").has_geometry
    with pytest.raises(AssetError, match="nothing is left of the link"):
        read(written(tmp_path, text.replace('size="0 0 0"', 'size="0 1 1"')))
