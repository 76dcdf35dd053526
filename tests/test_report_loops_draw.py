"""Nothing that is seen is left out, links are where the joints have them, and sizes are true to the pixel."""

import io
import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from asset2sim.physics.kinematics import link_to_root, tree_of
from asset2sim.render import first_hits
from asset2sim.render.camera import FILM_FOV, Camera, fitted_camera
from asset2sim.render.draw import background, pictures
from asset2sim.render.sight import seen
from asset2sim.report.loops.figure import LoopFigure, link_poses, read_alike, read_figure, sweep, swept
from asset2sim.report.loops.make import SWEEP_FRAMES
from asset2sim.report.loops.record import LoopMotion
from asset2sim.report.loops.stills import (
    BOTTOM,
    HEIGHT,
    TOP,
    axes_picture,
    axis_lines,
    cube,
    length_text,
    size_picture,
    standing_item,
)
from tests.assets import cabinet, joint, link, read, robot, shape, written

BOX = robot(link("box", shape("0.4 0.5 0.6")))


def still() -> LoopMotion:
    return LoopMotion(np.eye(4)[None], {})


def camera_for(figure: LoopFigure, motions: np.ndarray, side: int) -> Camera:
    return fitted_camera(figure.spanned(motions), np.array([0.5, 0.4, 0.77]), FILM_FOV, side, side)


@pytest.mark.parametrize("way", ["embree", "numpy"])
def test_no_pixel_of_a_surface_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str) -> None:
    if way == "numpy":
        monkeypatch.setattr(first_hits, "EmbreeScene", None)
    figure = read_figure(written(tmp_path, BOX) / "mobility.urdf", {}, {})
    motions = figure.normalised(figure.placed(still()), floor=True)
    drawn = seen([(figure.faces, motions[0])], camera_for(figure, motions, 200)).opacity.reshape(200, 200) > 0.0
    assert drawn.mean() > 0.3
    rows = [np.flatnonzero(row) for row in drawn if row.any()]
    assert all(len(row) == row[-1] - row[0] + 1 for row in rows), "a box is convex"


def test_links_are_where_the_joints_have_them(tmp_path: Path) -> None:
    extraction = read(written(tmp_path, cabinet()))
    tree, start = tree_of(extraction.features.joints), {"lid_hinge": 0.3, "drawer_slide": 0.1}
    figure = read_figure(extraction.urdf, start, {})
    played = sweep(figure, start, ("lid_hinge", "drawer_slide", "knob_turn"), 24, 10)
    ends = {"lid_hinge": (0.0, 1.0), "drawer_slide": (0.0, 0.4), "knob_turn": (-math.pi, math.pi)}
    for name, path in played.joints.items():
        assert (path.min(), path.max()) == pytest.approx(ends[name])
    poses = link_poses(figure.tree, figure.root, played.joints, 24)
    for frame in range(24):
        positions = {name: float(path[frame]) for name, path in played.joints.items()}
        for name, pose in link_to_root(tree, "body", positions).items():
            assert np.allclose(poses[name][frame], pose)
    assert all(path[0] == path[-1] == start.get(name, 0.0) for name, path in played.joints.items())
    assert np.flatnonzero(played.joints["lid_hinge"] != 0.3)[0] < np.flatnonzero(played.joints["knob_turn"])[0]


def test_the_same_object_at_another_scale_is_drawn_from_the_same_triangles(tmp_path: Path) -> None:
    small = robot(link("a", shape("0.2 0.1 0.1")), link("b", shape("0.1 0.1 0.1")),
                  joint("hinge", "revolute", "a", "b", xyz="0.2 0 0", axis="0 0 1", limit="0 1"))  # fmt: skip
    large = robot(link("a", shape("2 1 1")), link("b", shape("1 1 1")),
                  joint("hinge", "revolute", "a", "b", xyz="2 0 0", axis="0 0 1", limit="0 1"))  # fmt: skip
    other = large.replace("1 1 1", "1 1 1.1")
    figure = read_figure(written(tmp_path / "small", small) / "mobility.urdf", {}, {})
    alike, unlike = (
        read_alike(written(tmp_path / name, urdf) / "mobility.urdf", {"hinge": 0.5}, {}, figure, 0.1)
        for name, urdf in (("large", large), ("other", other))
    )
    assert alike.faces is figure.faces and unlike.faces is not figure.faces
    ends = alike.spanned(alike.placed(still()))
    assert np.ptp(ends, axis=0) == pytest.approx([3.5, 1.0, 1.0]), "drawn in its own metres"
    assert alike.size_m == pytest.approx(unlike.size_m, rel=0.1)


def orange(picture: bytes) -> np.ndarray:
    """The rows and columns that the cube takes, from and to, pixels."""
    rgb = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB"), dtype=int)
    rows, columns = np.nonzero(rgb[..., 0] > rgb[..., 2] + 60)
    return np.array([np.ptp(rows) + 1, np.ptp(columns) + 1])


def test_the_cube_of_the_size_picture_is_as_large_as_it_must_be(tmp_path: Path) -> None:
    figure = read_figure(written(tmp_path, BOX) / "mobility.urdf", {}, {})
    items = [standing_item(figure, still(), "refined"), cube()]
    found = orange(size_picture(items))
    # Seen from 35° beside its front and 30° above, its height alone decides the scale: see view_directions.
    sine, cosine, up, level = math.sin(math.radians(35)), math.cos(math.radians(35)), math.cos(math.pi / 6), 0.5
    height = 0.6 * up + (0.4 * cosine + 0.5 * sine) * level
    scale = (HEIGHT - TOP - BOTTOM) / height
    cube_m = 0.1 * up + 0.1 * (cosine + sine) * level, 0.1 * (cosine + sine)
    assert found == pytest.approx(scale * np.array(cube_m), abs=2.5)
    assert items[0].words == ("refined", "60 cm")


def test_lengths_in_words() -> None:
    lengths = (0.004, 0.0098, 0.23, 0.994, 1.736, 170.4)
    assert [length_text(length) for length in lengths] == ["4 mm", "0.98 cm", "23 cm", "99 cm", "1.74 m", "170 m"]


def test_a_link_that_turns_changes_the_picture_and_one_at_rest_does_not(tmp_path: Path) -> None:
    figure: LoopFigure = read_figure(written(tmp_path, cabinet()) / "mobility.urdf", {}, {})
    turn = np.array([0.0, 0.0, 0.8])
    placed = figure.placed(LoopMotion(np.tile(np.eye(4), (3, 1, 1)), {"lid_hinge": turn}))
    motions = figure.normalised(placed, floor=True)
    camera = fitted_camera(figure.spanned(motions), np.array([0.6, -0.5, 0.62]), FILM_FOV, 96, 96)
    drawn: list[tuple[np.ndarray, np.ndarray]] = []
    first, second, third = pictures(figure.faces, motions, camera, drawn)
    assert first is second and np.abs(third.astype(int) - first).max() > 30
    again = list(pictures(figure.faces, motions[[2, 0]], camera, drawn))
    assert again[0] is third and again[1] is first and len(drawn) == 2, "what the other object has drawn"


def test_an_object_all_of_glass_is_drawn_with_its_shadow(tmp_path: Path) -> None:
    pane = BOX.replace("</visual>", '<material name="glass"><color rgba="0.5 0.7 0.9 0.3"/></material></visual>')
    figure = read_figure(written(tmp_path, pane) / "mobility.urdf", {}, {})
    motions = figure.normalised(figure.placed(still()), floor=True)
    camera = camera_for(figure, motions, 120)
    (picture,) = pictures(figure.faces, motions, camera, [])
    assert (picture != background(camera, disc=True)).any(axis=2).mean() > 0.3


def test_the_joints_of_an_object_are_drawn_where_they_are(tmp_path: Path) -> None:
    extraction, view = read(written(tmp_path, cabinet())), tmp_path / "perspective.png"
    figure = read_figure(extraction.urdf, {"lid_hinge": 0.5}, {})
    Image.new("RGB", (320, 320), "grey").save(view)
    for moved in figure.tree:
        axis = figure.links_to_root[moved.child][:3, :3] @ moved.axis
        line, *arrow = axis_lines(moved, figure)
        assert (line[1] - line[0]) / np.linalg.norm(line[1] - line[0]) == pytest.approx(axis)
        if moved.type != "prismatic":
            origin, turn = figure.links_to_root[moved.child][:3, 3], arrow[0]
            assert np.cross(line - origin, axis) == pytest.approx(0.0, abs=1e-9)
            middle = origin + np.outer((turn - origin) @ axis, axis)
            assert (np.cross((turn - middle)[:-1], (turn - middle)[1:]) @ axis > 0.0).all(), "by the right hand"
    content = axes_picture(figure, view)
    assert content is not None and axes_picture(figure, tmp_path / "none.png") is None
    rgb = np.asarray(Image.open(io.BytesIO(content)).convert("RGB"), dtype=int)
    assert rgb.shape == (480, 480, 3) and (np.ptp(rgb, axis=2) > 90).sum() > 500, "arrows in colours"


def test_a_joint_comes_back_the_way_it_went() -> None:
    for start, ends in ((0.0, (0.0, 1.0)), (0.3, (0.0, 1.0)), (1.0, (-1.0, 1.0)), (0.0, (0.0, 0.0))):
        path = swept(start, *ends, SWEEP_FRAMES)
        assert (path.min(), path.max()) == pytest.approx(ends) and path[0] == path[-1] == start
        assert len(np.unique(path)) <= (SWEEP_FRAMES + 1) // 2, "which halves what is drawn"
