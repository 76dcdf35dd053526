"""The five canonical views, on small assets made for the purpose and on real ones where they are at hand."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from asset2sim.assets.surfaces.scene import load_scene
from asset2sim.render import VIEW_NAMES, first_hits, render_views, write_views
from asset2sim.render.faces import faces_of
from schemas.errors import AssetError
from schemas.settings import ViewSettings
from schemas.vocabulary import FailureMode
from tests.assets import SHARED

pytestmark = pytest.mark.system


@pytest.fixture(params=["embree", "numpy"], autouse=True)
def drawn_by(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both ways must pass: NumPy looks for what is seen where Embree is not installed."""
    if request.param == "numpy":
        monkeypatch.setattr(first_hits, "EmbreeScene", None)


SMALL = ViewSettings(width=64, height=64)
SIDES = {
    "red": ((1, 0, 0), (1, 0, 0)),
    "blue": ((-1, 0, 0), (0, 0, 1)),
    "green": ((0, 1, 0), (0, 0.8, 0)),
    "yellow": ((0, -1, 0), (0.9, 0.9, 0)),
    "white": ((0, 0, 1), (1, 1, 1)),
    "purple": ((0, 0, -1), (0.6, 0, 0.6)),
}


def write_urdf(folder: Path, body: str, name: str = "thing", file: str = "model.urdf") -> Path:
    path = folder / file
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<robot name="{name}">{body}</robot>')
    return path


def visual(mesh: str, extra: str = "") -> str:
    return f'<visual><geometry><mesh filename="{mesh}"/></geometry>{extra}</visual>'


def shown(folder: Path, inside: str, *views: str) -> dict[str, Image.Image]:
    """These views, or all, of one link with these visuals; a view alone is the same picture, as a test shows."""
    return render_views(write_urdf(folder, f'<link name="a">{inside}</link>'), {}, SMALL, views or VIEW_NAMES)


def front(folder: Path, *meshes: str) -> Image.Image:
    """The front of one link of these meshes."""
    return shown(folder, "".join(map(visual, meshes)), "front")["front"]


def assert_upper_red_lower_blue(image: Image.Image) -> None:
    pixels = array(image)
    assert hue(pixels[20, 32]) == "red" and hue(pixels[44, 32]) == "blue"


def write_painted_box(folder: Path, size: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> None:
    """box.obj and box.mtl: a side of its own colour in each direction, wound outwards, without normals."""
    lines, materials, count = ["mtllib box.mtl"], [], 0
    for name, (direction, color) in SIDES.items():
        normal = np.array(direction, dtype=float)
        across = np.roll(normal, 1)
        corners = [normal + a * across + b * np.cross(normal, across) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        lines += [f"usemtl {name}", *("v {} {} {}".format(*(0.5 * c * np.array(size))) for c in corners)]
        lines.append(f"f {count + 1} {count + 2} {count + 3} {count + 4}")
        materials.append("newmtl {}\nKd {} {} {}".format(name, *color))
        count += 4
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "box.obj").write_text("\n".join(lines) + "\n")
    (folder / "box.mtl").write_text("\n".join(materials) + "\n")


def write_sheet(folder: Path, materials: str, faces: str, name: str = "sheet", x: float = 0.0) -> None:
    """A unit square in the plane of y and z at ``x`` with texture coordinates; ``faces`` uses corners 1 to 4."""
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    text = [
        f"mtllib {name}.mtl",
        *(f"v {x} {y} {z}" for y, z in corners),
        *(f"vt {y + 0.5} {z + 0.5}" for y, z in corners),
    ]
    (folder / f"{name}.obj").write_text("\n".join([*text, faces]) + "\n")
    (folder / f"{name}.mtl").write_text(materials)


FRONT = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4"
BACK = "f 3/3 2/2 1/1\nf 4/4 3/3 1/1"


def array(image: Image.Image) -> np.ndarray:
    return np.asarray(image, dtype=float)


def middle(image: Image.Image) -> np.ndarray:
    """(3,) the colour at the centre."""
    pixels = array(image)
    center: np.ndarray = pixels[pixels.shape[0] // 2, pixels.shape[1] // 2]
    return center


def reddish(image: Image.Image) -> np.ndarray:
    """(h, w) where red is well above green and blue."""
    pixels = array(image)
    found: np.ndarray = pixels[..., 0] > 1.5 * pixels[..., 1:].max(axis=2) + 20
    return found


def hue(color: np.ndarray) -> str:
    """The side whose colour is nearest in direction."""
    names = list(SIDES)
    table = np.array([SIDES[name][1] for name in names], dtype=float)
    table /= np.linalg.norm(table, axis=1, keepdims=True)
    return names[int((table @ (color / np.linalg.norm(color))).argmax())]


def test_each_side_shows_in_its_own_view(tmp_path: Path) -> None:
    write_painted_box(tmp_path)
    images = shown(tmp_path, visual("box.obj"))
    assert tuple(images) == VIEW_NAMES
    seen = {name: hue(middle(image)) for name, image in images.items() if name != "perspective"}
    # Whoever stands before an object that faces +x, and looks at it, has -y on the left.
    assert seen == {"front": "red", "back": "blue", "left": "yellow", "right": "green"}
    assert reddish(images["front"]).mean() > 0.6
    assert not reddish(images["back"]).any()


def test_perspective_is_from_the_front_right_and_above(tmp_path: Path) -> None:
    write_painted_box(tmp_path)
    pixels = array(shown(tmp_path, visual("box.obj"), "perspective")["perspective"]).reshape(-1, 3)
    spread = pixels[np.ptp(pixels, axis=1) > 60]
    counts = Counter(hue(color) for color in spread)
    assert {name for name, _ in counts.most_common(2)} == {"red", "green"}
    assert sum(counts.values()) - counts["red"] - counts["green"] < 0.1 * len(spread)  # blends along the edges


def test_partnet_root_joint_turns_the_front(tmp_path: Path) -> None:
    """In PartNet-Mobility objects are y-up and face +z: the side that faces the viewer there is the front here."""
    write_painted_box(tmp_path)
    joint = (
        '<link name="base"/><joint name="j" type="fixed"><origin rpy="1.570796 0 -1.570796" xyz="0 0 0"/>'
        '<parent link="base"/><child link="a"/></joint>'
    )
    images = render_views(write_urdf(tmp_path, f'{joint}<link name="a">{visual("box.obj")}</link>'), {}, SMALL)
    assert hue(middle(images["front"])) == "white"
    assert hue(middle(images["right"])) == "red"


def test_object_fills_most_of_every_view(tmp_path: Path) -> None:
    write_painted_box(tmp_path, (0.2, 0.5, 1.7))
    urdf = write_urdf(tmp_path, f'<link name="a">{visual("box.obj")}</link>')
    images = render_views(urdf, {}, ViewSettings(width=96, height=160))
    empty = array(images["front"])[:, 0, :]
    for name, image in images.items():
        covered = np.abs(array(image) - empty[:, None, :]).max(axis=2) > 5
        rows, columns = np.flatnonzero(covered.any(axis=1)), np.flatnonzero(covered.any(axis=0))
        assert max(np.ptp(rows) / 160, np.ptp(columns) / 96) == pytest.approx(0.85, abs=0.04), name
        assert rows.mean() == pytest.approx(79.5, abs=2.0), name


def test_texture_shows_the_right_way_up(tmp_path: Path) -> None:
    picture = Image.new("RGB", (600, 600), (250, 0, 0))
    picture.paste((0, 0, 250), (0, 300, 600, 600))
    (tmp_path / "images").mkdir()
    picture.save(tmp_path / "images" / "t.png")
    (tmp_path / "objs").mkdir()
    write_sheet(tmp_path / "objs", "newmtl m\nKd 1 1 1\nmap_Kd ../images/t.png\n", f"usemtl m\n{FRONT}")
    assert_upper_red_lower_blue(front(tmp_path, "objs/sheet.obj"))


def test_texture_outside_the_neighbourhood_is_not_read(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b" / "c" / "d"
    folder.mkdir(parents=True)
    Image.new("RGB", (8, 8), (250, 0, 0)).save(tmp_path / "t.png")
    write_sheet(folder, "newmtl m\nKd 0 0.8 0\nmap_Kd ../../../../t.png\n", f"usemtl m\n{FRONT}")
    assert hue(middle(front(folder, "sheet.obj"))) == "green"


def test_transparent_part_of_a_texture_shows_what_is_behind(tmp_path: Path) -> None:
    picture = Image.new("RGBA", (64, 64), (250, 0, 0, 255))
    picture.paste((250, 0, 0, 0), (0, 32, 64, 64))
    picture.save(tmp_path / "t.png")
    write_sheet(tmp_path, "newmtl m\nKd 1 1 1\nmap_Kd t.png\n", f"usemtl m\n{FRONT}", "decal")
    write_sheet(tmp_path, "newmtl m\nKd 0 0 1\n", f"usemtl m\n{FRONT}", "wall", x=-0.05)
    assert_upper_red_lower_blue(front(tmp_path, "wall.obj", "decal.obj"))


def test_broken_or_missing_texture_leaves_the_colour(tmp_path: Path) -> None:
    (tmp_path / "t.png").write_bytes(b"\x89PNG\r\n\x1a\n nothing more")
    for reference in ("t.png", "absent.png"):
        write_sheet(tmp_path, f"newmtl m\nKd 1 0 0\nmap_Kd {reference}\n", f"usemtl m\n{FRONT}")
        assert hue(middle(front(tmp_path, "sheet.obj"))) == "red"


def test_sheet_is_as_light_from_behind(tmp_path: Path) -> None:
    write_sheet(tmp_path, "newmtl m\nKd 0.8 0.2 0.2\n", f"usemtl m\n{FRONT}")
    images = shown(tmp_path, visual("sheet.obj"), "front", "back")
    assert np.allclose(middle(images["front"]), middle(images["back"]), atol=6)
    assert middle(images["back"])[0] > 150


def test_a_view_alone_is_the_same_picture(tmp_path: Path) -> None:
    write_painted_box(tmp_path)
    urdf = write_urdf(tmp_path, f'<link name="a">{visual("box.obj")}</link>')
    alone = render_views(urdf, {}, SMALL, ("perspective",))["perspective"]
    assert np.array_equal(np.asarray(alone), np.asarray(render_views(urdf, {}, SMALL)["perspective"]))


def test_two_faces_back_to_back_keep_their_own_colours(tmp_path: Path) -> None:
    write_sheet(tmp_path, "newmtl r\nKd 1 0 0\nnewmtl b\nKd 0 0 1\n", f"usemtl r\n{FRONT}\nusemtl b\n{BACK}")
    images = shown(tmp_path, visual("sheet.obj"), "front", "back")
    assert hue(middle(images["front"])) == "red"
    assert hue(middle(images["back"])) == "blue"
    assert len(faces_of(load_scene(tmp_path / "model.urdf", {})).corners) == 4


def test_small_decal_in_the_same_plane_is_whole(tmp_path: Path) -> None:
    write_sheet(tmp_path, "newmtl m\nKd 0 0 1\n", f"usemtl m\n{FRONT}", "wall")
    (tmp_path / "decal.mtl").write_text("newmtl m\nKd 1 0 0\n")
    corners = "v 0 -0.21 -0.17\nv 0 0.23 -0.17\nv 0 0.23 0.19\nv 0 -0.21 0.19"
    (tmp_path / "decal.obj").write_text(f"mtllib decal.mtl\nusemtl m\n{corners}\nf 2 3 4\nf 1 2 4\n")
    for order in (("wall.obj", "decal.obj"), ("decal.obj", "wall.obj")):
        urdf = write_urdf(tmp_path, f'<link name="a">{"".join(visual(mesh) for mesh in order)}</link>')
        red = reddish(render_views(urdf, {}, ViewSettings(width=200, height=200), ("front",))["front"])
        rows, columns = np.flatnonzero(red.any(axis=1)), np.flatnonzero(red.any(axis=0))
        assert red.sum() == (np.ptp(rows) + 1) * (np.ptp(columns) + 1)


def test_glass_lets_through_and_what_is_hardly_there_is_not_drawn(tmp_path: Path) -> None:
    write_sheet(tmp_path, "newmtl m\nKd 0 0 1\n", f"usemtl m\n{FRONT}", "wall", x=-0.05)
    seen = {}
    for opacity in (0.05, 0.5, 1.0):
        write_sheet(tmp_path, f"newmtl m\nKd 1 0 0\nd {opacity}\n", f"usemtl m\n{FRONT}", "pane")
        seen[opacity] = middle(front(tmp_path, "wall.obj", "pane.obj"))
    assert hue(seen[0.05]) == "blue"
    assert hue(seen[1.0]) == "red"
    assert np.allclose(seen[0.5], 0.5 * (seen[0.05] + seen[1.0]), atol=4)


def test_glass_that_lies_on_something_is_even(tmp_path: Path) -> None:
    """Glass whose far side is in one plane with a wall, either of which might be met first."""
    write_sheet(tmp_path, "newmtl m\nKd 1 1 1\n", f"usemtl m\n{FRONT}", "wall")
    write_sheet(tmp_path, "newmtl m\nKd 0 0 0\n", f"usemtl m\n{FRONT}", "base", x=-0.1)
    glass = (
        '<visual><origin xyz="-0.05 0 0.03"/><geometry><box size="0.1 0.61 0.57"/></geometry>'
        '<material name="m"><color rgba="0.2 0.3 0.9 0.6"/></material></visual>'
    )
    turned = visual("base.obj") + glass.replace("-0.05 0 0.03", "0.05 0 0.03") + visual("wall.obj")
    pixels = array(shown(tmp_path, turned, "front")["front"])[24:38, 24:40]
    assert np.ptp(pixels, axis=(0, 1)).max() < 12


SLIDER = (
    '<material name="crimson"><color rgba="0.9 0 0 1"/></material>'
    '<link name="a"><visual><geometry><box size="1 1 1"/></geometry>'
    '<material name="grey"><color rgba="0.5 0.5 0.5 1"/></material></visual></link>'
    '<link name="b"><visual><origin xyz="0.5 0 0"/><geometry><cylinder radius="0.1" length="0.3"/></geometry>'
    '<material name="crimson"/></visual></link>'
    '<joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>'
    '<limit lower="-0.4" upper="0.4" effort="1" velocity="1"/></joint>'
)


def test_joint_position_moves_the_part(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path, SLIDER)
    columns = {}
    for position in (-0.35, 0.0, 0.35):
        seen = render_views(urdf, {"slide": position}, SMALL, ("front",))["front"]
        columns[position] = np.nonzero(reddish(seen))[1].mean()
    # +y is on the right in the front view; the frame is 64 px for 1 m / 0.85.
    step = 0.35 * 0.85 * 64
    assert columns[0.0] == pytest.approx(31.5, abs=1.0)
    assert columns[0.35] - columns[0.0] == pytest.approx(step, abs=1.5)
    assert columns[-0.35] - columns[0.0] == pytest.approx(-step, abs=1.5)


def test_the_top_view_has_the_front_at_its_lower_edge(tmp_path: Path) -> None:
    write_painted_box(tmp_path)
    images = shown(tmp_path, visual("box.obj"), "top", "front")
    assert tuple(images) == ("top", "front") and hue(middle(images["top"])) == "white"
    forward = write_urdf(tmp_path, SLIDER.replace('<axis xyz="0 1 0"/>', '<axis xyz="1 0 0"/>'), file="forward.urdf")
    # The part comes out of the box's front, which it leaves behind it in the upper part of the picture.
    rows, columns = np.nonzero(reddish(render_views(forward, {"slide": 0.35}, SMALL, ("top",))["top"]))
    assert rows.min() > 40 and columns.mean() == pytest.approx(31.5, abs=1.0)


def test_mimicking_joint_follows(tmp_path: Path) -> None:
    follower = SLIDER.replace(
        '<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="lead" multiplier="-2" offset="0.1"/>'
    )
    lead = (
        '<link name="c"/><joint name="lead" type="prismatic"><parent link="a"/><child link="c"/><axis xyz="1 0 0"/>'
        '<limit lower="0" upper="1" effort="1" velocity="1"/></joint>'
    )
    urdf = write_urdf(tmp_path, follower + lead)
    columns = np.nonzero(reddish(render_views(urdf, {"lead": 0.2}, SMALL, ("front",))["front"]))[1]
    assert columns.mean() == pytest.approx(31.5 - 0.3 * 0.85 * 64, abs=1.5)


def test_mesh_scale_is_applied_and_a_mirrored_mesh_keeps_its_light(tmp_path: Path) -> None:
    write_painted_box(tmp_path)
    images = shown(tmp_path, visual('box.obj" scale="1 -1 2'), "front", "left")
    red = reddish(images["front"])
    assert red.any(axis=1).sum() == pytest.approx(2 * red.any(axis=0).sum(), abs=2)
    assert middle(images["front"])[0] > 200
    assert hue(middle(images["left"])) == "green"


def test_missing_mesh_is_left_out(tmp_path: Path) -> None:
    write_painted_box(tmp_path)
    assert hue(middle(front(tmp_path, "absent.obj", "box.obj"))) == "red"


def test_nothing_to_draw_names_the_file(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path, f'<link name="a">{visual("absent.obj")}</link>')
    with pytest.raises(AssetError, match=r"model\.urdf") as caught:
        write_views(urdf, {}, tmp_path / "views", SMALL)
    assert caught.value.mode is FailureMode.MISSING_MESH
    assert not (tmp_path / "views").exists()


def test_not_xml_is_refused(tmp_path: Path) -> None:
    (tmp_path / "model.urdf").write_text("solid nonsense")
    with pytest.raises(AssetError) as caught:
        render_views(tmp_path / "model.urdf", {}, SMALL)
    assert caught.value.mode is FailureMode.UNREADABLE_ASSET


def test_collision_shapes_are_drawn_where_there_are_no_visuals(tmp_path: Path) -> None:
    shape = '<link name="a"><collision><geometry><sphere radius="0.3"/></geometry></collision></link>'
    pixels = array(render_views(write_urdf(tmp_path, shape), {}, SMALL, ("front",))["front"])
    assert np.abs(pixels[1, 1] - pixels[32, 32]).max() > 20


@pytest.mark.parametrize(
    ("reference", "file"),
    [
        ("meshes/box.obj", "model.urdf"),
        ("package://a_box/meshes/box.obj", "model.urdf"),
        ("package://a_box/meshes/box.obj", "urdf/model.urdf"),
        ("model://a_box/meshes/box.obj", "model.urdf"),
        ("model://meshes/box.obj", "robots/urdf/model.urdf"),
    ],
)
def test_references_resolve_beside_the_urdf(tmp_path: Path, reference: str, file: str) -> None:
    write_painted_box(tmp_path / "meshes")
    urdf = write_urdf(tmp_path, f'<link name="a">{visual(reference)}</link>', file=file)
    assert hue(middle(render_views(urdf, {}, SMALL, ("front",))["front"])) == "red"


@pytest.mark.parametrize("suffix", ["stl", "glb", "dae", "ply"])
def test_other_mesh_formats(tmp_path: Path, suffix: str) -> None:
    """STL has no colour and takes the URDF's; the others bring their own, which goes before the URDF's."""
    mesh = trimesh.creation.box(extents=(1, 1, 1))
    if suffix in ("glb", "dae"):
        material = trimesh.visual.material.PBRMaterial(baseColorFactor=(0, 0, 255, 255), name="blue")
        mesh.visual = trimesh.visual.TextureVisuals(material=material, uv=np.zeros((8, 2)))
    elif suffix == "ply":
        mesh.visual.face_colors = (0, 0, 255, 255)
    mesh.export(tmp_path / f"box.{suffix}")
    tag = '<material name="m"><color rgba="1 0 0 1"/></material>'
    images = shown(tmp_path, visual(f"box.{suffix}", tag), "front")
    assert hue(middle(images["front"])) == ("red" if suffix == "stl" else "blue")


def test_written_files_are_whole_and_alone(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path, SLIDER)
    for _ in range(2):
        written = write_views(urdf, {"slide": 0.2}, tmp_path / "out" / "views", SMALL)
    assert [path.name for path in written] == [f"{name}.png" for name in VIEW_NAMES]
    assert sorted(path.name for path in (tmp_path / "out" / "views").iterdir()) == sorted(path.name for path in written)
    again = render_views(urdf, {"slide": 0.2}, SMALL)
    for path in written:
        with Image.open(path) as image:
            assert image.size == (64, 64)
            assert np.array_equal(np.asarray(image), np.asarray(again[path.stem]))


def shared_urdf(name: str) -> Path:
    path = SHARED / name
    if not path.is_file():
        pytest.skip("the real objects are not here")
    return path


def test_real_microwave_shows_its_door_in_front() -> None:
    """Its front has keys, frame and window; its back is one black panel."""
    urdf = shared_urdf("partnet_mobility/Microwave/7236/mobility.urdf")
    images = render_views(urdf, {}, ViewSettings(width=96, height=96), ("front", "back"))
    light = {name: (array(images[name])[20:76, 10:86].min(axis=2) > 80).mean() for name in ("front", "back")}
    assert light["front"] > light["back"] + 0.02


def test_real_laptop_shows_its_screen_picture_in_front() -> None:
    urdf = shared_urdf("partnet_mobility/Laptop/9968/mobility.urdf")
    images = render_views(urdf, {}, SMALL)
    assert {image.size for image in images.values()} == {(64, 64)}
    assert np.ptp(array(images["front"])[15:45], axis=2).max() > 40


def test_real_furniture_with_collada_meshes_has_its_colour() -> None:
    urdf = shared_urdf("other_furniture/room73b2-toshiba-clacio-refrigerator/model.urdf")
    color = middle(render_views(urdf, {}, SMALL, ("front",))["front"])
    assert color[1] > color[0] + 20 and color[1] > color[2] + 20
