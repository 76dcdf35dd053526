"""Incremental runs: what changes an asset, and what is refined again."""

import ast
import errno
import gc
import json
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.catalog.read import read_table
from asset2sim.engines import registry
from asset2sim.runs.plan import content_hash as code
from asset2sim.runs.plan import records, state
from asset2sim.runs.plan.asset_files import AssetFile, asset_files
from asset2sim.runs.plan.content_hash import content_hash, counted_files, package_versions, shared_hash
from asset2sim.runs.plan.plan import asset_files_hashes, must_redo
from asset2sim.runs.plan.state import folder_files_hash, open_state
from schemas import source_code
from schemas.alignment import Reference
from schemas.asset import AssetRef
from schemas.settings import EngineSettings, ModelSettings, PhysicsSettings, RunSettings, Settings, ViewSettings
from schemas.vocabulary import DECIDING_PACKAGES, RETRIED_MODES, Engine, FailureMode, Method, Redo, Status
from tests.assets import RAW, ROOT, box_obj, link, mesh, robot, written
from tests.factories import make_record
from tests.incremental_runs import NAMES, NO_VIEWS, asking, dataset, done, failing, manifest, run, runs
from tests.prefect_server import using

# What an asset's content is


def content(folder: Path, out: Path) -> str:
    with open_state(out) as opened:
        return folder_files_hash(opened, folder, AllowedFolders((folder.parent,)))


def test_any_file_that_changes_comes_or_goes_is_another_content(tmp_path: Path) -> None:
    asset, out = written(tmp_path / "asset", "<robot/>", {"textured_objs/a.obj": "1"}), tmp_path / "out"
    seen = [content(asset, out)]
    (asset / ".DS_Store").write_text("hidden")
    assert content(asset, out) == seen[0]
    inner = asset / "textured_objs" / "a.obj"
    before = inner.stat()
    inner.write_text("2")
    os.utime(inner, ns=(before.st_atime_ns, before.st_mtime_ns))  # same size, and said to be as old
    seen.append(content(asset, out))
    (asset / "textured_objs" / "b.obj").write_text("1")
    seen.append(content(asset, out))
    inner.rename(asset / "textured_objs" / "c.obj")
    seen.append(content(asset, out))
    shutil.rmtree(asset)
    seen.append(content(asset, out))
    assert len(set(seen)) == len(seen)


def test_a_mesh_from_elsewhere_belongs_to_the_asset(tmp_path: Path) -> None:
    box = box_obj((0, 0, 0), (1, 1, 1), "mtllib look.mtl\n")
    asset = written(tmp_path / "asset", robot(link("a", mesh("package://things/box.obj") + mesh("own.obj"))))
    first = content(asset, tmp_path / "out")
    package = tmp_path / "things"
    package.mkdir()
    (package / "box.obj").write_text(box)
    (package / "look.mtl").write_text("newmtl red\n")
    assert [file.name for file in asset_files(asset, AllowedFolders((tmp_path,)))] == [
        "mobility.urdf",
        "package://things/box.obj box.obj",
        "package://things/box.obj look.mtl",
    ]
    second = content(asset, tmp_path / "out")
    (package / "look.mtl").write_text("newmtl blue\n")
    assert len({first, second, content(asset, tmp_path / "out")}) == 3


def test_pipes_and_circles_of_links_are_passed_by(tmp_path: Path) -> None:
    asset = written(tmp_path / "asset", "<robot/>")
    os.mkfifo(asset / "pipe")
    (asset / "again").symlink_to(asset)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "a.obj").write_text("1")
    (asset / "meshes").symlink_to(tmp_path / "elsewhere")
    assert [file.name for file in asset_files(asset, AllowedFolders((tmp_path,)))] == ["meshes/a.obj", "mobility.urdf"]


def test_links_are_followed_once_and_within_the_dataset_alone(tmp_path: Path) -> None:
    data, beyond = tmp_path / "data", tmp_path / "beyond"
    asset = written(data / "asset", "<robot/>")
    for folder in (data / "shared", beyond):
        folder.mkdir()
        (folder / "a.obj").write_text("1")
    (asset / "shared").symlink_to(data / "shared")
    (asset / "again").symlink_to(data / "shared")
    (asset / "up").symlink_to("..")
    (asset / "root").symlink_to("/")
    (asset / "self").symlink_to("self")
    (asset / "beyond").symlink_to(beyond)
    (asset / "a.obj").symlink_to(beyond / "a.obj")
    names = [file.name for file in asset_files(asset, AllowedFolders((asset, data)))]
    assert {name for name in names if " -> " in name} == {
        f"{x} -> {beyond / y}" for x, y in (("beyond", ""), ("a.obj", "a.obj"))
    }
    assert sum(name.endswith("/a.obj") for name in names if " -> " not in name) == 1 and len(names) == 4
    before = folder_hash(asset, data, tmp_path / "out")
    (beyond / "a.obj").write_text("2")
    assert folder_hash(asset, data, tmp_path / "out") == before
    (data / "shared" / "a.obj").write_text("2")
    assert folder_hash(asset, data, tmp_path / "out") != before


def folder_hash(asset: Path, root: Path, out: Path) -> str:
    with open_state(out) as opened:
        return folder_files_hash(opened, asset, AllowedFolders((asset, root)))


def test_folders_as_deep_as_paths_can_be_and_names_that_are_no_text_are_hashed(tmp_path: Path) -> None:
    asset = written(tmp_path / "asset", "<robot/>", {os.fsdecode(b"\xff.obj"): "1"})
    here = os.getcwd()
    try:
        os.chdir(asset)
        for _ in range(1200):
            os.mkdir("d")
            os.chdir("d")
        os.chdir(here)
        assert content(asset, tmp_path / "out") == content(asset, tmp_path / "out")
    finally:
        os.chdir(here)
        subprocess.run(["rm", "-rf", str(asset / "d")], check=True)  # deeper than Python, and pytest, can remove


def test_a_folder_that_cannot_be_listed_is_part_of_the_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asset = written(tmp_path / "asset", "<robot/>", {"meshes/a.obj": "1"})
    before, scandir = content(asset, tmp_path / "out"), os.scandir

    def refusing(path: Any) -> Any:
        if str(path) == str(asset / "meshes"):
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return scandir(path)

    with monkeypatch.context() as patch:
        patch.setattr(os, "scandir", refusing)
        shut = content(asset, tmp_path / "out")
        assert shut == content(asset, tmp_path / "out")
    assert shut != before and content(asset, tmp_path / "out") == before


def test_reading_that_does_not_end_is_given_up_and_the_asset_refined(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """As a network disk that does not answer."""
    slow, good = written(tmp_path / "slow", "<robot/>"), written(tmp_path / "good", "<robot/>")
    digest, over = state._digest, threading.Event()

    def hanging(file: AssetFile) -> str:
        if file.path.startswith(str(slow)):
            over.wait()
        return digest(file)

    monkeypatch.setattr(state, "_digest", hanging)
    refs = [AssetRef(asset_id=folder.name, path=str(folder)) for folder in (slow, good)]
    with open_state(tmp_path / "out") as opened:
        first, second = (asset_files_hashes(opened, refs, limit_s=0.2) for _ in range(2))
    over.set()
    assert first[str(slow)] != second[str(slow)] and first[str(good)] == second[str(good)]
    assert "asset slow: its files were not read within 0.2 s" in caplog.text


def test_a_file_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(state, "SETTLED_NS", 0)
    read: list[str] = []
    digest = state._digest

    def watched(file: AssetFile) -> str:
        read.append(file.name)
        return digest(file)

    monkeypatch.setattr(state, "_digest", watched)
    asset = written(tmp_path / "asset", "<robot/>", {"a.obj": "1", "b.obj": "2"})
    time.sleep(0.02)  # the clock of files ticks in steps of some milliseconds
    out = tmp_path / "out"
    first = content(asset, out)
    assert sorted(read) == ["a.obj", "b.obj", "mobility.urdf"] and content(asset, out) == first and len(read) == 3
    (asset / "a.obj").write_text("3")
    assert content(asset, out) != first and read[3:] == ["a.obj"]
    (out / state.FILE).write_bytes(b"not a database" * 1000)
    assert content(asset, out) != first and len(read) == 7


def test_a_file_that_was_just_written_is_not_trusted_to_tell_of_the_next_write(tmp_path: Path) -> None:
    asset = written(tmp_path / "asset", "<robot/>")
    content(asset, tmp_path / "out")
    with open_state(tmp_path / "out") as opened:
        assert opened.execute("SELECT count(*) FROM files").fetchone() == (0,)


REF = AssetRef(asset_id="a", path="/data/a", prompt="a small box")


def key(ref: AssetRef = REF, settings: Settings = NO_VIEWS) -> str:
    return content_hash(ref, "files", shared_hash(settings, "p"))


def test_the_hash_follows_request_settings_and_reference() -> None:
    changed = [
        key(),
        key(REF.model_copy(update={"prompt": "another"})),
        key(REF.model_copy(update={"asset_id": "b"})),
        key(REF.model_copy(update={"reference": Reference(0.5, "lid", 0.1)})),
        key(settings=NO_VIEWS.model_copy(update={"physics": PhysicsSettings(min_mass_kg=0.01)})),
        key(settings=NO_VIEWS.model_copy(update={"method": Method.RAW})),
        key(settings=NO_VIEWS.model_copy(update={"model": ModelSettings(model="prior/noisy")})),
        key(settings=NO_VIEWS.model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,))})),
        content_hash(REF, "other files", shared_hash(NO_VIEWS, "p")),
        content_hash(REF, "files", shared_hash(NO_VIEWS, "another pipeline")),
    ]
    assert len(set(changed)) == len(changed)
    assert key(REF.model_copy(update={"path": "/moved/a"})) == key()
    how = {
        "run": RunSettings(workers=7, asset_time_limit_s=1.0, redo=Redo.ALL),
        "views": ViewSettings(write=True),
        "model": ModelSettings(cache=False, run_usd=3.0, max_attempts=9),
    }
    assert key(settings=NO_VIEWS.model_copy(update=how)) == key()


def test_an_engine_that_is_not_asked_for_has_no_say(monkeypatch: pytest.MonkeyPatch) -> None:
    one = NO_VIEWS.model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,))})
    before = key(), key(settings=one)
    versions = dict.fromkeys((*DECIDING_PACKAGES, *Engine), "1.0")
    monkeypatch.setattr(registry, "version_of", versions.__getitem__)
    monkeypatch.setattr(code, "installed", lambda: tuple(Engine))
    stated = key(), key(settings=one)
    assert stated[0] != before[0] and stated[1] != before[1]
    versions["mujoco"] = "1.1"
    assert key() != stated[0] and key(settings=one) == stated[1]
    assert set(package_versions(one.engine)) == {*DECIDING_PACKAGES, "pybullet"}


def copied(root: Path) -> Path:
    """A copy of everything that content hashes depend on."""
    for name in counted_files(ROOT):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, root / name)
    return root


def version_after(root: Path, name: str, edit: Callable[[str], str]) -> str:
    """The version of the sources while one file is edited."""
    text = (root / name).read_text(encoding="utf-8")
    (root / name).write_text(edit(text), encoding="utf-8")
    try:
        return code.source_version.__wrapped__(root)
    finally:
        (root / name).write_text(text, encoding="utf-8")


def test_the_rooms_that_count_are_there_and_an_edit_of_code_or_data_in_each_is_another_version(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in (*code.ROOMS, *code.IRRELEVANT_SOURCES):
        assert (ROOT / name).exists(), name
    monkeypatch.setenv("ASSET2SIM_CACHE", str(tmp_path / "cache"))
    root = copied(tmp_path / "copy")
    same = code.source_version.__wrapped__(root)
    files = counted_files(root)
    assert files == counted_files(ROOT) and same == code.source_version()
    remark = "# a remark\n", '\n\n\ndef _more() -> None:\n    """Do nothing."""\n'
    edited = set()
    for room in code.ROOMS:
        name = next(file for file in files if file.startswith(room) and file.endswith(".py"))
        assert version_after(root, name, lambda text: f"{remark[0]}{text}") == same, name
        edited.add(version_after(root, name, lambda text: f"{text}{remark[1]}"))
    data = [name for name in files if not name.endswith(".py")]
    assert {Path(name).suffix for name in data} == {".csv", ".md"} and len(data) > 15
    edited |= {version_after(root, name, lambda text: f"{text}\n") for name in data}
    assert len(edited) == len(code.ROOMS) + len(data) and same not in edited
    assert not {"asset2sim/catalog/show.py", "asset2sim/runs/alert.py", "flows/command.py"} & set(files)
    for name in files:
        if name.startswith("asset2sim/baselines"):
            (root / name).unlink()
    with pytest.raises(FileNotFoundError, match="baselines"):
        counted_files(root)


def test_a_later_process_parses_only_sources_that_are_new_and_a_damaged_store_costs_time_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ASSET2SIM_CACHE", str(tmp_path / "cache"))
    root, parsed, parse = copied(tmp_path / "copy"), list[bytes](), source_code.bare_code

    def noted(content: bytes) -> bytes:
        parsed.append(content)
        return parse(content)

    monkeypatch.setattr(source_code, "bare_code", noted)
    first = code.source_version.__wrapped__(root)
    assert len({*parsed}) == len(parsed) > 200
    parsed.clear()
    assert code.source_version.__wrapped__(root) == first and not parsed
    name = next(name for name in counted_files(root) if name.endswith(".py"))
    assert version_after(root, name, lambda text: f"{text}\nMORE = 1\n") != first and len(parsed) == 1
    (store,) = (tmp_path / "cache").glob("code-*.json")
    assert store.stat().st_size < 200_000
    for damage in (b"", b"[1]", b'{"a": 1}', b'{"a": "b"}', store.read_bytes()[:-9]):
        store.write_bytes(damage)
        assert code.source_version.__wrapped__(root) == first


def test_prose_is_no_code() -> None:
    bare = source_code.bare_code(
        b'"""Text."""\nLIMIT = 3\n"""Why 3."""\n\ndef f(a):\n    "Say."\n    return [a, "word"]\n'
    )
    assert bare == source_code.bare_code(b'LIMIT = 3  # three\ndef f(a):\n    """Other."""\n    return [a,\n "word"]\n')
    for other in (b'LIMIT = 4\ndef f(a):\n return [a, "word"]', b'LIMIT = 3\ndef f(a):\n return [a, "Word"]'):
        assert bare != source_code.bare_code(other)


def test_sources_are_read_beside_other_threads_while_the_collector_is_watched() -> None:
    """As Dask watches it. Python 3.11 then takes two threads that parse for an error (python/cpython#106905)."""
    sources = [file.read_bytes() for file in sorted((ROOT / "asset2sim/assets").rglob("*.py"))]

    def watch(phase: str, info: dict[str, int]) -> None:
        sum(range(50))

    limits, interval = gc.get_threshold(), sys.getswitchinterval()
    gc.set_threshold(50)
    gc.callbacks.append(watch)
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(3) as pool:
            first, *others = pool.map(lambda _: [source_code.bare_code(source) for source in sources], range(3))
    finally:
        gc.callbacks.remove(watch)
        gc.set_threshold(*limits)
        sys.setswitchinterval(interval)
    assert others == [first, first]


def imported(path: Path) -> set[str]:
    """Sources of ours that a source imports, anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    files = {f"{name.replace('.', '/')}{ending}" for name in names for ending in (".py", "/__init__.py")}
    return {file for file in files if (ROOT / file).is_file()}


def test_whatever_the_pipeline_imports_counts() -> None:
    """Import by import from what makes a record and its rows; what is imported by name only is named here."""
    waiting = {
        "tasks/pipeline.py",
        "asset2sim/checks/alignment/align.py",
        "asset2sim/catalog/rows.py",
        "asset2sim/experiments/isolation/child.py",
        "asset2sim/runs/asset_attempt.py",
        *(f"asset2sim/engines/{engine.value}_world.py" for engine in Engine),
    }
    seen: set[str] = set()
    while waiting:
        source = waiting.pop()
        seen.add(source)
        waiting |= imported(ROOT / source) - seen
    assert len(seen) > 150
    # A run's row, and not an asset's.
    assert seen - set(counted_files(ROOT)) <= {"asset2sim/catalog/run.py"}, "run, and not in ROOMS"


# What is refined again


def test_an_unchanged_asset_is_left_alone_and_keeps_its_rows(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    assert done(run(data, out)) == "abcd"
    first = read_table(out, "assets")
    assert done(run(data, out)) == ""
    assert read_table(out, "assets").equals(first)
    assert runs(out)[["assets", "ok", "unchanged", "queries"]].values.tolist() == [[4, 4, 0, 4], [4, 4, 4, 0]]
    (data / "b" / "mobility.urdf").write_text("<robot name='other'/>")
    manifest(data, {"a": "", "b": "", "c": "open", "d": ""})
    shutil.rmtree(out / "assets" / "d")
    assert done(run(data, out)) == "bcd"
    assert done(run(data, out, asking(Redo.ALL))) == "abcd"
    assert done(run(data, out)) == ""
    assert done(run(data, out, pipeline="other")) == "abcd"


def test_a_failed_asset_is_tried_again_where_that_may_help_or_is_asked_for(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    modes = {"a": FailureMode.MISSING_MESH, "b": FailureMode.TIMEOUT, "c": FailureMode.JAM}
    run(data, out, make=failing(modes))
    again = run(data, out, make=failing({"b": FailureMode.NUDGE}))
    assert done(again) == "b"
    assert [(item.asset_id, item.failure_mode) for item in again.unchanged] == [
        ("a", "missing_mesh"),
        ("c", "jam"),
        ("d", "none"),
    ]
    assert runs(out)["failed"].tolist() == [3, 3]
    assert done(run(data, out, asking(Redo.FAILED))) == "abc"
    assert done(run(data, out, asking(Redo.FAILED))) == ""
    for mode in FailureMode:
        assert must_redo(Status.FAILED, mode, Redo.CHANGED) == (mode in RETRIED_MODES)


def test_a_folder_that_another_method_wrote_is_no_refinement_of_this_one(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    raw = NO_VIEWS.model_copy(update={"method": Method.RAW})

    def made_raw(ref: AssetRef) -> Any:
        return make_record(ref.asset_id, ref=ref, method=Method.RAW)

    run(data, out)
    assert done(run(data, out, raw, made_raw, only=("a", "b"))) == "ab"
    assert done(run(data, out, raw, made_raw, only=("a", "b"))) == ""
    assert done(run(data, out)) == "ab"
    assert len(read_table(out, "assets")) == 6


def test_views_that_are_wanted_and_not_there_are_made(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    run(data, out)
    assert done(run(data, out, Settings(views=ViewSettings(write=False)))) == ""
    assert done(run(data, out, Settings())) == "abcd"
    for name in NAMES:
        (out / "assets" / name / "views").mkdir()
    assert done(run(data, out, Settings())) == "" and done(run(data, out)) == ""


def test_what_left_the_dataset_leaves_the_tables_and_stays_in_history(tmp_path: Path) -> None:
    data, out = dataset(tmp_path / "data"), tmp_path / "out"
    other = dataset(tmp_path / "other", ("z",))
    run(data, out)
    run(other, out)
    manifest(data, dict.fromkeys("abc", ""))
    run(data, out, only=("a",))
    assert len(read_table(out, "assets")) == 5, "a run over a part tells nothing of the rest"
    run(data, out)
    for name in ("assets", "links", "findings", "interactions"):
        assert sorted(set(read_table(out, name)["asset_id"])) == ["a", "b", "c", "z"], name
    history_of_d = read_table(out, "asset_history").query("asset_id == 'd'")
    assert history_of_d["run_id"].tolist() == runs(out)["run_id"].tolist()[:1]


# The whole of it, through Prefect and Dask

SCRIPT = """
import json, shutil, sys
from pathlib import Path
from flows.command import main
from flows import PIPELINE
from asset2sim.runs.request import parse_request
from asset2sim.experiments.isolation.children import warm_up
from flows.server.server import temporary_server

data, out = Path(sys.argv[1]), Path(sys.argv[2])
manifest = data / "manifest.csv"
rows = manifest.read_text().splitlines()
options = ["--out", str(out), "--engines", "pybullet", "--no-interaction", "--no-views", "--workers", "2"]


def step(refine, *more):
    result = refine(parse_request(["refine", str(data), *options, *more]))
    print(json.dumps([[r.ref.asset_id for r in result.records], [u.asset_id for u in result.unchanged]]), flush=True)


if __name__ == "__main__":
    with temporary_server() as address:
        warm_up(PIPELINE)
        from flows.refine_dataset import refine_dataset
        from flows.server.client import use_server

        with use_server(address):
            def refine(request):
                return refine_dataset(request.data, request.out, request.settings)

            step(refine)
            step(refine)
            manifest.write_text("\\n".join(rows[:2] + [rows[3].replace("slightly open", "closed")]) + "\\n")
            step(refine)
            step(refine, "--retry-failed")
            print("LiteLLM:", "litellm" in sys.modules)
"""


@pytest.mark.system
def test_a_flow_refines_what_changed(tmp_path: Path, prefect_server: str) -> None:
    lines = (RAW / "manifest.csv").read_text(encoding="utf-8").splitlines()
    chosen = {line.split(",")[0]: line for line in lines}
    ids = ("planted_not_xml", "scissors_paper", "laptop_silver")
    for asset_id in ids:
        shutil.copytree(RAW / chosen[asset_id].split(",")[2], tmp_path / "data" / chosen[asset_id].split(",")[2])
    (tmp_path / "data" / "manifest.csv").write_text("\n".join([lines[0], *(chosen[i] for i in ids)]) + "\n")
    script = tmp_path / "runs.py"
    script.write_text(SCRIPT)
    environment = {**using(prefect_server, tmp_path / "prefect"), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(script), str(tmp_path / "data"), str(tmp_path / "out")]
    ran = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300)
    assert ran.returncode == 0, ran.stderr
    assert "LiteLLM: False" in ran.stdout, "models of this process are asked without it"
    steps = [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("[[")]
    assert steps == [
        [list(ids), []],
        [[], list(ids)],
        [["laptop_silver"], ["planted_not_xml"]],
        [["planted_not_xml"], ["laptop_silver"]],
    ]
    out = tmp_path / "out"
    assert dict(read_table(out, "assets")[["asset_id", "status"]].values) == {
        "laptop_silver": "ok",
        "planted_not_xml": "failed",
    }
    assert runs(out)["unchanged"].tolist() == [0, 3, 1, 1]
    assert read_table(out, "asset_history").groupby("started_at").size().tolist() == [3, 3, 2, 2]
    assert not list((out / records.RECORDS_FOLDER).iterdir())
