"""The sample dataset: git holds what the generator writes, good objects are good, planted defects are there."""

import csv
import itertools
import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pybullet
import pytest
import trimesh
from PIL import Image

from schemas.errors import UsageError
from schemas.vocabulary import FailureMode
from tests.assets import RAW, ROOT
from tests.samples.bad_assets import bad_assets
from tests.samples.blueprint import Blueprint
from tests.samples.layout import number_text
from tests.samples.sample_dataset import blueprints, sample_files, write_samples

pytestmark = pytest.mark.system

DEPTH = 5e-4
"""Deepest self-contact allowed at the closed or authored state, object units."""


def manifest() -> list[dict[str, str]]:
    with (RAW / "manifest.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


GOOD = [row for row in manifest() if row["subset"] == "sample"]
GOOD_IDS = [row["asset_id"] for row in GOOD]
good = pytest.mark.parametrize("row", GOOD, ids=GOOD_IDS)


def folder(asset_id: str) -> Path:
    return next(RAW / row["path"] for row in manifest() if row["asset_id"] == asset_id)


def only(element: ET.Element, path: str) -> ET.Element:
    found = element.find(path)
    assert found is not None, path
    return found


def robot(asset_id: str) -> ET.Element:
    return ET.parse(folder(asset_id) / "mobility.urdf").getroot()


def tree(root: Path) -> dict[str, bytes]:
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in sorted(root.rglob("*")) if p.is_file()}


@contextmanager
def loaded(urdf: Path) -> Iterator[tuple[int, int]]:
    """(client, body) of a fixed-base body with self-collision."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        flags = pybullet.URDF_USE_SELF_COLLISION
        yield client, pybullet.loadURDF(str(urdf), useFixedBase=True, flags=flags, physicsClientId=client)
    finally:
        pybullet.disconnect(client)


def limits(client: int, body: int) -> dict[int, tuple[float, float]]:
    """Joint index → range, [0, 2π] for continuous joints."""
    found = {}
    for index in range(pybullet.getNumJoints(body, physicsClientId=client)):
        info = pybullet.getJointInfo(body, index, physicsClientId=client)
        if info[2] != pybullet.JOINT_FIXED:
            found[index] = (info[8], info[9]) if info[9] > info[8] else (0.0, 2.0 * np.pi)
    return found


def place(client: int, body: int, positions: dict[int, float]) -> None:
    for index, position in positions.items():
        pybullet.resetJointState(body, index, position, physicsClientId=client)
    pybullet.performCollisionDetection(physicsClientId=client)


def closest(client: int, body: int, a: int, b: int) -> float:
    """Least separation of two links, whether or not the engine filters their contacts; 0.05 if further apart."""
    points = pybullet.getClosestPoints(body, body, 0.05, a, b, physicsClientId=client)
    return min((point[8] for point in points), default=0.05)


def test_generator_writes_what_is_checked_in(tmp_path: Path) -> None:
    written = write_samples(tmp_path / "raw")
    assert written == [row["asset_id"] for row in manifest()]
    fresh, kept = tree(tmp_path / "raw"), tree(RAW)
    assert sorted(fresh) == sorted(kept), "run `python -m tests.samples.sample_dataset`"
    assert [name for name in kept if fresh[name] != kept[name]] == []


def test_bytes_do_not_depend_on_the_environment(tmp_path: Path) -> None:
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    env = {**os.environ, "PYTHONPATH": path, "PYTHONHASHSEED": "7", "LC_ALL": "C", "TZ": "Asia/Kolkata"}
    command = [sys.executable, "-m", "tests.samples.sample_dataset", str(tmp_path / "out")]
    done = subprocess.run(command, env=env, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "assets written" in done.stdout
    assert tree(tmp_path / "out") == tree(RAW)


def test_writing_again_removes_what_is_stale(tmp_path: Path) -> None:
    out = tmp_path / "raw"
    write_samples(out)
    (out / "Box" / "left_over.txt").write_text("old")
    write_samples(out)
    assert not (out / "Box" / "left_over.txt").exists()
    assert [entry.name for entry in tmp_path.iterdir()] == ["raw"], "no temporary folder is left"


def test_a_folder_that_is_not_ours_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(UsageError, match="not an earlier sample dataset"):
        write_samples(tmp_path)
    (tmp_path / "manifest.csv").write_text("asset_id,path,subset\n1,Box/1,mine\n")
    with pytest.raises(UsageError):
        write_samples(tmp_path)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_dataset_is_small() -> None:
    assert sum(len(data) for data in sample_files().values()) < 1_000_000


def test_manifest() -> None:
    rows = manifest()
    assert list(rows[0]) == ["asset_id", "category", "path", "subset", "prompt"]
    for column in ("asset_id", "path", "prompt"):
        values = [row[column] for row in rows]
        assert len(set(values)) == len(values) and all(values), column
    assert len(GOOD) >= 12
    assert len({row["category"] for row in GOOD}) >= 8
    assert {row["subset"] for row in rows} == {"sample", "planted"}
    assert all((RAW / row["path"] / "mobility.urdf").is_file() for row in rows)


@good
def test_layout_is_the_real_datas(row: dict[str, str]) -> None:
    asset = RAW / row["path"]
    for name in ("semantics.txt", "meta.json", "bounding_box.json", "mobility_v2.json"):
        assert (asset / name).stat().st_size > 0
    element = robot(row["asset_id"])
    links = {link.get("name"): link for link in element.findall("link")}
    assert len(links.pop("base")) == 0
    assert not list(element.iter("inertial")) and not list(element.iter("dynamics"))
    semantics = [line.split(" ") for line in (asset / "semantics.txt").read_text().splitlines()]
    assert [line[0] for line in semantics] == list(links) and all(len(line) == 3 for line in semantics)
    root = next(joint for joint in element.findall("joint") if joint.get("type") == "fixed")
    assert only(root, "origin").get("rpy") == "1.570796326794897 0 -1.570796326794897"
    assert len(element.findall("link/visual")) == len(element.findall("link/collision"))
    files = {mesh.get("filename") for mesh in element.iter("mesh")}
    assert files == {f"textured_objs/{path.name}" for path in (asset / "textured_objs").glob("*.obj")}
    assert len(files) > len(links), "links are made of several meshes"


@good
def test_bounding_box_is_the_box_of_the_meshes(row: dict[str, str]) -> None:
    asset = RAW / row["path"]
    points = []
    for path in sorted((asset / "textured_objs").glob("*.obj")):
        text = path.read_text()
        points += [line.split()[1:] for line in text.splitlines() if line.startswith("v ")]
        assert all(len(number.rpartition(".")[2]) <= 6 for number in re.findall(r"-?\d+\.\d+", text))
        assert not re.search(r"-0(?![.\d])", text)
    vertices = np.array(points, dtype=float)
    box = json.loads((asset / "bounding_box.json").read_text())
    assert box["min"] == vertices.min(axis=0).tolist() and box["max"] == vertices.max(axis=0).tolist()
    size = vertices.max(axis=0) - vertices.min(axis=0)
    assert 1.0 < size.max() < 2.5


@pytest.mark.parametrize("blueprint", [b for b in blueprints() if b.subset == "sample"], ids=GOOD_IDS)
def test_every_piece_is_a_convex_volume(blueprint: Blueprint) -> None:
    for part in blueprint.parts:
        for piece in part.pieces:
            mesh = trimesh.Trimesh(piece.mesh.vertices, piece.mesh.faces, process=False)
            assert mesh.is_watertight and mesh.is_winding_consistent, piece.name
            # An engine takes the hull: it must add nothing to speak of, or interiors and gaps would fill up.
            assert mesh.volume == pytest.approx(mesh.convex_hull.volume, rel=0.03), piece.name


@good
def test_loads_and_nothing_collides_closed_or_as_authored(row: dict[str, str]) -> None:
    urdf = RAW / row["path"] / "mobility.urdf"
    authored = {j.attrib["name"]: j.attrib["type"] for j in robot(row["asset_id"]).findall("joint")}
    with loaded(urdf) as (client, body):
        names = {"revolute": 0, "prismatic": 1, "continuous": 0, "fixed": 4}
        infos = [pybullet.getJointInfo(body, i, physicsClientId=client) for i in range(len(authored))]
        assert pybullet.getNumJoints(body, physicsClientId=client) == len(authored)
        assert {info[1].decode(): info[2] for info in infos} == {name: names[kind] for name, kind in authored.items()}
        ranges = limits(client, body)
        for state in ({index: low for index, (low, _) in ranges.items()}, dict.fromkeys(ranges, 0.0)):
            if row["asset_id"] in ("suitcase_handbag", "bucket_yellow"):
                state = dict.fromkeys(ranges, 0.0)  # Their lower limit is one side, not closed.
            place(client, body, state)
            contacts = pybullet.getContactPoints(body, body, physicsClientId=client)
            assert max((-point[8] for point in contacts), default=0.0) <= DEPTH
            for a, b in itertools.combinations(range(len(infos)), 2):
                assert closest(client, body, a, b) > 0.01, (infos[a][12], infos[b][12])


@good
def test_each_joint_is_free_of_its_parent_over_its_range(row: dict[str, str]) -> None:
    with loaded(RAW / row["path"] / "mobility.urdf") as (client, body):
        ranges = limits(client, body)
        for index, (low, high) in ranges.items():
            parent = pybullet.getJointInfo(body, index, physicsClientId=client)[16]
            for position in np.linspace(low, high, 9):
                place(client, body, {other: ends[0] for other, ends in ranges.items()} | {index: float(position)})
                assert closest(client, body, index, parent) > 0.01, position


def test_textures_are_pictures_that_meshes_use() -> None:
    pictures = sorted(RAW.rglob("images/*.png"))
    assert pictures
    for path in pictures:
        with Image.open(path) as picture:
            colours = np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)
        assert len(colours) > 2
        materials = (path.parents[1] / "textured_objs").glob("*.mtl")
        using = [m for m in materials if f"map_Kd ../images/{path.name}" in m.read_text()]
        assert using and all("\nvt " in m.with_suffix(".obj").read_text() for m in using)


def test_stapler_is_a_chain_about_one_pin() -> None:
    body, lid = (only(robot("stapler_desk"), f"joint[@name='{name}']") for name in ("joint_0", "joint_1"))
    assert only(body, "parent").get("link") == "link_1"
    assert only(body, "origin").get("xyz") == "0 0 0"
    assert only(body, "axis").get("xyz") == "1 0 0"
    assert only(lid, "axis").get("xyz") == "-1 0 0"


def test_authored_offsets_move_the_closed_end_below_zero() -> None:
    limit = only(robot("laptop_silver"), "joint[@name='joint_0']/limit")
    assert (limit.get("lower"), limit.get("upper")) == ("-1.7", "0.6")


@pytest.mark.parametrize(("value", "text"), [(0.5, "0.5"), (-0.0, "0"), (-1e-9, "0"), (2.0, "2"), (1 / 3, "0.333333")])
def test_number_text(value: float, text: str) -> None:
    assert number_text(value) == text


def test_planted_outcomes_name_every_planted_asset() -> None:
    expected = {bad.blueprint.asset_id: bad.outcomes for bad in bad_assets()}
    assert set(expected) == {row["asset_id"] for row in manifest() if row["subset"] == "planted"}
    assert expected["planted_not_xml"] == (FailureMode.UNREADABLE_ASSET,)
    assert expected["planted_missing_link"] == (FailureMode.MISSING_MESH,)


def test_planted_open_mesh_encloses_nothing() -> None:
    for path in (folder("planted_open_mesh") / "textured_objs").glob("*.obj"):
        assert not trimesh.load_mesh(path).is_watertight


def test_planted_decal_is_flat_and_is_a_collision_shape_too() -> None:
    link = only(robot("planted_flat_decal"), "link[@name='link_0']")
    file = only(link, "visual[@name='decal-1']/geometry/mesh").attrib["filename"]
    assert file in [mesh.get("filename") for mesh in link.findall("collision/geometry/mesh")]
    mesh = trimesh.load_mesh(folder("planted_flat_decal") / file)
    assert min(mesh.extents) == 0.0 and mesh.area > 0.1, "coplanar, so without volume"


@pytest.mark.parametrize(("asset_id", "left"), [("planted_missing_mesh", 1), ("planted_missing_link", 0)])
def test_planted_missing_meshes_are_missing(asset_id: str, left: int) -> None:
    links = robot(asset_id).findall("link")
    missing = {
        link.get("name"): sum(
            not (folder(asset_id) / m.attrib["filename"]).exists() for m in link.findall("visual//mesh")
        )
        for link in links
    }
    assert missing["link_0"] == 1 and sum(missing.values()) == 1
    assert len(links[1].findall("visual")) - missing["link_0"] == left


def test_planted_flaps_collide_closed_and_not_after_a_small_lift() -> None:
    with loaded(folder("planted_crossed_flaps") / "mobility.urdf") as (client, body):
        first, second = limits(client, body)
        place(client, body, {first: 0.0, second: 0.0})
        assert max(-point[8] for point in pybullet.getContactPoints(body, body, physicsClientId=client)) > 0.02
        place(client, body, {first: 0.0, second: 0.15})
        assert closest(client, body, first, second) > 0.01


def test_planted_drawer_is_blocked_by_its_closed_door() -> None:
    with loaded(folder("planted_blocked_drawer") / "mobility.urdf") as (client, body):
        by_name = {pybullet.getJointInfo(body, i, physicsClientId=client)[12].decode(): i for i in limits(client, body)}
        drawer, door = by_name["link_0"], by_name["link_1"]
        place(client, body, {drawer: 0.0, door: 0.0})
        assert closest(client, body, drawer, door) > 0.01
        # Even a tenth of both ranges nearer to each other they collide.
        place(client, body, {drawer: 0.35 - 0.07, door: 0.19})
        assert closest(client, body, drawer, door) < -0.01
        place(client, body, {drawer: 0.35, door: 1.8})
        assert closest(client, body, drawer, door) > 0.01


def test_planted_limits_are_inverted() -> None:
    limit = only(robot("planted_inverted_limits"), "joint[@name='joint_0']/limit")
    assert float(limit.attrib["lower"]) > float(limit.attrib["upper"])


def test_planted_text_is_not_xml() -> None:
    with pytest.raises(ET.ParseError):
        robot("planted_not_xml")
