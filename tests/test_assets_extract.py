"""Extraction: labels, boxes and volumes at sizes known by hand, missing meshes, and the hash of what was read."""

import shutil
from pathlib import Path

import pytest

from asset2sim.intake.origin import extract
from schemas.asset import AssetRef
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode, Severity, VolumeSource
from tests.assets import RAW, box_obj, cabinet, joint, link, mesh, near, read, robot, sample, shape, written

CARTON = RAW / "Box" / "planted_crossed_flaps"
MISSING = RAW / "Box" / "planted_missing_mesh"


def test_labels_and_category_are_the_companion_files() -> None:
    features = read(CARTON).features
    assert [item.name for item in features.links] == ["base", "link_0", "link_1", "link_2"]
    assert [item.label for item in features.links] == ["", "rotation_lid", "rotation_lid", "box_body"]
    assert [item.joint_kind for item in features.links] == ["", "hinge", "hinge", "free"]
    assert (features.category, features.root, features.urdf_file) == ("Box", "base", "mobility.urdf")
    assert read(CARTON, category="Carton").features.category == "Carton", "the manifest goes before meta.json"


def test_boxes_and_volumes_of_the_carton() -> None:
    # Blueprint: flap x -0.7 to 0.12, 0.03 thick, z ±0.45, hinge at (-0.73, 0.626, 0); carton with a tape of 2 mm.
    features = read(CARTON).features
    flap, body = features.link("link_0"), features.link("link_2")
    assert near(flap.box_min, (0.03, 0.0, -0.45), 1e-6) and near(flap.box_max, (0.85, 0.03, 0.45), 1e-6)
    assert near(flap.volume_m3, 0.82 * 0.03 * 0.9, 1e-6)
    assert flap.volume_source is VolumeSource.SIGNED
    assert near(flap.center, (0.44, 0.015, 0.0), 1e-6)
    x, y, z = 0.82, 0.03, 0.9
    assert near(flap.unit_inertia, ((y**2 + z**2) / 12, 0, 0, (x**2 + z**2) / 12, 0, (x**2 + y**2) / 12), 1e-6)
    assert near(body.box_size, (1.4, 0.6, 0.902), 1e-6)
    walls = 1.4 * 0.9 * 0.03 + 2 * 0.03 * 0.57 * 0.9 + 2 * 1.34 * 0.57 * 0.03 + 0.16 * 0.35 * 0.002
    assert near(body.volume_m3, walls, 1e-6)
    assert not features.link("base").has_geometry


def test_rest_and_closed_boxes(tmp_path: Path) -> None:
    # The lid is authored upright: x 0 to 0.4 closed, 0.4 m high at rest.
    urdf = robot(
        link("body", shape("1 1 1")),
        link("lid", shape("0.1 1 0.4", xyz="0 0 0.2")),
        joint("hinge", "revolute", "body", "lid", xyz="0 0 0.6", axis="0 1 0", limit="0 1.5707963267948966"),
    )
    item = read(written(tmp_path, urdf))
    assert near(item.features.rest_box_min, (-0.5, -0.5, -0.5)) and near(item.features.rest_box_max, (0.5, 0.5, 1.0))
    hinge = item.features.joint("hinge")
    assert hinge.closed == hinge.upper and hinge.open == 0.0
    assert near(item.features.closed_size, (1.0, 1.0, 1.15))
    assert near(item.features.link_centers["lid"], (0.0, 0.0, 0.8))


def test_primitives_have_their_own_volumes(tmp_path: Path) -> None:
    features = read(written(tmp_path, cabinet())).features
    assert near(features.link("lid").volume_m3, 0.4 * 0.2 * 0.1)
    assert near(features.link("lid").center, (0.2, 0.0, 0.0))
    assert near(features.joint("drawer_slide").axis_in_root, (1.0, 0.0, 0.0))


def test_volume_says_where_it_came_from(tmp_path: Path) -> None:
    closed = box_obj((0, 0, 0), (1, 2, 3))
    opened = "\n".join(closed.splitlines()[:-2]) + "\n"
    sheet = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"
    links = [link(name, mesh(f"{name}.obj")) for name in ("closed", "opened", "sheet")]
    urdf = robot(*links, joint("a", "fixed", "closed", "opened"), joint("b", "fixed", "closed", "sheet"))
    files = {"closed.obj": closed, "opened.obj": opened, "sheet.obj": sheet}
    features = read(written(tmp_path, urdf, files)).features
    found = {item.name: (item.volume_source, item.meshes[0].watertight, item.meshes[0].flat) for item in features.links}
    assert found == {
        "closed": (VolumeSource.SIGNED, True, False),
        "opened": (VolumeSource.HULL, False, False),
        "sheet": (VolumeSource.BOX, False, True),
    }
    assert near(features.link("closed").volume_m3, 6.0) and near(features.link("opened").volume_m3, 6.0)


def test_a_mesh_reference_is_scaled(tmp_path: Path) -> None:
    one = '<visual><geometry><mesh filename="a.obj" scale="0.5 2 1"/></geometry></visual>'
    features = read(written(tmp_path, robot(link("a", one)), {"a.obj": box_obj((0, 0, 0), (1, 1, 1))})).features
    assert near(features.link("a").box_size, (0.5, 2.0, 1.0))


def test_a_missing_mesh_is_a_finding() -> None:
    item = extract(sample("planted_missing_mesh"))
    findings = [finding for finding in item.findings if finding.code == "missing_mesh"]
    assert [(finding.severity, finding.link) for finding in findings] == [(Severity.WARNING, "link_0")]
    assert "textured_objs/original-2.obj" in findings[0].message and "restore" in findings[0].message
    assert item.mesh_files["textured_objs/original-2.obj"] is None


def test_a_link_none_of_whose_meshes_is_there_is_an_error() -> None:
    with pytest.raises(AssetError, match=r"link_0.*restore") as caught:
        extract(sample("planted_missing_link"))
    assert (caught.value.mode, caught.value.link) == (FailureMode.MISSING_MESH, "link_0")


@pytest.mark.parametrize(("content", "said"), [(b"v 0 0 0\n", "a.obj"), (b"\x00\xff garbage", "a.obj")])
def test_an_unreadable_mesh_beside_a_good_one_is_a_finding(tmp_path: Path, content: bytes, said: str) -> None:
    files: dict[str, str | bytes] = {"a.obj": content, "b.obj": box_obj((0, 0, 0), (1, 1, 1))}
    item = read(written(tmp_path, robot(link("a", mesh("a.obj") + mesh("b.obj"))), files))
    assert {(finding.code, finding.link) for finding in item.findings} == {("unreadable_mesh", "a")}
    assert said in item.findings[0].message
    assert item.mesh_files["a.obj"] is None and near(item.features.link("a").volume_m3, 1.0)


def test_an_asset_without_any_geometry_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(AssetError) as caught:
        read(written(tmp_path, robot(link("a"), link("b"), joint("j", "fixed", "a", "b"))))
    assert caught.value.mode is FailureMode.MISSING_MESH


def test_the_hash_follows_content_and_not_place(tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "deep" / "there"
    shutil.copytree(CARTON, here)
    shutil.copytree(CARTON, there)
    before = read(here).features.content_hash
    assert before == read(there).features.content_hash == read(CARTON).features.content_hash
    (there / "bounding_box.json").write_text("{}")
    assert read(there).features.content_hash == before, "a file that is not read does not count"
    for name in ("textured_objs/original-1.obj", "mobility.urdf", "semantics.txt"):
        file = there / name
        original = file.read_bytes()
        file.write_bytes(original + b"\n")
        assert read(there).features.content_hash != before, name
        file.write_bytes(original)
    assert read(there).features.content_hash == before


def test_extraction_writes_nothing(tmp_path: Path) -> None:
    shutil.copytree(MISSING, tmp_path / "a")
    before = sorted((path, path.stat().st_mtime_ns) for path in (tmp_path / "a").rglob("*"))
    extract(AssetRef(asset_id="a", path=str(tmp_path / "a")))
    assert sorted((path, path.stat().st_mtime_ns) for path in (tmp_path / "a").rglob("*")) == before
