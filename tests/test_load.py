"""The loader as one file, and the index beside the objects."""

import json
import os
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import trimesh

import asset2sim.load
from asset2sim.catalog.index import loader_source, write_index
from asset2sim.catalog.write import write_run
from asset2sim.load import LoadError, describe
from asset2sim.load.shapes import TOUCH_M, overlap_depth, pieces_of
from lab.loaders.held_table import BLOCK, ENGINES, WAYS, held_block, sample_folders
from lab.pages.blocks import markers
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.vocabulary import Engine, Export, FailureMode, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, ROOT, SHARED, prior, sample
from tests.factories import make_failure, make_record, make_run
from tests.marks import needs_shared
from tests.test_load_engines import BALL, BASE, NEEDS, body, box, written


@pytest.mark.system
def test_the_loader_runs_as_one_file_without_us(tmp_path: Path) -> None:
    """Isolated: no current folder, no PYTHONPATH, so that nothing of the project can be imported."""
    (tmp_path / "load.py").write_text(loader_source(), encoding="utf-8")
    folder = written(tmp_path / "one", BASE + BALL, {"j": {"child": "bob", "initial_position": 0.25}})
    code = f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
from load import describe, load
item = load({str(folder)!r}, "pybullet")
item.step()
print(describe({str(folder)!r}).support, round(item.positions()["j"], 2))
ours = ("asset2sim", "schemas", "tasks", "flows", "prefect", "dask", "litellm", "pydantic", "lxml", "scipy")
print([name for name in ours if name in sys.modules])
"""
    ended = subprocess.run(
        [sys.executable, "-I", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True, timeout=300
    )
    assert ended.stdout.splitlines()[-2:] == ["fixed 0.25", "[]"]


LEFT, RIGHT = (body(name, 0.5, "0 0 0", 1e-3, box("0.1 0.1 0.1")) for name in ("left", "right"))
SLIDES = {
    "a": {"kind": "prismatic", "axis": "1 0 0", "xyz": "-0.2 0 0", "child": "left", "lower": 0.0, "upper": 0.2},
    "b": {"kind": "prismatic", "axis": "-1 0 0", "xyz": "0.2 0 0", "child": "right", "lower": 0.0, "upper": 0.2},
}
"""Two cubes of 0.1 m whose faces are 0.3 m apart and which slide towards each other by up to 0.2 m each."""


def test_a_state_in_which_links_are_in_each_other_is_refused_and_none_is_drawn(tmp_path: Path) -> None:
    thing = describe(written(tmp_path / "slides", BASE + LEFT + RIGHT, SLIDES))
    assert thing.positions_at({"a": 1.0, "b": 0.5}) == {"a": 0.2, "b": 0.1}, "they touch"
    with pytest.raises(LoadError, match=r"state: 'open' puts link 'left' 100 mm into 'right'; choose other.* a or b"):
        thing.positions_at("open")
    drawn = [thing.positions_at("random", seed) for seed in range(60)]
    assert all(one["a"] + one["b"] <= 0.3 + TOUCH_M for one in drawn)
    assert thing.positions_at("random", 3) == drawn[3] != drawn[4], "a seed gives the same"
    for name in ("a", "b"):
        assert min(one[name] for one in drawn) < 0.04 and max(one[name] for one in drawn) > 0.16
    apart = BASE + LEFT + RIGHT + '<disable_collisions link1="right" link2="left"/>'
    assert describe(written(tmp_path / "apart", apart, SLIDES)).positions_at("open") == {"a": 0.2, "b": 0.2}
    above = {**SLIDES, "b": SLIDES["b"] | {"xyz": "0.2 0 0.11"}}
    assert describe(written(tmp_path / "above", BASE + LEFT + RIGHT, above)).positions_at("open")["b"] == 0.2
    crowded = {**SLIDES, "b": SLIDES["b"] | {"xyz": "-0.15 0 0", "initial_position": 0.0}}
    asked = describe(written(tmp_path / "crowded", BASE + LEFT + RIGHT, crowded))
    assert asked.positions_at({"b": 0.0}) == {"a": 0.0, "b": 0.0}, "as deep as it is asked to be is no more"


@pytest.mark.system
def test_how_deep_pieces_are_is_what_mujoco_measures(tmp_path: Path) -> None:
    """Two wedges, as meshes, at random turns and places: the depth is no less than MuJoCo's, and free where it is."""
    mujoco = pytest.importorskip("mujoco")
    corners = [[0, 0, 0], [0.2, 0, 0], [0, 0.3, 0], [0.05, 0.05, 0.25], [0.2, 0.3, 0]]
    trimesh.convex.convex_hull(np.array(corners)).export(tmp_path / "wedge.obj")
    text = f'<collision><geometry><mesh filename="{tmp_path}/wedge.obj"/></geometry></collision>'
    piece = pieces_of(ET.fromstring(f"<link>{text}</link>"))[0]
    spec = mujoco.MjSpec()
    spec.add_mesh(name="wedge", file=str(tmp_path / "wedge.obj"))
    for name in ("one", "other"):
        spec.worldbody.add_body(name=name, mocap=True).add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="wedge")
    model = spec.compile()
    data, rng, met = mujoco.MjData(model), np.random.default_rng(0), 0
    for _ in range(60):
        placed = []
        for body_number in range(2):
            rotation = trimesh.transformations.random_rotation_matrix(rng.uniform(size=3))[:3, :3]
            at = rng.uniform(-0.1, 0.1, 3)
            placed.append((piece[0] @ rotation.T + at, piece[1] @ rotation.T))
            data.mocap_pos[body_number] = at
            mujoco.mju_mat2Quat(data.mocap_quat[body_number], rotation.ravel())
        mujoco.mj_kinematics(model, data)
        away = mujoco.mj_geomDistance(model, data, 0, 1, 1.0, None)
        deep = overlap_depth(*placed)
        met += away < -1e-3
        assert (deep > 1e-4) >= (away < -1e-3) and (away > 1e-3) <= (deep < 0.01)
        if away < -1e-3:
            assert -away - 2e-3 <= deep <= 1.5 * -away + 5e-3
    assert 10 < met < 55


def index_of(out: Path) -> dict[str, dict[str, object]]:
    document = json.loads((out / "assets" / "index.json").read_text(encoding="utf-8"))
    return {entry["asset_id"]: entry for entry in document["assets"]}


def test_the_index_has_every_asset_of_all_runs(tmp_path: Path) -> None:
    for name in ("a", "b"):
        written(tmp_path / "assets" / name, BASE + BALL, {"j": {"child": "bob"}}, "freestanding")
    (tmp_path / "assets" / "b" / "mobility.xml").write_text("<mujoco/>", encoding="utf-8")
    write_run(
        tmp_path,
        make_run("20260101T000000-1"),
        [make_record("a"), make_record("b"), make_failure("c", FailureMode.MISSING_MESH)],
    )
    write_index(tmp_path)
    first = index_of(tmp_path)
    assert {name: (one["status"], one["path"]) for name, one in first.items()} == {
        "a": ("ok", "a"), "b": ("ok", "b"), "c": ("failed", None)}  # fmt: skip
    assert first["a"]["formats"] == {"urdf": "a/mobility.urdf"}
    assert first["b"]["formats"] == {"urdf": "b/mobility.urdf", "mjcf": "b/mobility.xml"}
    assert first["a"]["support"] == "freestanding" and first["c"]["support"] is None
    # A run over one asset changes that entry, and leaves the others.
    written(tmp_path / "assets" / "c", BASE + BALL, {"j": {"child": "bob"}}, "fixed")
    write_run(tmp_path, make_run("20260102T000000-2"), [make_record("c")])
    write_index(tmp_path)
    second = index_of(tmp_path)
    assert second["a"] == first["a"] and second["b"] == first["b"]
    assert (second["c"]["status"], second["c"]["path"]) == ("ok", "c")
    assert describe(tmp_path / "assets" / str(second["c"]["path"])).support == "fixed"
    assert (tmp_path / "assets" / "load.py").read_text(encoding="utf-8") == loader_source()
    assert not [path for path in tmp_path.rglob("*") if path.name.startswith(".index")]


def test_the_index_has_the_latest_of_two_models(tmp_path: Path) -> None:
    first, later = make_run("20260101T000000-1"), make_run("20260103T000000-3")
    write_run(tmp_path, first, [make_record("a")])
    write_run(tmp_path, later, [make_failure("a", FailureMode.MISSING_MESH).model_copy(update={"model": "another"})])
    write_index(tmp_path)
    assert index_of(tmp_path)["a"]["status"] == "failed"


def test_every_engine_has_a_plain_loader() -> None:
    assert set(NEEDS) == set(ENGINES) == set(asset2sim.load.ENGINES)


@pytest.fixture(scope="module")
def laptop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """OUT with one refined sample, its MJCF too."""
    out = tmp_path_factory.mktemp("out")
    settings = NO_VIEWS.model_copy(update={"exports": (Export.MJCF,)})
    record = refine_asset(sample("laptop_silver"), out, settings, prior)
    write_run(out, make_run("20260101T000000-1"), [record])
    write_index(out)
    return out


@pytest.fixture(scope="module")
def drawers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """OUT with a refined cabinet of two drawers, without exports."""
    out = tmp_path_factory.mktemp("drawers")
    refine_asset(sample("table_two_drawers"), out, NO_VIEWS, prior)
    return out


@pytest.mark.system
def test_an_arm_meets_an_exported_object_as_one_that_is_not(
    laptop: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The environment, from a folder that is not the object's; its looks are left out."""
    from asset2sim.gym import ObjectEnv, make_env

    exported, plain = laptop / "assets" / "laptop_silver", tmp_path / "laptop_silver"
    shutil.copytree(exported, plain)
    (plain / "mobility.xml").unlink()
    monkeypatch.chdir(tmp_path)
    made = [make_env(folder).unwrapped for folder in (exported, plain)]
    envs = [env for env in made if isinstance(env, ObjectEnv)]
    assert len(envs) == 2 and len({env.subject.stage.model.ngeom for env in envs}) == 1
    first, second = (env.reset(seed=0)[0] for env in envs)
    assert first == pytest.approx(second, abs=1e-3)


def installed(engine: str) -> bool:
    return all(map(find_spec, NEEDS[engine]))


@pytest.mark.system
@pytest.mark.parametrize("fixture", ["laptop", "drawers"])
def test_one_script_says_the_same_in_every_engine(fixture: str, request: pytest.FixtureRequest) -> None:
    """Of an exported laptop and of drawers that were not: 30 % of the way, push, speed, servo, reset."""
    folder = next((request.getfixturevalue(fixture) / "assets").glob("*/overlay.json")).parent
    engines = [name for name in NEEDS if installed(name)]
    words = [sys.executable, str(ROOT / "examples" / "one_api.py"), str(folder), str(folder), *engines]
    ended = subprocess.run(
        words, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False, timeout=900
    )
    assert ended.returncode == 0, ended.stderr
    assert f"{folder.name}, {folder.name}_2 and a robot" in ended.stdout
    said = {line.split()[0]: line for line in ended.stdout.splitlines() if line.split()[0] in engines}
    found = {name: [float(word.rstrip(",")) for word in re.findall(r"-?\d+\.\d+", line)] for name, line in said.items()}
    assert set(found) == set(engines) and len(engines) >= 3
    start, moved, speed, _, again = found["mujoco"]
    joint = max(describe(folder).joints, key=lambda one: one.friction)
    assert start == pytest.approx(joint.closed + 0.3 * (joint.open - joint.closed), abs=1e-4)
    assert again == pytest.approx(joint.initial_position, abs=1e-4) and abs(moved) > 0.01
    for name, numbers in found.items():
        assert numbers[:3] == pytest.approx([start, moved, speed], rel=0.05), name
        assert numbers[3] == pytest.approx(start, abs=0.02), f"{name}: the servo leads it back"
        assert numbers[4] == pytest.approx(again, abs=1e-4), name


@pytest.mark.system
def test_what_holds_is_measured_and_the_readme_says_so(laptop: Path) -> None:
    """The laptop's lid holds through the loader in every engine here, and in none as its URDF is loaded."""
    block = held_block(laptop)
    for engine in NEEDS:
        if installed(engine):
            row = next(line for line in block.splitlines() if line.startswith(f"| {engine} "))
            as_loaded, _, loaded = (cell.strip() for cell in row.strip("|").split("|")[1:])
            assert as_loaded.startswith("0 of 1") and loaded.startswith("1 of 1"), row


def test_the_table_says_what_holds_through_the_loader() -> None:
    begin, end = markers(BLOCK)
    readme = (ROOT / "docs/load.md").read_text(encoding="utf-8")
    lines = readme.split(begin, 1)[1].split(end, 1)[0].splitlines()
    rows = [line.strip("|").split("|") for line in lines if line.startswith("|")]
    assert [cell.strip() for cell in rows[0][1:]] == list(WAYS.values())
    assert [row[0].split()[0] for row in rows[2:]] == list(ENGINES), "stale: run make flow, then make held"
    for name, as_loaded, _, loaded in ([cell.strip() for cell in row] for row in rows[2:]):
        held, of = loaded.split(";")[0].split(" of ")
        assert held == of, f"{name}: {loaded}"
        assert int(as_loaded.split(" of ")[0]) < int(of), f"{name}: {as_loaded}"


def test_an_output_without_an_index_is_a_mistake(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"no .*index\.json; run make flow"):
        sample_folders(tmp_path)


FROM_ALL = {
    "partnet_mobility": lambda folder: sample("45213", folder),
    "other_furniture": lambda folder: sample("fridge", folder),
    "other_origins": lambda folder: AssetRef(asset_id="microwave", path=str(folder / "libero" / "microwave.xml")),
}
"""An object of each folder of real ones: OBJ and semantics, COLLADA and transmissions, MJCF in metres."""


@pytest.mark.system
@needs_shared
@pytest.mark.parametrize("origin", FROM_ALL)
def test_objects_of_all_origins_are_alike_in_all_engines_exported_and_not(origin: str, tmp_path: Path) -> None:
    """Every joint put halfway and back, then the object left alone for half a second as it starts."""
    only = NO_VIEWS.engine.model_copy(update={"verify": (Engine.PYBULLET,)})
    settings = NO_VIEWS.model_copy(update={"exports": (Export.MJCF,), "engine": only})
    record = refine_asset(FROM_ALL[origin](SHARED / origin), tmp_path, settings, prior)
    assert record.overlay is not None and record.status is Status.OK, record.reason
    exported = tmp_path / "assets" / record.ref.asset_id
    plain = Path(shutil.copytree(exported, tmp_path / "plain"))
    (plain / "mobility.xml").unlink()
    held = {joint.name for joint in record.overlay.joints if joint.holds}
    ends = {}
    for engine in ("pybullet", "mujoco", "sapien"):
        for folder in (exported, plain):
            item = asset2sim.load.load(folder, engine)
            start = item.positions()
            halfway = {j.name: 0.5 * (j.closed + j.open) for j in describe(folder).joints if j.mimic is None}
            item.set_positions(halfway)
            now = item.positions()
            assert {name: now[name] for name in halfway} == pytest.approx(halfway, abs=1e-4)
            item.reset()
            assert item.positions() == pytest.approx(start, abs=1e-4)
            for _ in range(round(0.5 / item.timestep_s)):
                item.step()
            ends[engine, folder.name] = {name: item.positions()[name] for name in held}
    assert held
    for where, end in ends.items():
        assert end == pytest.approx({name: start[name] for name in held}, abs=0.01), where
