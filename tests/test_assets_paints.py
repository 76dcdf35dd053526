"""Materials in words: colours, names and shares of the area, from MTL files and from the URDF."""

from pathlib import Path

import pytest
from PIL import Image

from asset2sim.assets.meshes.paints import color_words, dae_paints, part_words
from tests.assets import box_obj, link, mesh, read, robot, shape, written

MTL = "newmtl material_0_0\nKd 0.1 0.1 0.1\nd 1\n\nnewmtl oak\nKd 0.55 0.35 0.15\nmap_Kd images/wood.png\n" \
      "newmtl pane\nKd 0.6 0.8 1\nd 0.3\nKs 0.9 0.9 0.9\n"  # fmt: skip


@pytest.mark.parametrize(
    ("rgb", "words"),
    [
        ((0, 0, 0), "black"), ((1, 1, 1), "white"), ((0.5, 0.5, 0.5), "grey"), ((0.9, 0.1, 0.1), "red"),
        ((0.5, 0.3, 0.1), "brown"), ((0.9, 0.8, 0.65), "beige"), ((0.1, 0.1, 0.4), "dark blue"),
        ((0.7, 0.8, 1.0), "light blue"), ((0.95, 0.85, 0.1), "yellow"), ((0.2, 0.2, 0.2), "dark grey"),
    ],
)  # fmt: skip
def test_colours_have_plain_names(rgb: tuple[float, float, float], words: str) -> None:
    assert color_words(rgb) == words


@pytest.mark.parametrize(
    ("name", "words"),
    [("rotation_lid-part12", "rotation lid"), ('rotation_lid-part["id"]', "rotation lid"), ("handle-3", "handle"),
     ("obj_12", ""), (None, ""), ("glass_pane", "glass pane")],
)  # fmt: skip
def test_a_visual_s_name_is_the_word_for_a_part(name: str | None, words: str) -> None:
    assert part_words(name) == words


def materials(folder: Path, content: str, faces: str, more: str = "") -> tuple[str, ...]:
    box = box_obj((0, 0, 0), (1, 1, 1)).split("\nf ")[0]
    Image.new("RGB", (4, 4), (120, 80, 40)).save(folder / "wood.png")
    files = {"box.obj": f"mtllib box.mtl\n{box}\n{faces}\n", "box.mtl": content}
    body = mesh("box.obj").replace("<visual>", '<visual name="board-1">') + more
    (folder / "images").mkdir()
    (folder / "wood.png").rename(folder / "images" / "wood.png")
    return read(written(folder, robot(link("body", body)), files)).features.link("body").materials


SIX = [f"f {i} {j} {k}" for i, j, k in ((1, 2, 3), (1, 3, 4), (5, 7, 6), (5, 8, 7), (1, 5, 6), (1, 6, 2))]
REST = [f"f {i} {j} {k}" for i, j, k in ((4, 3, 7), (4, 7, 8), (1, 4, 8), (1, 8, 5), (2, 6, 7), (2, 7, 3))]


def test_an_mtl_says_what_covers_a_link(tmp_path: Path) -> None:
    faces = "\n".join(["usemtl oak", *SIX, *REST[:3], "usemtl material_0_0", *REST[3:]])
    assert materials(tmp_path, MTL, faces) == ("board: brown picture (oak), 75 %", "board: black, 25 %")


def test_glass_is_see_through(tmp_path: Path) -> None:
    assert materials(tmp_path, MTL, "\n".join(["usemtl pane", *SIX, *REST])) == (
        "board: light blue, see-through 70 %, shiny (pane)",
    )


def test_what_an_mtl_does_not_say_is_left_out(tmp_path: Path) -> None:
    faces = "\n".join(["usemtl nowhere", *SIX, *REST])
    assert materials(tmp_path, "newmtl a\nKd one two three\nd\nTr nan\n", faces) == ("board",)


def test_a_urdf_s_colour_counts_where_there_is_no_mtl(tmp_path: Path) -> None:
    painted = shape("1 1 1", "visual").replace(
        "</visual>", '<material name="Chrome"><color rgba="0.8 0.8 0.8 1"/></material></visual>'
    )
    found = read(written(tmp_path, robot(link("body", painted)))).features.link("body").materials
    assert found == ("light grey (Chrome)",)


DAE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<library_effects><effect id="oak-fx"><profile_COMMON><technique sid="common"><lambert><diffuse>
<color sid="diffuse">0.4 0.2 0.1 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="oak-material" name="oak"><instance_effect url="#oak-fx"/></material>
<material id="chrome"><instance_effect url="#gone"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><triangles material="slot" count="30"/>
<polylist material="chrome" count="10"/>
<triangles material="nothing" count="5"/></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="slot" target="#oak-material"/></technique_common></bind_material></instance_geometry></node>
</visual_scene></library_visual_scenes></COLLADA>"""


def test_a_collada_file_says_what_covers_it(tmp_path: Path) -> None:
    (tmp_path / "door.dae").write_text(DAE, encoding="utf-8")
    found = {paint.words(): share for paint, share in dae_paints(tmp_path / "door.dae").items()}
    assert found == {"brown (oak)": 0.75, "light grey (chrome)": 0.25}
    (tmp_path / "door.dae").write_text("no XML", encoding="utf-8")
    assert dae_paints(tmp_path / "door.dae") == dae_paints(tmp_path / "gone.dae") == {}
