"""Hulls in USD are within what PhysX collides on a GPU, inside the given ones, and as far from them as they say."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import ConvexHull

from asset2sim.assets.exports import write_exports
from asset2sim.assets.exports.refined_object import read_object
from asset2sim.assets.exports.usd_collision import (
    POLYGON_LIMIT,
    POLYGON_VERTEX_LIMIT,
    VERTEX_LIMIT,
    distances_from_surface,
    limited_hull,
    polygon_sizes,
    within_physx_limits,
)
from asset2sim.baselines.ours import by_rules
from asset2sim.intake.dataset import load_dataset
from asset2sim.physics.arrays import Array
from schemas.asset import AssetRef
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import Export
from tasks.apply import apply_overlay
from tasks.extract import extract_asset
from tasks.progress import AssetJob
from tasks.validate import validate_overlay
from tests.assets import NO_VIEWS, RAW, prior, sample
from tests.builders import ORIGIN, UrdfLink, mesh
from tests.exported import refined
from tests.marks import OBJECTS, needs_objects

pxr = pytest.importorskip("pxr", reason="usd-core is not installed")

with (RAW / "manifest.csv").open(encoding="utf-8", newline="") as stream:
    GOOD_SAMPLES = [row["asset_id"] for row in csv.DictReader(stream) if not row["asset_id"].startswith("planted")]


def ball(count: int, radius: float = 0.1) -> Array:
    """``count`` points on a sphere."""
    points = np.random.default_rng(count).normal(size=(count, 3))
    return np.asarray(radius * points / np.linalg.norm(points, axis=1, keepdims=True))


def prism(sides: int, radius: float = 0.05, height: float = 0.02) -> Array:
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    return np.vstack([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, height)])


def outside(points: Array, hull: ConvexHull) -> float:
    return float((points @ hull.equations[:, :3].T + hull.equations[:, 3]).max())


def test_polygons_are_counted_as_physx_counts_them() -> None:
    assert sorted(polygon_sizes(ConvexHull(prism(4)))) == [4] * 6
    assert sorted(polygon_sizes(ConvexHull(prism(20)))) == [4] * 20 + [20] * 2
    assert within_physx_limits(ConvexHull(prism(32))) and not within_physx_limits(ConvexHull(prism(33)))
    # 40 vertices, and 76 triangles.
    assert len(polygon_sizes(ConvexHull(ball(40)))) == 76 and not within_physx_limits(ConvexHull(ball(40)))


@pytest.mark.parametrize("points", [prism(4), prism(32), ball(30)], ids=["box", "disc", "ball"])
def test_a_hull_that_fits_stays_as_it_is(points: Array) -> None:
    assert limited_hull(points) is None


def test_points_inside_a_hull_that_fits_are_left_out_without_an_error() -> None:
    corners = prism(8)
    middle = 0.5 * corners.mean(axis=0) + 0.5 * corners
    found = limited_hull(
        np.vstack([corners, *(0.1 * i * corners.mean(axis=0) + (1 - 0.1 * i) * middle for i in range(6))])
    )
    assert found is not None
    assert len(found.points) == 16 and found.distance_m < 1e-12 and found.volume_ratio == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("points", "most"),
    [(ball(300), 0.08), (ball(40), 0.08), (prism(33), 0.01), (prism(100), 0.01), (ball(200, 1e-4), 0.08)],
    ids=["ball", "few corners, many faces", "one corner too many", "disc", "tenth of a millimetre"],
)  # fmt: skip
def test_a_hull_that_does_not_fit_is_cut_down_inside_itself(points: Array, most: float) -> None:
    found = limited_hull(points)
    assert found is not None
    full, now = ConvexHull(points), ConvexHull(found.points)
    size = float(np.ptp(points, axis=0).max())
    sizes = polygon_sizes(now)
    assert len(found.points) == len(now.vertices) <= VERTEX_LIMIT
    assert len(sizes) <= POLYGON_LIMIT and max(sizes) <= POLYGON_VERTEX_LIMIT
    assert outside(found.points, full) < 1e-9 * size
    assert np.ptp(found.points, axis=0) == pytest.approx(np.ptp(points, axis=0), rel=1e-9)
    assert found.vertices_before == len(full.vertices)
    assert found.volume_ratio == pytest.approx(now.volume / full.volume) and found.volume_ratio > 0.75
    # No plane is farther from the given hull than the surface is, and no corner left out farther than its nearest.
    nearest = np.linalg.norm(points[:, None] - found.points[None], axis=2).min(axis=1).max()
    assert outside(points, now) - 1e-9 * size <= found.distance_m <= min(nearest, most * size)
    solid = trimesh.Trimesh(found.points, found.faces, process=False)
    assert solid.is_watertight and solid.volume == pytest.approx(now.volume)


def test_distances_are_those_from_the_surface() -> None:
    cube = trimesh.creation.box(extents=(2e-4, 2e-4, 2e-4))
    points = np.array([[3e-4, 0.0, 0.0], [2e-4, 2e-4, 0.0], [1e-4, 5e-5, 0.0], [2e-4, 2e-4, 2e-4]])
    wanted = [2e-4, 2e-4 / np.sqrt(2), 0.0, np.sqrt(3) * 1e-4]
    assert distances_from_surface(points, np.asarray(cube.triangles)) == pytest.approx(wanted, abs=1e-12)


def test_flat_points_have_no_hull() -> None:
    flat = np.column_stack([ball(100)[:, :2], np.zeros(100)])
    assert limited_hull(flat) is None


def hulls(folder: Path) -> dict[str, tuple[dict[str, float] | None, Array]]:
    """Path of every collision mesh → what it says of itself, and its points."""
    from pxr import Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.Open(str(folder / "mobility.usda"))
    found = [item for item in stage.Traverse() if item.HasAPI(UsdPhysics.MeshCollisionAPI)]
    assert {UsdPhysics.MeshCollisionAPI(item).GetApproximationAttr().Get() for item in found} <= {"convexHull"}
    return {
        str(item.GetPath()): (
            item.GetCustomDataByKey("asset2sim"),
            np.array(UsdGeom.Mesh(item).GetPointsAttr().Get(), float),
        )
        for item in found
    }


def test_the_file_says_what_was_cut_and_the_mesh_stays(tmp_path: Path) -> None:
    from pxr import Sdf

    trimesh.convex.convex_hull(ball(300)).export(tmp_path / "ball.obj")
    before = (tmp_path / "ball.obj").read_bytes()
    shapes = ((mesh("ball.obj"), (0.0, 0.0, 0.2)), (mesh("ball.obj"), ORIGIN))
    overlay = refined(tmp_path, [UrdfLink("body", shapes=shapes)], [])
    (finding,) = write_exports(tmp_path, overlay, (Export.USD, Export.MJCF), 1.0 / 240.0)
    assert (tmp_path / "ball.obj").read_bytes() == before
    assert read_object(tmp_path, overlay).bodies["body"].shapes[0].points.shape == (300, 3)
    found = hulls(tmp_path)
    assert len(found) == 2
    for said, points in found.values():
        assert said is not None
        assert len(points) <= VERTEX_LIMIT and within_physx_limits(ConvexHull(points))
        assert said["vertices_before"] == 300 and 0.0 < said["distance_m"] < 0.016 and 0.75 < said["volume_ratio"] < 1.0
    summary = Sdf.Layer.FindOrOpen(str(tmp_path / "mobility.usda")).customLayerData["asset2sim"]
    farthest = max(said["distance_m"] for said, _ in found.values() if said is not None)
    assert summary["hulls_limited"] == 2 and summary["largest_distance_m"] == pytest.approx(farthest)
    assert finding.code == "usd_hulls_limited" and finding.value == pytest.approx(farthest)
    assert "2 collision hulls" in finding.message and "mm" in finding.message


def check_export(folder: Path, most: float) -> int:
    """Assert that a refined folder's USD export has hulls within the limits, each at most ``most`` of its size from the
    given one, and drives with the URDF's effort; returns the number of hulls that were cut down."""
    from pxr import Usd, UsdPhysics

    overlay = PhysicsOverlay.model_validate(json.loads((folder / "overlay.json").read_text(encoding="utf-8")))
    findings = write_exports(folder, overlay, (Export.USD,), 1.0 / 240.0)
    cut = 0
    for path, (said, points) in hulls(folder).items():
        assert len(points) <= VERTEX_LIMIT, path
        if said is not None:
            cut += 1
            assert said["distance_m"] <= most * np.ptp(points, axis=0).max(), path
    assert sum(item.code == "usd_hulls_limited" for item in findings) == (cut > 0)
    stage = Usd.Stage.Open(str(folder / "mobility.usda"))
    efforts = {joint.name: joint.effort for joint in read_object(folder, overlay).joints if joint.moves}
    for item in stage.Traverse():
        if item.GetTypeName() in ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint"):
            word = "angular" if item.IsA(UsdPhysics.RevoluteJoint) else "linear"
            force = UsdPhysics.DriveAPI(item, word).GetMaxForceAttr().Get()
            assert np.isfinite(force) and force == pytest.approx(efforts.pop(item.GetDisplayName()), rel=1e-6)
    assert not efforts
    return cut


def exported(ref: AssetRef, out: Path) -> Path:
    """A dataset's object in its refined folder, before an engine sees it."""
    job = AssetJob(ref, out, NO_VIEWS, prior)
    extracted = extract_asset(job, correct_joints=True)
    job, extraction = replace(job, guidance=extracted.guidance), extracted.extraction
    proposal, _, _ = by_rules(job, extraction)
    assert proposal is not None
    overlay = validate_overlay(job, extraction, proposal, rules=True).overlay
    apply_overlay(job, extraction, proposal, overlay, out, rules=True)
    (out / "overlay.json").write_text(overlay.model_dump_json(), encoding="utf-8")
    return out


@pytest.mark.system
@pytest.mark.parametrize("asset_id", GOOD_SAMPLES)
def test_every_sample_is_within_the_limits(asset_id: str, tmp_path: Path) -> None:
    check_export(exported(sample(asset_id), tmp_path), 0.05)


@pytest.mark.system
@needs_objects
@pytest.mark.parametrize("asset_id", ["179", "3398"])
def test_real_objects_with_round_parts_are_within_the_limits(asset_id: str, tmp_path: Path) -> None:
    (asset,) = (item for item in load_dataset(OBJECTS, None, (asset_id,), None))
    assert check_export(exported(asset, tmp_path), 0.1) > 0
