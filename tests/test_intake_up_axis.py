"""Which axis points up: found of what is turned, and nothing turned that is right."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from lxml import etree

from asset2sim.guidance.tables import sizes
from asset2sim.intake.origin import extract
from asset2sim.intake.up_axis import RestingShape, evidence, find_up
from schemas.asset import AssetRef
from schemas.vocabulary import UpAxis
from tests.assets import RAW, joint, link, read, robot, shape, written

TABLE = robot(
    link("top", shape("1.2 0.7 0.04", xyz="0 0 0.72")),
    *(link(f"leg_{n}", shape("0.05 0.05 0.7", xyz=f"{x} {y} 0.35")) for n, x, y in
      ((1, 0.55, 0.3), (2, 0.55, -0.3), (3, -0.55, 0.3), (4, -0.55, -0.3))),
    *(joint(f"j{n}", "fixed", "top", f"leg_{n}") for n in (1, 2, 3, 4)),
    link("drawer", shape("0.4 0.4 0.1", xyz="0 0 0.64")),
    joint("slide", "prismatic", "top", "drawer", axis="1 0 0", limit="0 0.35"),
)  # fmt: skip
TURNS = {UpAxis.Z: "0 0 0", UpAxis.Y: "-1.5707963267948966 0 0", UpAxis.MINUS_Y: "1.5707963267948966 0 0",
         UpAxis.X: "0 1.5707963267948966 0"}  # fmt: skip
"""Up axis of a file → roll, pitch and yaw that bring an upright object there."""


def wrapped(urdf: bytes, up: UpAxis) -> bytes:
    """A URDF whose root hangs from a new one by a fixed joint that is turned, as some converters write it."""
    document = etree.fromstring(urdf)
    children = {child.get("link") for child in document.iterfind("joint/child")}
    (root,) = [item.get("name") for item in document.findall("link") if item.get("name") not in children]
    etree.SubElement(document, "link", name="file_root")
    fixed = etree.SubElement(document, "joint", name="file_axes", type="fixed")
    etree.SubElement(fixed, "origin", rpy=TURNS[up])
    etree.SubElement(fixed, "parent", link="file_root")
    etree.SubElement(fixed, "child", link=str(root))
    return etree.tostring(document)


@pytest.mark.parametrize("up", TURNS)
def test_a_table_that_has_y_up_is_found(tmp_path: Path, up: UpAxis) -> None:
    (tmp_path / "mobility.urdf").write_bytes(wrapped(TABLE.encode(), up))
    found, finding = find_up(read(tmp_path))
    if up is not UpAxis.Y:
        assert found is UpAxis.Z, "it is right, or lies as files seldom have it: left as it is"
        assert finding is None or (up is not UpAxis.Z and finding.code == "up_doubtful")
    else:
        assert found is up and finding is not None and finding.code == "turned_upright"
        assert "its top, lids and seats are high" in finding.message and "--up=z" in finding.message
        turned = extract(AssetRef(asset_id="t", path=str(tmp_path)), up=found)
        assert find_up(turned) == (UpAxis.Z, None), "what was turned is right"


def test_what_its_file_raises_is_left(tmp_path: Path) -> None:
    """A light switch with a dimmer, drawn with y up and turned by its root's joint, as PartNet-Mobility does: its shape
    alone would have it turned once more, on its end."""
    lever, knob = shape("0.04 0.04 0.006", xyz="0 0 0.003"), shape("0.036 0.036 0.018", xyz="0 0 0.009")
    raised = joint("up", "fixed", "base", "plate").replace("<origin", "<origin rpy='1.5707963 0 -1.5707963'")
    parts = link("plate", shape("0.15 0.086 0.009", xyz="0 0 -0.0045")) + link("lever", lever) + link("knob", knob)
    hinges = joint("press", "revolute", "plate", "lever", xyz="-0.035 0 0", axis="1 0 0", limit="-0.15 0.15")
    hinges += joint("dim", "revolute", "plate", "knob", xyz="0.035 0 0", axis="0 0 1", limit="-2.3 2.3")
    (tmp_path / "mobility.urdf").write_text(robot(link("base"), parts, hinges, raised))
    up, finding = find_up(read(tmp_path))
    assert up is UpAxis.Z and finding is not None and finding.code == "up_doubtful"
    assert finding.value is not None and finding.limit is not None and finding.value > finding.limit
    assert "turns y up into z up" in finding.message


def test_the_top_drawer_is_not_the_top(tmp_path: Path) -> None:
    """Of a chest whose drawers' names alone say anything, and say the same of every axis."""
    boxes = "".join(link(f"{name}_drawer", shape("0.5 0.5 0.2", xyz=f"0 0 {z}")) for name, z in (("top", 0.8),
                    ("middle", 0.5), ("low", 0.2)))  # fmt: skip
    slides = "".join(joint(name, "fixed", "body", f"{name}_drawer") for name in ("top", "middle", "low"))
    (tmp_path / "mobility.urdf").write_text(robot(link("body", shape("0.52 0.52 1", xyz="0 0 0.5")), boxes, slides))
    seen = RestingShape.of(read(tmp_path))
    assert {word for words, _ in seen.named for word in words} == {"body", "drawer", "middle", "low"}
    assert evidence(seen, np.array((0.0, 0.0, 1.0)))["high"] == 0.0


def test_what_may_lie_is_left_and_told(tmp_path: Path) -> None:
    bare = TABLE.replace("leg_", "part_").replace('"top"', '"board"').replace('"drawer"', '"box"')
    (tmp_path / "mobility.urdf").write_bytes(wrapped(bare.encode(), UpAxis.Y))
    up, finding = find_up(read(tmp_path))
    assert up is UpAxis.Z and finding is not None and finding.code == "up_doubtful" and "--up=y" in finding.message


def test_drawers_are_open_above(tmp_path: Path) -> None:
    """A long counter stands as well on its end; its drawers are boxes without a lid."""
    sides = "".join(shape("0.58 0.02 0.3", xyz=f"0 {y} 0.15") for y in (-0.69, 0.69))
    open_box = shape("0.58 1.4 0.02", xyz="0 0 0.01") + sides + "".join(
        shape("0.02 1.4 0.3", xyz=f"{x} 0 0.15") for x in (-0.28, 0.28))  # fmt: skip
    panels = (("0.6 3 0.04", "0 0 0.02"), ("0.6 3 0.04", "0 0 0.88"), ("0.6 0.04 0.9", "0 -1.48 0.45"),
              ("0.6 0.04 0.9", "0 1.48 0.45"), ("0.6 0.04 0.9", "0 0 0.45"))  # fmt: skip
    for name, box, wanted in (("open", open_box, UpAxis.Y), ("full", shape("0.58 1.4 0.3", xyz="0 0 0.15"), UpAxis.Z)):
        counter = robot(
            link("body", "".join(shape(size, xyz=xyz) for size, xyz in panels)),
            *(link(f"drawer_{n}", box) for n in (1, 2)),
            *(joint(f"j{n}", "prismatic", "body", f"drawer_{n}", xyz=f"0 {1.5 * n - 2.25} {0.1 * n + 0.2}",
                    axis="1 0 0", limit="0 0.5") for n in (1, 2)),
        )  # fmt: skip
        (tmp_path / name).mkdir()
        (tmp_path / name / "mobility.urdf").write_bytes(wrapped(counter.encode(), UpAxis.Y))
        found, finding = find_up(read(tmp_path / name))
        assert found is wanted
        assert wanted is UpAxis.Z or (finding is not None and "its drawers are open above" in finding.message)


def test_meshes_of_gltf_have_y_up_unless_they_are_turned(tmp_path: Path) -> None:
    """The up axis of a mesh's format decides where shapes leave it in doubt."""
    bare = TABLE.replace("leg_", "part_").replace('"top"', '"board"').replace('"drawer"', '"box"')
    for turned in (False, True):
        document, place = etree.fromstring(bare.encode()), tmp_path / str(turned)
        place.mkdir()
        for number, visual in enumerate(document.iterfind("link/visual")):
            (origin,), (box,) = visual.findall("origin"), visual.findall("geometry/box")
            for item, key in ((origin, "xyz"), (box, "size")):
                x, y, z = str(item.get(key)).split()
                item.set(key, f"{x} {z} {y}")
            extents = [float(word) for word in str(box.get("size")).split()]
            for geometry in visual.iterfind("geometry"):
                geometry[:] = [etree.Element("mesh", filename=f"{number}.glb", scale="1, 1, 1")]
            if turned:
                origin.set("rpy", "1.5707963267948966 0 0")
                extents = [extents[0], extents[2], extents[1]]
            trimesh.creation.box(extents).export(place / f"{number}.glb")
        for collision in document.findall("link/collision"):
            for parent in collision.iterancestors("link"):
                parent.remove(collision)
        (place / "mobility.urdf").write_bytes(etree.tostring(document))
        up, finding = find_up(read(place))
        assert up is (UpAxis.Z if turned else UpAxis.Y)
        assert turned or (finding is not None and "its meshes are glTF's" in finding.message)


def test_without_evidence_nothing_is_turned(tmp_path: Path) -> None:
    assert find_up(read(written(tmp_path, robot(link("block", shape("1 2 3")))))) == (UpAxis.Z, None)


def test_a_flat_thing_on_a_wall_is_not_laid_down(tmp_path: Path) -> None:
    clock = robot(
        link("face", shape("0.02 0.3 0.3")), link("hand", shape("0.004 0.02 0.1", xyz="0.015 0 0.05")),
        joint("turn", "continuous", "face", "hand", axis="1 0 0"),
    )  # fmt: skip
    assert find_up(read(written(tmp_path, clock))) == (UpAxis.Z, None)


def test_things_of_the_hand_are_left_as_they_are(tmp_path: Path) -> None:
    (tmp_path / "mobility.urdf").write_bytes(wrapped(TABLE.encode(), UpAxis.Y))
    assert find_up(read(tmp_path, "Knife")) == (UpAxis.Z, None)


SAMPLES = sorted(file.parent for file in RAW.glob("*/*/mobility.urdf") if not file.parent.name.startswith("planted"))


@pytest.mark.parametrize("folder", SAMPLES, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_no_sample_is_turned(folder: Path) -> None:
    category = folder.parent.name
    assert find_up(extract(AssetRef(asset_id=folder.name, path=str(folder), category=category))) == (UpAxis.Z, None)


def test_of_the_samples_most_are_found_when_y_is_up(tmp_path: Path) -> None:
    found = []
    for folder in (folder for folder in SAMPLES if not sizes()[folder.parent.name].lies):
        place = shutil.copytree(folder, tmp_path / folder.name)
        (place / "mobility.urdf").write_bytes(wrapped((folder / "mobility.urdf").read_bytes(), UpAxis.Y))
        extraction = extract(AssetRef(asset_id=folder.name, path=str(place), category=folder.parent.name))
        found.append(find_up(extraction)[0])
    assert set(found) <= {UpAxis.Z, UpAxis.Y}, "none is turned a wrong way"
    assert len(found) > 8 and found.count(UpAxis.Y) > len(found) / 2
