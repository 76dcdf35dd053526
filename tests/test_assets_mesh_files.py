"""Mesh files brought into a folder of their own: copied or converted, with what they look like, and nothing else."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from asset2sim.assets.meshes.load import load_mesh
from asset2sim.assets.urdf.mesh_files import copy_meshes, libraries_of
from tests.assets import box_obj, fingerprint, laid_out, near

LOW, HIGH = (0.0, 0.0, 0.0), (1.0, 2.0, 3.0)
PNG = b"\x89PNG\r\n\x1a\n picture"
Files = dict[str, str | bytes]


def brought(references: dict[str, Path | None], source: Path, target: Path) -> tuple[dict[str, str], set[str]]:
    target.mkdir(parents=True)
    before = fingerprint(source)
    places = copy_meshes(references, source, target)
    assert fingerprint(source) == before
    return places, set(fingerprint(target))


def test_an_obj_brings_its_materials_and_textures(tmp_path: Path) -> None:
    source = laid_out(
        tmp_path / "in",
        {
            "objs/a.obj": box_obj(LOW, HIGH, "mtllib a.mtl\nusemtl m\n"),
            "objs/a.mtl": "newmtl m\nKd 1 0 0\nmap_Kd ../images/wood.png\nbump -bm 0.5 ../images/bump 1.png\n",
            "images/wood.png": PNG,
            "images/unused.png": PNG,
        },
    )
    places, files = brought({"objs/a.obj": source / "objs/a.obj"}, source, tmp_path / "out")
    assert places == {"objs/a.obj": "objs/a.obj"}
    assert files == {"objs/a.obj", "objs/a.mtl", "images/wood.png"}
    assert fingerprint(tmp_path / "out").items() <= fingerprint(source).items(), "the bytes are the same"


@pytest.mark.parametrize(
    ("head", "material", "beside"),
    [
        ("mtllib a.mtl\n", "map_Kd my wood.png\nmap_Bump -bm 0.5 bump.png\n", ("my wood.png", "bump.png")),
        ("mtllib gone.mtl\nmtllib a.mtl\n", "map_Kd gone.png\n", ()),
    ],
    ids=["a space and options", "missing"],
)
def test_textures_that_are_there_come_along(tmp_path: Path, head: str, material: str, beside: tuple[str, ...]) -> None:
    files: Files = {"a.obj": box_obj(LOW, HIGH, head), "a.mtl": f"newmtl m\n{material}"}
    source = laid_out(tmp_path / "in", files | dict.fromkeys(beside, PNG))
    _, found = brought({"a.obj": source / "a.obj"}, source, tmp_path / "out")
    assert found == {"a.obj", "a.mtl", *beside}


@pytest.mark.parametrize("place", ["../../secret", "{outside}/secret"])
@pytest.mark.parametrize("kind", ["mtl", "png"])
def test_a_library_or_a_texture_outside_is_left_there(tmp_path: Path, place: str, kind: str) -> None:
    outside = laid_out(tmp_path / "outside", {"secret.mtl": "newmtl m\nmap_Kd secret.png\n", "secret.png": PNG})
    laid_out(tmp_path, {"secret.mtl": "newmtl m\n", "secret.png": PNG})
    named = f"{place.format(outside=outside)}.{kind}"
    files = {"objs/a.obj": box_obj(LOW, HIGH, f"mtllib {named if kind == 'mtl' else 'a.mtl'}\n")}
    files |= {"objs/a.mtl": f"newmtl m\nmap_Kd {named}\n"} if kind == "png" else {}
    source = laid_out(tmp_path / "in", files)
    before = fingerprint(tmp_path)
    # The target lies deeper than the source, so that a path followed upwards would make a file that is new.
    places, _ = brought({"objs/a.obj": source / "objs/a.obj"}, source, tmp_path / "far" / "away" / "out")
    assert places == {"objs/a.obj": "objs/a.obj"}
    now = fingerprint(tmp_path)
    assert {name: now[name] for name in before} == before
    assert set(now) - set(before) == {f"far/away/out/{name}" for name in files}


def test_a_library_is_named_at_the_beginning_of_a_line(tmp_path: Path) -> None:
    text = "# mtllib b.mtl\no my mtllib c.mtl\n \t mtllib  a b.mtl \r\nmtllib\nmtllib d.mtl"
    names = ("a b.mtl", "b.mtl", "c.mtl", "d.mtl")
    source = laid_out(tmp_path / "in", {"a.obj": text, **dict.fromkeys(names, "newmtl m\n")})
    assert libraries_of(source / "a.obj") == ["a b.mtl", "d.mtl"]


def test_stl_is_copied(tmp_path: Path) -> None:
    source = laid_out(tmp_path / "in", {})
    source.mkdir()
    trimesh.creation.box((1, 2, 3)).export(source / "a.STL", file_type="stl")
    places, files = brought({"package://x/a.STL": source / "a.STL"}, source, tmp_path / "out")
    assert places == {"package://x/a.STL": "a.STL"} and files == {"a.STL"}
    assert fingerprint(tmp_path / "out") == fingerprint(source)


@pytest.mark.parametrize("kind", ["dae", "glb"])
def test_collada_and_gltf_become_obj_with_their_colour(tmp_path: Path, kind: str) -> None:
    box = trimesh.creation.box((1, 2, 3))
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=(255, 0, 0, 255), name="red")
    box.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(box.vertices), 2)), material=material)
    box.apply_translation((0, 0, 5))
    source = laid_out(tmp_path / "in", {})
    (source / "meshes").mkdir(parents=True)
    box.export(source / "meshes" / f"a.{kind}")
    reference = f"meshes/a.{kind}"
    places, files = brought({reference: source / reference}, source, tmp_path / "out")
    assert places == {reference: f"meshes/a_{kind}/a.obj"} and f"meshes/a.{kind}" not in files
    before, after = load_mesh(source / reference), load_mesh(tmp_path / "out" / places[reference])
    assert near(after.bounds, before.bounds, 1e-6) and near(after.volume, 6.0, 1e-6)
    colours = [line for name in files if name.endswith(".mtl") for line in read_lines(tmp_path / "out" / name)]
    reds = [line.split()[1:] for line in colours if line.startswith("Kd")]
    assert reds and near([float(word) for word in reds[0]], (1.0, 0.0, 0.0), 0.01)


def test_a_collada_file_of_two_colours_is_not_darkened(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for place, color in ((0.0, (255, 250, 247, 255)), (5.0, (220, 220, 220, 255))):
        box = trimesh.creation.box((1, 1, 1))
        material = trimesh.visual.material.PBRMaterial(baseColorFactor=color)
        box.visual = trimesh.visual.TextureVisuals(uv=np.zeros((len(box.vertices), 2)), material=material)
        scene.add_geometry(box.apply_translation((place, 0, 0)))
    source = laid_out(tmp_path / "in", {})
    source.mkdir(exist_ok=True)
    (source / "a.dae").write_bytes(trimesh.exchange.dae.export_collada(list(scene.geometry.values())))
    places, _ = brought({"a.dae": source / "a.dae"}, source, tmp_path / "out")
    library = (tmp_path / "out" / places["a.dae"]).with_suffix(".mtl").read_text()
    assert "map_Kd" in library and "Kd 1.0" in library


def read_lines(path: Path) -> list[str]:
    return path.read_text().splitlines()


def test_files_outside_the_asset_get_names_of_their_own(tmp_path: Path) -> None:
    source = laid_out(tmp_path / "robot" / "urdf", {"readme": "x"})
    package = laid_out(
        tmp_path / "robot" / "meshes", {"left/a.obj": box_obj(LOW, HIGH), "right/a.obj": box_obj(LOW, (2.0, 2.0, 2.0))}
    )
    references: dict[str, Path | None] = {
        "package://robot/meshes/left/a.obj": package / "left/a.obj",
        "package://robot/meshes/right/a.obj": package / "right/a.obj",
        "model://robot/meshes/left/a.obj": package / "left/a.obj",
        "package://robot/meshes/gone.obj": None,
    }
    places, files = brought(references, source, tmp_path / "out")
    left, right, same = list(places.values())
    assert len(places) == 3 and left == same and left != right and files == {left, right}
    assert (tmp_path / "out" / left).read_bytes() == (package / "left/a.obj").read_bytes()
    assert (tmp_path / "out" / right).read_bytes() == (package / "right/a.obj").read_bytes()
    assert all(not place.startswith(("/", "..")) and "\\" not in place for place in files)


def test_an_stl_in_text_is_written_in_binary(tmp_path: Path) -> None:
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    named = b"solid" + trimesh.exchange.stl.export_stl(box)[5:]
    text = trimesh.exchange.stl.export_stl_ascii(box)
    source = laid_out(tmp_path / "in", {"meshes/text.stl": text, "binary.stl": named})
    wanted = {name: source / name for name in ("meshes/text.stl", "binary.stl")}
    places, _ = brought(dict(wanted), source, tmp_path / "out")
    assert places == {name: name for name in wanted}
    written = (tmp_path / "out/meshes/text.stl").read_bytes()
    assert len(written) == 84 + 50 * len(box.faces), "PyBullet shows nothing of text, and MuJoCo refuses it"
    assert np.allclose(load_mesh(tmp_path / "out/meshes/text.stl").bounds, box.bounds)
    assert (tmp_path / "out/binary.stl").read_bytes() == named, "a header may begin with 'solid'"
