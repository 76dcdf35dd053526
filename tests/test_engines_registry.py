"""Which engines are there, what a missing one says, and what each refuses."""

import subprocess
import sys
from pathlib import Path

import pytest

from asset2sim.assets.meshes.load import load_mesh, mesh_points
from asset2sim.assets.meshes.obj_file import read_obj
from asset2sim.engines import registry
from asset2sim.engines.registry import engine_version, installed, open_world, require
from schemas.errors import AssetError, UsageError
from schemas.vocabulary import Engine
from tests.assets import box_obj
from tests.builders import ORIGIN, UrdfLink, block_urdf, box, mesh, write_urdf
from tests.engine_worlds import every_engine, on_plane


def test_pybullet_is_always_there() -> None:
    assert Engine.PYBULLET in installed()
    assert engine_version(Engine.PYBULLET) == "3.2.7"


def test_an_engine_that_is_not_installed_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "find_spec", lambda name: name == "pybullet" or None)
    assert installed() == (Engine.PYBULLET,)
    require(Engine.PYBULLET)
    with pytest.raises(UsageError, match=r"'mujoco' is not installed \(installed: pybullet\).*\[bullet,engines\]"):
        open_world(Engine.MUJOCO, block_urdf(tmp_path), plane=True, timestep_s=0.01, contact_friction=0.5)


@pytest.mark.system
def test_looking_which_engines_are_there_imports_none() -> None:
    code = (
        "import sys; from asset2sim.engines.registry import installed; installed();"
        "print(sorted({'mujoco', 'sapien', 'pybullet'} & set(sys.modules)))"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=300)
    assert said.stdout.strip() == "[]"


@pytest.mark.system
@every_engine
def test_an_engine_is_quiet(tmp_path: Path, engine: Engine) -> None:
    code = (
        "import sys; from pathlib import Path; from asset2sim.engines.registry import open_world, Engine\n"
        "with open_world(Engine(sys.argv[1]), Path(sys.argv[2]), plane=True, timestep_s=0.004, contact_friction=0.5) "
        "as world:\n    world.step(); world.contacts(); print(len(world.console))"
    )
    command = [sys.executable, "-W", "error::UserWarning", "-c", code, engine.value, str(block_urdf(tmp_path))]
    said = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    # PyBullet prints its build time and its arguments whoever asks.
    noise = ("pybullet build time", "argv[0]")
    lines = [line for line in (said.stdout + said.stderr).splitlines() if line and not line.startswith(noise)]
    assert lines == ["0"]


@pytest.mark.system
@every_engine
def test_a_link_without_mass_is_refused_where_the_engine_would_make_one_up(tmp_path: Path, engine: Engine) -> None:
    text = f'<robot name="r"><link name="a"><collision><geometry>{box(1, 1, 1)}</geometry></collision></link></robot>'
    (tmp_path / "object.urdf").write_text(text, encoding="utf-8")
    if engine is Engine.PYBULLET:
        pytest.skip("PyBullet gives it 1 kg, and a line on the console")
    with pytest.raises(AssetError, match=r"object\.urdf"), on_plane(engine, tmp_path / "object.urdf"):
        pass


@pytest.mark.system
@every_engine
def test_a_missing_mesh_is_refused_or_left_out_with_a_word(tmp_path: Path, engine: Engine) -> None:
    shapes = ((mesh("gone.obj"), ORIGIN), (box(0.1, 0.1, 0.1), ORIGIN))
    urdf = write_urdf(tmp_path, [UrdfLink("part", shapes=shapes)])
    if engine is Engine.SAPIEN:
        with on_plane(engine, urdf) as world:
            assert world.console == ("link 'part': a collision shape is left out (gone.obj is missing)",)
    else:
        with pytest.raises(AssetError, match=r"refuses object\.urdf"), on_plane(engine, urdf):
            pass


@pytest.mark.system
@every_engine
def test_a_file_that_is_no_urdf_is_refused(tmp_path: Path, engine: Engine) -> None:
    (tmp_path / "object.urdf").write_text("<robot><link", encoding="utf-8")
    with pytest.raises(AssetError, match=r"object\.urdf"), on_plane(engine, tmp_path / "object.urdf"):
        pass


def test_the_points_of_an_obj_are_those_that_its_faces_use(tmp_path: Path) -> None:
    text = "# a box\nv 9 9 9\nvn 0 0 1\n" + "".join(
        " ".join([line.split()[0], *(f"{int(word) + 1}//1" for word in line.split()[1:])]) + "\n"
        if line.startswith("f")
        else line + "\n"
        for line in box_obj((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)).splitlines()
    )
    known = read_obj(text.encode())
    assert known is not None and known.points.shape == (8, 3)
    points = known.points
    assert points.min() == 0.0 and points.max() == 3.0


@pytest.mark.parametrize("text", ["", "v 0 0 0\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n", "v a b c\nf 1 2 3\n"])
def test_an_unusual_obj_goes_the_long_way(text: str) -> None:
    assert read_obj(text.encode()) is None


def test_an_obj_that_is_written_anew_has_its_new_points(tmp_path: Path) -> None:
    file = tmp_path / "box.obj"
    for size in (1.0, 2.0, 1.0):
        file.write_text(box_obj((0.0, 0.0, 0.0), (size, size, size)), encoding="utf-8")
        points = mesh_points(file)
        assert points.max() == size and not points.flags.writeable and mesh_points(file) is points


def test_both_ways_find_the_same_points(tmp_path: Path) -> None:
    file = tmp_path / "box.obj"
    file.write_text(box_obj((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)), encoding="utf-8")
    assert sorted(map(tuple, mesh_points(file))) == sorted(map(tuple, load_mesh(file).vertices))
