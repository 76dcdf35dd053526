"""Packs for other tools: each is opened by its consumer where that is installed, else by what reads its format."""

import importlib.util
import json
import os
import re
import subprocess
import sys
import textwrap
from collections.abc import Mapping
from functools import partial
from io import BytesIO
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import yaml
from lxml import etree
from PIL import Image

from asset2sim.assets.checksums import changed_files
from asset2sim.catalog.write import write_run
from asset2sim.intake.origin import extract
from asset2sim.load import load
from asset2sim.packs.declared_pack import PackedObject, find_pack, known_packs
from asset2sim.packs.write import python_names, verdicts, write_pack
from flows.command import main
from schemas.asset import AssetRef
from schemas.errors import UnknownChoiceError, UsageError
from schemas.settings import EngineSettings, Settings, ViewSettings
from schemas.support import SupportKind
from schemas.vocabulary import Engine
from tasks.pipeline import refine_asset
from tests.assets import ROOT, prior, sample
from tests.consumers import python_with, served_as_hub
from tests.factories import make_run

FREE, FIXED = "laptop_silver", "storage_sideboard"
"""A freestanding object and one that is fixed to a wall."""
LICENCE = "cc-by-4.0"
pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run's folder with both objects, verified in one engine."""
    place = tmp_path_factory.mktemp("run")
    settings = Settings(engine=EngineSettings(verify=(Engine.PYBULLET,)), views=ViewSettings(width=64, height=64))
    still = settings.engine.model_copy(update={"interact": False})
    fixed = settings.model_copy(update={"support": SupportKind.FIXED, "engine": still})
    records = [refine_asset(sample(FREE), place, settings, prior), refine_asset(sample(FIXED), place, fixed, prior)]
    write_run(place, make_run(settings=settings), records)
    return place


@pytest.fixture(scope="module")
def packs(out: Path, tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, tuple[Path, dict[str, PackedObject]]]:
    """Every pack, and its objects by their names."""
    place = tmp_path_factory.mktemp("packs")
    found = {}
    for name, pack in known_packs().items():
        packed = write_pack(out, place / name, pack, licence=LICENCE)
        found[name] = place / name, {item.name: item for item in packed}
    return found


Packs = Mapping[str, tuple[Path, dict[str, PackedObject]]]


def in_package(folder: Path, package: str, fname: str) -> str:
    """The file that a ``package://`` URI means."""
    return str(folder / fname.removeprefix(f"package://{package}/"))


def module_of(path: Path) -> ModuleType:
    """A pack's module, imported from its file."""
    spec = importlib.util.spec_from_file_location(f"pack_{path.parent.name}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_object_of_every_pack_has_its_papers(packs: Packs) -> None:
    assert set(packs) == {"mujoco", "gazebo", "ros2", "isaaclab", "robosuite", "maniskill", "huggingface", "lerobot"}
    for folder, objects in packs.values():
        assert set(objects) == {FREE, FIXED} and changed_files(folder) == ()
        card = (folder / "README.md").read_text(encoding="utf-8")
        assert LICENCE in card and all(name in card for name in objects)
        for item in objects.values():
            assert changed_files(item.folder) == ()
            with Image.open(item.folder / "preview.png") as picture:
                assert picture.size == (64, 64) and len(picture.getcolors(4096) or ()) > 5
            receipt = json.loads((item.folder / "receipt.json").read_text(encoding="utf-8"))
            seen = receipt["engines"]["pybullet"]
            assert receipt["status"] == "ok" and seen["drift_m"] < 1e-3
            assert all(check["passed"] for check in seen["checks"])
            named = {check["check"] for check in seen["checks"]}
            assert named == {"rest"} if item.name == FIXED else {"rest", "drop", "jam", "hold", "effort"} < named
            made = json.loads((item.folder / "provenance.json").read_text(encoding="utf-8"))
            assert "mobility.urdf" in made["originals_sha256"] and "numpy" in made["made_with"]
            assert LICENCE in (item.folder / "LICENSE.md").read_text(encoding="utf-8")
    texts = (path.read_bytes() for folder, _ in packs.values() for path in folder.rglob("*") if path.is_file())
    assert not any(str(Path.home()).encode() in text and len(str(Path.home())) > 5 for text in texts)


def test_a_receipt_names_the_check_that_failed_and_only_that() -> None:
    failed = {"test": "hold", "subject": "lid", "passed": False, "value": 0.2, "limit": 0.01, "reason": "it sinks"}
    passed = {**failed, "test": "drop", "subject": "240 Hz", "passed": True}
    found = verdicts([passed, failed], [{"mode": "hold", "subject": "lid"}])
    assert [(seen["check"], seen["passed"]) for seen in found] == [("rest", True), ("drop", True), ("hold", False)]
    assert not verdicts([passed], [{"mode": "drift", "subject": ""}])[0]["passed"]


def test_mujoco_opens_each_scene_and_it_rests(packs: Packs) -> None:
    """By the example's own words."""
    mujoco = pytest.importorskip("mujoco")
    folder, objects = packs["mujoco"]
    for item in objects.values():
        model = mujoco.MjModel.from_xml_path(str(item.folder / "scene.xml"))
        assert sum(model.body_mass) == pytest.approx(item.about.mass_kg, rel=1e-6)
    words = [sys.executable, str(ROOT / "examples" / "mujoco_pack.py"), str(folder)]
    said = subprocess.run(words, capture_output=True, text=True, check=True, timeout=300).stdout
    moved = {line.split(":")[0]: float(line.split("at most ")[1].split()[0]) for line in said.splitlines()}
    assert moved.keys() == objects.keys() and max(moved.values()) < 0.01


ARM = """<mujoco model="arm"><worldbody><body name="finger"><joint name="reach" type="slide" axis="-1 0 0"/>
<geom type="capsule" fromto="0 0 .1 .1 0 .1" size=".02" mass="1"/></body></worldbody>
<actuator><position joint="reach" kp="200" dampratio="1" ctrlrange="0 0.9"/></actuator>
<keyframe><key name="home" qpos="0.1"/></keyframe></mujoco>"""
"""A robot of one finger, for the page's."""


@pytest.mark.parametrize("consumer", ["mujoco", "lerobot"])
def test_the_steps_of_a_consumers_page_run(packs: Packs, consumer: str, tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    (tmp_path / "pack").symlink_to(packs[consumer][0])
    (tmp_path / "arm.xml").write_text(ARM, encoding="utf-8")
    page = (ROOT / f"docs/consumers/{consumer}.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^ *```python\n(.*?)^ *```$", page, re.MULTILINE | re.DOTALL)
    code = textwrap.dedent(code).replace("mujoco_menagerie/franka_emika_panda/panda.xml", "arm.xml")
    code += "print(abs(data.qpos - model.key('home').qpos)[:3].max())" if consumer == "mujoco" else ""
    found = {**os.environ, "PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, env=found)
    assert done.returncode == 0, done.stderr
    # The finger shoves the laptop along, m.
    assert consumer != "mujoco" or float(done.stdout.split()[-1]) > 0.02, done.stdout


def example(module: str, name: str, *words: str, **more: str) -> str:
    """The output of an example in the environment that has its consumer."""
    asked = [python_with(module), str(ROOT / "examples" / f"{name}.py"), *words]
    ended = subprocess.run(asked, capture_output=True, text=True, timeout=300, env={**os.environ, **more})
    assert ended.returncode == 0, ended.stderr[-2000:]
    return ended.stdout


@pytest.mark.parametrize(("pack", "module", "name"), [
    ("robosuite", "robosuite", "robosuite_task"), ("maniskill", "mani_skill", "maniskill_task"),
    ("isaaclab", "isaaclab", "isaaclab_scene"),
])  # fmt: skip
def test_each_object_rests_in_a_task_of_its_consumer(packs: Packs, pack: str, module: str, name: str) -> None:
    folder, objects = packs[pack]
    for item in objects:
        assert float(example(module, name, str(folder), item).split("at most ")[1].split()[0]) < 0.01


def test_the_hubs_dataset_is_read_by_datasets(packs: Packs, tmp_path: Path) -> None:
    folder, objects = packs["huggingface"]
    said = example("datasets", "huggingface_dataset", str(folder), HF_HOME=str(tmp_path), HF_HUB_OFFLINE="1")
    stated = {f"{item.name}: {item.about.mass_kg:.3g} kg, {len(item.about.joints)} joints, 64 x 64 pixels"
              for item in objects.values()}  # fmt: skip
    assert {*said.splitlines()} == stated


def test_libsdformat_opens_gazebos_models(packs: Packs) -> None:
    folder, objects = packs["gazebo"]
    lines = dict(line.split(": ") for line in example("pydrake", "gazebo_model", str(folder)).splitlines())
    for name, item in objects.items():
        mass, _, freedoms = lines[name].split(", ")
        assert float(mass.split()[0]) == pytest.approx(item.about.mass_kg, rel=1e-5)
        assert int(freedoms.split()[0]) == len(item.about.joints) + (0 if item.fixed else 6)


def test_catkin_pkg_finds_nothing_wrong_in_the_ros_package(packs: Packs) -> None:
    folder, objects = packs["ros2"]
    first, *lines = example("catkin_pkg", "ros2_package", str(folder)).splitlines()
    assert first == "refined_objects: format 3, built by ament_cmake, warnings: []"
    assert {*lines} == {f"{name}: {len(item.about.joints)} joints on {'world' if item.fixed else item.about.root}"
                        for name, item in objects.items()}  # fmt: skip


def on_the_hub(address: str, home: Path) -> dict[str, str]:
    """Variables by which huggingface_hub asks a hub on this machine, and keeps what it gets in a folder."""
    return {"HF_ENDPOINT": address, "HF_HOME": str(home), "HF_HUB_DISABLE_XET": "1", "HF_HUB_DISABLE_TELEMETRY": "1"}


def test_the_environment_fetches_its_object_where_lerobot_downloads_it_alone(packs: Packs, tmp_path: Path) -> None:
    pytest.importorskip("gymnasium")
    pytest.importorskip("huggingface_hub")
    folder, objects = packs["lerobot"]
    code = """
import importlib.util, sys
from huggingface_hub import hf_hub_download
spec = importlib.util.spec_from_file_location("env", hf_hub_download("user/name", "env.py"))
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
print(*sorted(path.name for path in module.object_folder(sys.argv[1]).iterdir()))
"""
    with served_as_hub(folder) as (address, asked):
        words = [sys.executable, "-c", code, FIXED]
        more = {**os.environ, **on_the_hub(address, tmp_path)}
        ended = subprocess.run(words, capture_output=True, text=True, timeout=300, env=more)
    assert ended.returncode == 0, ended.stderr[-2000:]
    assert set(ended.stdout.splitlines()[-1].split()) == {path.name for path in objects[FIXED].folder.iterdir()}
    assert {name.split("/")[1] for name in asked if "/" in name} == {FIXED}


def test_lerobot_makes_the_environment_of_the_hub(packs: Packs, tmp_path: Path) -> None:
    with served_as_hub(packs["lerobot"][0]) as (address, _):
        said = example("lerobot", "lerobot_env", "user/name", **on_the_hub(address, tmp_path))
    assert said.splitlines()[-1].startswith("2 copies of 7 actions, ten steps: reward ")


@pytest.mark.parametrize("pack", ["gazebo", "ros2"])
def test_gazebos_models_are_read_with_their_physics(packs: Packs, pack: str) -> None:
    for name, item in packs[pack][1].items():
        config = etree.parse(str(item.folder / "model.config")).getroot()
        assert config.findtext("sdf") == "model.sdf" and config.findtext("name") == item.asset_id
        model = etree.parse(str(item.folder / "model.sdf")).getroot().find("model")
        assert model is not None
        files = [str(uri.text) for uri in model.iter("uri")]
        assert files and all((item.folder / file).is_file() for file in files)
        masses = sum(float(str(mass.text)) for mass in model.iter("mass"))
        assert masses == pytest.approx(item.about.mass_kg, rel=1e-6)
        assert (model.find("joint[@name='world_fixed']") is not None) == item.fixed == (name == FIXED)
        read = extract(AssetRef(asset_id=name, path=str(item.folder / "model.sdf"))).features
        stated = {joint.name: joint for joint in item.about.joints}
        for joint in read.movable_joints:
            own = stated[joint.name]
            zero = own.initial_position
            assert joint.lower == pytest.approx(None if own.lower is None else own.lower - zero, abs=1e-6)
            assert joint.upper == pytest.approx(None if own.upper is None else own.upper - zero, abs=1e-6)
        assert len(read.movable_joints) == len(stated)


def test_the_worlds_of_gazebo_hold_every_model_at_its_height(packs: Packs) -> None:
    folder, objects = packs["gazebo"]
    world = etree.parse(str(folder / "world.sdf")).getroot().find("world")
    assert world is not None
    found = {item.findtext("uri"): item.findtext("pose") for item in world.findall("include")}
    assert set(found) == {f"model://{name}" for name in objects}
    for name, item in objects.items():
        own = etree.parse(str(item.folder / "model.sdf")).getroot().findtext("model/pose")
        assert float(str(found[f"model://{name}"]).split()[2]) == pytest.approx(float(str(own).split()[2]), abs=1e-5)


def test_ros_finds_what_its_urdf_names_in_the_package(packs: Packs) -> None:
    import yourdfpy

    folder, objects = packs["ros2"]
    package = etree.parse(str(folder / "package.xml")).getroot()
    name = str(package.findtext("name"))
    assert package.findtext("license") == LICENCE and f"project({name})" in (folder / "CMakeLists.txt").read_text()
    for item in objects.values():
        urdf = item.folder / "ros.urdf"
        assert 'filename="package://' in urdf.read_text(encoding="utf-8")
        find = partial(in_package, folder, name)
        robot = yourdfpy.URDF.load(str(urdf), filename_handler=find, build_collision_scene_graph=True,
                                   load_collision_meshes=True)  # fmt: skip
        assert len(robot.actuated_joints) == len(item.about.joints)
        assert robot.base_link == ("world" if item.fixed else item.about.root)
        assert len(robot.collision_scene.geometry) > 0
    launch = (folder / "launch" / "view.launch.py").read_text(encoding="utf-8")
    compile(launch, "view.launch.py", "exec")


def test_usd_of_isaac_lab_is_complete_and_its_module_names_each(packs: Packs) -> None:
    pytest.importorskip("pxr", reason="usd-core is not installed")
    from pxr import Usd, UsdUtils

    folder, objects = packs["isaaclab"]
    text = (folder / "refined_objects.py").read_text(encoding="utf-8")
    compile(text, "refined_objects.py", "exec")
    for name, item in objects.items():
        stage = Usd.Stage.Open(str(item.folder / "mobility.usda"))
        _, _, missing = UsdUtils.ComputeAllDependencies(str(item.folder / "mobility.usda"))
        assert stage.GetDefaultPrim().IsValid() and not missing
        assert f"{name.upper()}_CFG = config({name!r}" in text and repr(item.initial) in text


def test_maniskills_module_adds_objects_to_sapiens_scenes(packs: Packs) -> None:
    pytest.importorskip("sapien")
    folder, objects = packs["maniskill"]
    code = f"""
import sys
import textwrap
sys.path.insert(0, {str(folder)!r})
import sapien
from types import SimpleNamespace
import refined_objects as ours
sapien.physx.set_default_material(0.3, 0.3, 0.0)
for name in ours.NAMES:
    scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    items = ours.add(SimpleNamespace(sub_scenes=[scene]), name)
    items[0].articulation.set_qpos(items[0].articulation.get_qpos() + 0.01)
    ours.reset(items)
    print(name, len(items[0].about.joints), max(abs(items[0].positions()[j.name] - j.initial_position) < 1e-5
          for j in items[0].about.joints))
"""
    ended = subprocess.run([sys.executable, "-I", "-c", code], capture_output=True, text=True, timeout=300)
    said = [line.split() for line in ended.stdout.splitlines() if line.split()[0] in objects]
    assert said == [[name, str(len(item.about.joints)), "True"] for name, item in objects.items()], ended.stderr


def test_lerobots_make_env_is_reset_and_stepped(packs: Packs) -> None:
    gymnasium = pytest.importorskip("gymnasium")
    folder, _ = packs["lerobot"]
    env = module_of(folder / "env.py").make_env(n_envs=2)
    assert isinstance(env, gymnasium.vector.VectorEnv) and env.num_envs == 2
    seen, _ = env.reset(seed=[0, 1])
    seen, reward, *_ = env.step(env.action_space.sample())
    assert len(seen) == 2 and np.isfinite(reward).all()
    env.close()
    assert (folder / "requirements.txt").read_text(encoding="utf-8").startswith("asset2sim[bullet,gym]==")


def test_the_hubs_table_has_pictures_and_its_card_is_read(packs: Packs) -> None:
    import pyarrow.parquet as pq

    folder, objects = packs["huggingface"]
    table = pq.read_table(folder / "objects.parquet")
    told = json.loads(table.schema.metadata[b"huggingface"])["info"]["features"]
    assert set(told) == set(table.column_names) and told["preview"] == {"_type": "Image"}
    for row in table.to_pylist():
        with Image.open(BytesIO(row["preview"]["bytes"])) as picture:
            assert picture.size == (64, 64)
        assert (folder / row["urdf"]).is_file() and row["name"] in objects and row["mass_kg"] > 0.0
    text = (folder / "README.md").read_text(encoding="utf-8")
    card = yaml.safe_load(text.split("---")[1])
    assert card["license"] == LICENCE and (folder / card["configs"][0]["data_files"][0]["path"]).is_file()
    hub = pytest.importorskip("huggingface_hub")
    assert hub.DatasetCard(text).data.pretty_name == card["pretty_name"]


def test_robosuites_objects_are_whole(packs: Packs) -> None:
    """As robosuite looks for them; its own test needs an environment of its own (``examples/robosuite_task.py``)."""
    mujoco = pytest.importorskip("mujoco")
    for item in packs["robosuite"][1].values():
        root = etree.parse(str(item.folder / "object.xml")).getroot()
        assert root.find("worldbody/body/body[@name='object']") is not None
        for site in ("bottom_site", "top_site", "horizontal_radius_site"):
            assert root.find(f"worldbody/body/site[@name='{site}']") is not None
        model = mujoco.MjModel.from_xml_path(str(item.folder / "object.xml"))
        assert model.njnt == len(item.about.joints)


def test_objects_are_loaded_from_a_pack_by_its_loader(packs: Packs) -> None:
    item = packs["huggingface"][1][FREE]
    assert load(item.folder, "pybullet").positions() == pytest.approx(item.initial, abs=1e-6)


def test_what_cannot_be_packed_is_said(out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UnknownChoiceError, match="choose from: gazebo"):
        find_pack("unreal")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    with pytest.raises(UsageError, match="is there already"):
        write_pack(out, tmp_path / "full", find_pack("maniskill"))
    assert main(["pack", str(out), "--for", "maniskill", "--out", str(tmp_path / "one"), "--assets", FREE]) == 0
    assert "1 objects for ManiSkill" in capsys.readouterr().out
    assert main(["pack", str(out), "--for", "maniskill", "--out", str(tmp_path / "none"), "--assets", "x"]) == 2


def test_names_are_python_names_and_no_two_alike() -> None:
    found = python_names(["100129", "A-b", "a b", "class", "!!"])
    assert found == ["object_100129", "a_b", "a_b_", "object_class", "object"]
    assert all(name.isidentifier() for name in found)
