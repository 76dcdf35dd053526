"""Every mesh that cannot be used is named with its cause and what to do, and the rest of its asset is read."""

import os
import struct
from pathlib import Path

import pytest
import trimesh
from lxml import etree

from asset2sim.assets.urdf.document import read_document
from asset2sim.intake.origin import extract
from schemas.asset import AssetRef
from schemas.errors import AssetError
from schemas.finding import Finding
from schemas.inputs import InputSettings
from schemas.vocabulary import FailureMode, Severity
from tests.assets import box_obj, joint, link, mesh, read, robot, shape, written

BOX = box_obj((0, 0, 0), (1, 1, 1))
STL: bytes = trimesh.creation.box().export(file_type="stl")
GLB: bytes = trimesh.Scene(trimesh.creation.box()).export(file_type="glb")
PLY = "".join(f"{line}\n" for line in (
    "ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz"), "element face 1",
    "property list uchar int vertex_indices", "end_header", "0 0 0", "1 0 0", "0 1 0",
))  # fmt: skip
SHEET = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def lost(folder: Path, reference: str, files: dict[str, str | bytes], tag: str = "") -> Finding:
    """The one warning of a link that has a good box beside a mesh that cannot be used."""
    bad = tag or f'<mesh filename="{reference}"/>'
    body = mesh("good.obj", "visual") + f"<visual><geometry>{bad}</geometry></visual>"
    item = read(written(folder, robot(link("body", body)), {"good.obj": BOX, **files}))
    assert item.features.link("body").volume_m3 == pytest.approx(1.0)
    assert item.mesh_files.get(reference) is None
    (found,) = [finding for finding in item.findings if finding.severity is Severity.WARNING]
    assert found.link == "body" and "'body'" in found.message and ": " in found.message and "\n" not in found.message
    return found


@pytest.mark.parametrize(
    ("name", "content", "cause", "remedy"),
    [
        ("a.obj", b"", "is empty", "restore"),
        ("a.obj", "v 0 0 0\nv 1 0 0\n", "no triangle", "export"),
        ("a.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "not finite", "export"),
        ("a.obj", "v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n", "not finite", "export"),
        ("a.obj", SHEET.replace("1 0 0", "1e30 0 0"), "reaches 1e+30 m", "scale"),
        ("a.obj", SHEET.replace("1 0 0", "1e300 0 0"), "reaches 1e+300 m", "scale"),
        ("a.obj", SHEET.replace("1", "1e-30", 2), "", ""),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "does not hold", "export"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 2\n", "degenerate", "export"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n", "cannot be read", "export"),
        ("a.obj", os.urandom(500) + b"\x00", "binary data", "export"),
        ("a.obj", STL, "binary data", "export"),
        ("a.obj", "solid x\n facet normal 0 0 1\n", "STL by its content", "a.stl"),
        ("a.obj", b"\x89PNG\r\n", "PNG picture", "mesh"),
        ("a.obj", "version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "Git LFS pointer", "git lfs pull"),
        ("a.obj", "<!DOCTYPE html><html>404", "web page", "download"),
        ("a.stl", STL[:-60], "10 of 12 triangles", "copy it again"),
        ("a.stl", STL[:40], "cut off", "copy it again"),
        ("a.stl", BOX, "OBJ by its content", "a.obj"),
        ("a.stl", b"\x00" * 84, "no triangle", "export"),
        ("a.glb", GLB[:-30], "ends before", "copy it again"),
        ("a.glb", b"glTF" + struct.pack("<II", 2, 12), "", "export"),
        ("a.dae", "<?xml version='1.0'?><COLLADA><asset>", "cut off", "export"),
        ("a.gltf", '{"buffers": [{"uri": "gone.bin", "byteLength": 9}], "asset": {"version": "2.0"}}', "", ""),
        ("a.gltf", '{"asset"', "", "export"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "", "export"),
        ("a.off", "OFF\n3 1", "", "export"),
        ("a.ply", f"{PLY}3 0 1 8\n", "a face of vertex 9, and 3 vertices", "export"),
        ("a.fbx", b"Kaydara FBX Binary", "'.fbx'", ".obj, .stl"),
        ("a.zip", b"PK\x03\x04", "'.zip'", ".obj, .stl"),
        ("a", BOX, "''", ".obj, .stl"),
    ],
)  # fmt: skip
def test_each_cause_is_named_with_its_remedy(
    tmp_path: Path, name: str, content: str | bytes, cause: str, remedy: str
) -> None:
    found = lost(tmp_path, name, {name: content})
    assert found.code == "unreadable_mesh" and f"'{name}'" in found.message
    assert cause in found.message and remedy in found.message


@pytest.mark.parametrize(
    ("reference", "cause", "remedy"),
    [
        ("gone.obj", "is not there", "restore"),
        ("folder", "is a folder", "name a file"),
        ("pipe.obj", "pipe", "replace"),
        ("broken.obj", "is a link to nowhere.obj", "restore"),
        ("round.obj", "cannot be opened", "rename"),
        ("http://example.com/a.obj", "web address", "download"),
        ("https://example.com/a.obj", "web address", "download"),
        ("package://kit/a.obj", "is not there", "--package kit=PATH"),
        ("", "names no file", "state its path"),
        (f"{'x' * 300}.obj", "cannot be opened", "rename"),
        ("/nowhere/at/all.obj", "lies outside", "--allow-outside"),
        ("good.obj/more.obj", "is not there", "restore"),
    ],
)
def test_what_is_no_file_says_what_it_is(tmp_path: Path, reference: str, cause: str, remedy: str) -> None:
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe.obj")
    (tmp_path / "broken.obj").symlink_to("nowhere.obj")
    (tmp_path / "round.obj").symlink_to("round.obj")
    found = lost(tmp_path, reference, {})
    assert found.code == "missing_mesh" and f"'{reference}'" in found.message
    assert cause in found.message and remedy in found.message


def test_a_mesh_without_a_file_name(tmp_path: Path) -> None:
    assert "names no file" in lost(tmp_path, "", {}, tag="<mesh/>").message


def test_a_file_that_may_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened = Path.open

    def refusing(path: Path, mode: str = "r", *how: str, **more: str) -> object:
        if path.name == "a.obj" and mode in ("r", "rb"):
            raise PermissionError(13, "Permission denied", str(path))
        return opened(path, mode, *how, **more)  # type: ignore[call-overload]

    monkeypatch.setattr(Path, "open", refusing)
    assert "Permission denied): give" in lost(tmp_path, "a.obj", {"a.obj": BOX}).message


def test_a_file_that_is_too_large(tmp_path: Path) -> None:
    written(tmp_path, robot(link("body", mesh("a.obj", "visual") + mesh("b.obj", "visual"))), {"b.obj": BOX})
    (tmp_path / "a.obj").write_text(BOX + "# padding\n" * 200)
    ref = AssetRef(asset_id="a", path=str(tmp_path))
    item = extract(ref, inputs=InputSettings(max_mesh_mb=0.001))
    assert "MB" in item.findings[0].message and "inputs.max_mesh_mb" in item.findings[0].message
    assert not extract(ref).findings


@pytest.mark.parametrize(
    "scale", ["0 0 0", "0", "1 1 0", "-0 -0 -0", "nan nan nan", "inf 1 1", "a b c", "1 1", "1 1 1 1"]
)
def test_a_scale_that_leaves_nothing(tmp_path: Path, scale: str) -> None:
    found = lost(tmp_path, "b.obj", {"b.obj": BOX}, tag=f'<mesh filename="b.obj" scale="{scale}"/>')
    assert found.code == "mesh_scale" and f"'{scale}'" in found.message and "none of them 0" in found.message
    alone = f'<visual><geometry><mesh filename="b.obj" scale="{scale}"/></geometry></visual>'
    with pytest.raises(AssetError, match="nothing is left of the link") as caught:
        read(written(tmp_path, robot(link("body", alone))))
    assert (caught.value.mode, caught.value.link) == (FailureMode.MISSING_MESH, "body")


@pytest.mark.parametrize("scale", ["1e30 1e30 1e30", "1e-30 1e-30 1e-30", "1e308 1 1"])
def test_a_scale_of_no_size(tmp_path: Path, scale: str) -> None:
    found = lost(tmp_path, "b.obj", {"b.obj": BOX}, tag=f'<mesh filename="b.obj" scale="{scale}"/>')
    assert found.code == "unreadable_mesh" and "mend its vertices or its scale" in found.message


@pytest.mark.parametrize(("scale", "size"), [("", 1.0), ("2", 2.0), ("-1 1 1", 1.0), ("1,1,3", 3.0)])
def test_scales_that_are_read(tmp_path: Path, scale: str, size: float) -> None:
    one = f'<visual><geometry><mesh filename="b.obj" scale="{scale}"/></geometry></visual>'
    item = read(written(tmp_path, robot(link("body", one)), {"b.obj": BOX}))
    assert max(item.features.rest_size) == pytest.approx(size)


@pytest.mark.parametrize(
    "tag", ['<box size="1 0 1"/>', '<box size="nan 1 1"/>', "<box/>", '<sphere radius="-1"/>', '<cylinder radius="1"/>',
            '<sphere radius="1e30"/>', '<box size="1 1"/>', '<capsule radius="a" length="1"/>'],
)  # fmt: skip
def test_a_shape_of_no_size(tmp_path: Path, tag: str) -> None:
    assert lost(tmp_path, "", {}, tag=tag).code == "shape_size"


@pytest.mark.parametrize(
    ("tag", "collides_as"),
    [
        ('<box size="2 2 1e-05"/>', "2 2 0.0001"),
        ('<cylinder radius="0.5" length="1e-06"/>', "0.0001"),
        ('<box size="0.01 0.01 2e-05"/>', "0.01 0.01 2e-05"),
        ('<box size="2 0.001 0.0002"/>', "2 0.001 0.0002"),
    ],
    ids=["a plate", "a disc", "a small plate", "a strip"],
)
def test_a_plate_thinner_than_engines_bear_collides_as_a_thicker_one(
    tmp_path: Path, tag: str, collides_as: str
) -> None:
    one = "".join(f"<{role}><geometry>{tag}</geometry></{role}>" for role in ("visual", "collision"))
    path = written(tmp_path, robot(link("body", one)))
    document = read_document(path / "mobility.urdf")
    (collides,) = document.robot.iterfind("link/collision/geometry/*")
    (seen,) = document.robot.iterfind("link/visual/geometry/*")
    key = "size" if collides.tag == "box" else "length"
    assert collides.get(key) == collides_as and etree.fromstring(tag).get(key) == seen.get(key)
    thicker = [finding.link for finding in document.findings if finding.code == "sheet_thickened"]
    assert thicker == ["body"] * (collides_as not in tag)


@pytest.mark.parametrize(
    ("joint_text", "said"),
    [
        ('<limit lower="a" upper="1"/>', "<limit lower='a'>"),
        ('<limit lower="" upper="1"/>', "<limit lower=''>"),
        ('<limit lower="0" upper="1" effort="1,5"/>', "<limit effort='1,5'>"),
        ('<dynamics damping="None"/>', "<dynamics damping='None'>"),
        ('<dynamics friction="1e999"/>', "<dynamics friction='1e999'>"),
        ('<axis xyz="1 0"/>', "<axis xyz='1 0'>"),
        ('<origin xyz="1e30 0 0"/>', "<origin xyz='1e30 0 0'>"),
    ],
)
def test_a_number_of_a_joint_that_is_none_names_it(tmp_path: Path, joint_text: str, said: str) -> None:
    swing = f'<joint name="swing" type="revolute"><parent link="a"/><child link="b"/>{joint_text}</joint>'
    folder = written(tmp_path, robot(link("a", shape("1 1 1")), link("b", shape("1 1 1")), swing))
    with pytest.raises(AssetError) as caught:
        read(folder)
    assert (caught.value.mode, caught.value.joint) == (FailureMode.INVALID_JOINT_CONFIGURATION, "swing")
    assert "mobility.urdf" in str(caught.value) and said in str(caught.value)


@pytest.mark.parametrize("mass", ["a", "nan", "1e30", ""])
def test_an_inertial_that_is_none_does_not_end_the_asset(tmp_path: Path, mass: str) -> None:
    stated = f'<inertial><mass value="{mass}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    item = read(written(tmp_path, robot(link("a", stated + shape("1 1 1")))))
    assert [finding.code for finding in item.findings] == ["inertial_unusable"] and item.features.links[
        0
    ].inertial is None


@pytest.mark.parametrize("number", ["a", "nan", "inf", "1 2", ""])
def test_a_contact_that_is_no_number_counts_for_nothing(tmp_path: Path, number: str) -> None:
    bullet = f'<contact><lateral_friction value="{number}"/><restitution value="0.1"/></contact>'
    gazebo = f'<gazebo reference="b"><mu1>{number}</mu1></gazebo>'
    text = robot(link("a", bullet + shape("1 1 1")), link("b", shape("1 1 1")), joint("j", "fixed", "a", "b"), gazebo)
    item = read(written(tmp_path, text))
    assert [(finding.code, finding.link) for finding in item.findings] == [
        ("contact_number", "a"),
        ("contact_number", "b"),
    ]
    contacts = [own.contact for own in item.features.links]
    assert contacts[0] is not None and contacts[0].friction is None and contacts[0].restitution == 0.1
    assert contacts[1] is None


def test_a_name_that_engines_die_of(tmp_path: Path) -> None:
    assert read(written(tmp_path, robot(link("x" * 255, shape("1 1 1"))))).findings == ()
    with pytest.raises(AssetError, match=r"mobility\.urdf: <link> 'xxx.*5000 characters.*shorten") as caught:
        read(written(tmp_path, robot(link("x" * 5000, shape("1 1 1")))))
    assert caught.value.code == "name_too_long"


def test_a_mimic_is_said_and_honoured(tmp_path: Path) -> None:
    follow = '<mimic joint="one" multiplier="-2" offset="0.1"/>'
    urdf = robot(
        link("body", shape("1 1 1")), link("a", shape("0.1 0.1 0.4")), link("b", shape("0.1 0.1 0.4")),
        joint("one", "revolute", "body", "a", axis="0 0 1", limit="0 1"),
        joint("two", "revolute", "body", "b", axis="0 0 1", limit="-1.9 0.1", more=follow),
    )  # fmt: skip
    item = read(written(tmp_path, urdf))
    (found,) = [finding for finding in item.findings if finding.code == "mimic"]
    assert found.joint == "two" and "'two'" in found.message and "-2 × 'one' + 0.1" in found.message
    two = item.features.joint("two")
    assert two.mimic is not None and two.mimic.at(0.5) == pytest.approx(-0.9)
    assert (two.lower, two.upper) == pytest.approx((-1.9, 0.1))
