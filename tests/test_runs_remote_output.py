"""An output behind a URL: the same tables as in a folder, from any machine, whatever a killed run left there."""

import os
import threading
import time
from functools import partial
from pathlib import Path
from typing import NoReturn

import pytest

from asset2sim.catalog import read_remote as read
from asset2sim.catalog.query import connect
from asset2sim.catalog.read import query, read_table
from asset2sim.runs import asking_attempt
from asset2sim.runs.asset_attempt import AssetAttempt
from asset2sim.runs.plan.records import RECORDS_FOLDER, KeptRecord, keep_record, record_file
from asset2sim.runs.remote import output
from asset2sim.runs.remote.output import fetch_record
from asset2sim.runs.request import RefineRequest
from asset2sim.storage import tree
from asset2sim.storage.lock import LostLockError
from asset2sim.storage.objects import working_folder
from flows.dry_run import print_dry_run
from schemas.asset import AssetRef
from schemas.errors import UsageError
from schemas.settings import RunSettings, Settings
from schemas.tables import TABLES
from schemas.vocabulary import Redo
from tests.dask_programs import process_cluster
from tests.factories import make_record
from tests.incremental_runs import NAMES, NO_VIEWS, dataset, done, manifest, runs, timeless
from tests.object_store import Store
from tests.processes import wait_until
from tests.remote_runs import brief, in_this_process, night


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """The pipeline in this process, and no listing of a test before."""
    in_this_process(monkeypatch)
    tree._kept.clear()


@pytest.fixture
def data(tmp_path: Path) -> Path:
    return dataset(tmp_path / "data")


def another_machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("ASSET2SIM_CACHE", str(tmp_path / f"cache-{time.monotonic_ns()}"))


def test_the_tables_are_those_of_a_folder(
    store: Store, data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = f"{store.url}/out"
    store.put(data, f"{store.url}/data")
    night(data, tmp_path / "here")
    assert done(night(f"{store.url}/data", out)) == "abcd"
    here, there = timeless(tmp_path / "here"), timeless(out)
    for row in (*here["assets"], *there["assets"]):
        # A folder's is of the bytes of its files, a URL's of what the store says of them.
        del row["content_hash"], row["source_path"]
    assert here == there
    # The objects are the files that are there otherwise, and nothing of the work is left but what the next run needs.
    base = tmp_path / "here"
    files = {path.relative_to(base).as_posix() for path in base.rglob("*") if path.is_file()}
    parts = ("catalog/", "assets/", "logs/", "reviews/")
    kept = {name for name in files if name.startswith(parts)} | {".cache/files.db"}
    assert {name for name in store.keys(out) if not name.startswith("history/")} == kept
    assert not list((working_folder(out) / "assets").iterdir())
    # Unchanged from this machine and from another, where nothing but tables and notes is asked for.
    assert done(night(f"{store.url}/data", out)) == ""
    another_machine(monkeypatch, tmp_path)
    tree._kept.clear()
    asked = store.asked("GET", lambda: night(f"{store.url}/data", out))
    assert done(night(data, out)) == "abcd", "other files, as far as anybody can tell"
    assert not [name for name in asked if name.startswith(("out/assets/", "data/a/", "data/b/"))]
    assert runs(out)["unchanged"].tolist() == [0, 4, 4, 0]


def test_the_commands_that_read_take_a_url(
    store: Store, data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from flows.command import run_command

    out = f"{store.url}/out"

    def refused(request: RefineRequest) -> NoReturn:
        pytest.fail(f"{request} is refined")

    def command(*words: str) -> str:
        code = run_command([*words, "--out", out], refine=refused, nightly=lambda _: 0)
        found = capsys.readouterr()
        return found.out if code == 0 else f"{code}: {found.err}"

    assert command("failures").startswith(f"2: asset2sim: no catalog in {out}: run")
    night(data, out)
    assert "none (ok)" in command("failures")
    assert command("query", "select count(*) as n from asset_history", "--csv").split() == ["n", "4"]
    assert f"{out}/assets/a" in command("show", "a")
    with connect(out) as tables:
        assert tables.sql("select count(*) from assets").fetchall() == [(4,)]
    assert query(out, "select count(*) as n from runs")["n"].tolist() == [1]
    assert store.asked("GET", lambda: read_table(out, "assets")) == [], "the copies are of today"
    night(data, out)
    assert len(read_table(out, "runs")) == 2
    assert "nothing changed" in command("failures", "--compare", "previous", "latest")
    with pytest.raises(UsageError, match="check the address"):
        read_table("s3://no-such-bucket/out", "assets")


def test_what_left_the_dataset_leaves_the_tables(store: Store, data: Path) -> None:
    url, out = f"{store.url}/data", f"{store.url}/out"
    store.put(data, url)
    night(url, out)
    manifest(data, dict.fromkeys("abc", ""))
    store.files.pipe_file(f"{url}/manifest.csv", (data / "manifest.csv").read_bytes())
    store.files.pipe_file(f"{url}/b/mobility.urdf", b"<robot name='changed'/>")
    tree._kept.clear()
    assert done(night(url, out)) == "b"
    assert read_table(out, "assets")["asset_id"].tolist() == ["a", "b", "c"]
    assert len(read_table(out, "asset_history")) == 7
    assert store.files.cat_file(f"{out}/assets/b/refined.urdf") == b"<robot name='changed'/>"


def test_a_folder_that_somebody_removed_is_made_again(store: Store, data: Path) -> None:
    out = f"{store.url}/out"
    night(data, out)
    store.files.rm(f"{out}/assets/c", recursive=True)
    assert done(night(data, out)) == "c"
    store.files.rm(f"{out}/assets/d/views", recursive=True)
    assert done(night(data, out)) == ""
    assert done(night(data, out, Settings())) == "d"


def test_what_an_earlier_run_refined_is_set_aside_where_a_later_one_fails(store: Store, data: Path) -> None:
    out = f"{store.url}/out"
    night(data, out)
    first, urdf = store.files.cat_file(f"{out}/assets/b/refined.urdf"), data / "b" / "mobility.urdf"
    text = urdf.read_text()
    urdf.unlink()
    for said in (["b"], []):  # a second failure keeps it
        night(data, out, NO_VIEWS.model_copy(update={"run": RunSettings(redo=Redo.ALL)}))
        assert not [name for name in store.keys(out) if name.startswith("assets/b/")]
        assert store.files.cat_file(f"{out}/set_aside/b/refined.urdf") == first
        found = read_table(out, "findings").query("code == 'set_aside'")
        assert found["asset_id"].tolist() == said and all("set_aside/b" in text for text in found["message"])
    urdf.write_text(text + " ")
    night(data, out)
    kept = store.keys(out)
    assert "assets/b/refined.urdf" in kept and not [name for name in kept if name.startswith("set_aside/")]


def test_a_dry_run_behind_a_url_writes_nothing_there(
    store: Store, data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    url, out = f"{store.url}/data", f"{store.url}/out"
    store.put(data, url)

    def dry() -> str:
        before = store.keys(store.url)
        print_dry_run(RefineRequest.model_validate({"data": url, "out": out, "settings": NO_VIEWS}))
        assert store.keys(store.url) == before
        return capsys.readouterr().out

    assert "4 of 4 assets would be refined" in dry()
    night(url, out)
    assert "would be refined" in dry() and "nothing is written" in dry()


def test_a_second_run_is_refused(store: Store, data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = f"{store.url}/out"
    with output.open_output(out) as held:
        told = rf"process {os.getpid()}\) is writing to {out};"
        with pytest.raises(UsageError, match=told), output.open_output(out):
            pytest.fail("two runs")
        another_machine(monkeypatch, tmp_path)
        with pytest.raises(UsageError, match=rf"\(process {os.getpid()} on .* is writing to {out}"):
            night(data, out)
        assert held.folder.is_dir()
    night(data, out)


def test_nothing_is_sent_once_another_run_took_over(store: Store, data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from asset2sim.storage import lock

    out = f"{store.url}/out"
    monkeypatch.setattr(output, "lock_url", partial(lock.lock_url, renew_s=0.02))

    def overtaken(pipeline: str, ref: AssetRef, out: Path, settings: Settings, **options: object) -> AssetAttempt:
        store.files.pipe_file(f"{store.url}/out/.lock", b'{"token": "t", "process": 1, "host": "far", "time": 9e12}')
        # The thread that renews the lock ends when it finds it another's.
        assert wait_until(lambda: all(thread.name != "asset2sim-lock" for thread in threading.enumerate()), 120.0)
        return AssetAttempt(brief(ref, out, settings, options["ask"]))

    monkeypatch.setattr(asking_attempt, "attempt_in_child", overtaken)
    with pytest.raises(LostLockError, match=r"took .* over"):
        night(data, out)
    assert not [name for name in store.keys(out) if name.startswith(("catalog/", "history/"))]


def test_runs_is_the_last_table_that_is_sent(store: Store, data: Path) -> None:
    out = f"{store.url}/out"
    night(data, out)
    store.requests.clear()
    night(data, out)
    changes = [
        (method, path.partition("?")[0].rpartition("/")[2] if method == "PUT" else "")
        for method, path in store.requests
        if method in ("PUT", "POST", "DELETE")
    ]
    names = [name for method, name in changes if method == "PUT"]
    tables = {table.file for table in TABLES.values()}
    sent = [name for name in names if name in tables]
    assert sent[-1] == "runs.parquet" and len(sent) > 1
    run_id = runs(out)["run_id"].iloc[-1]
    assert names.index(f"{run_id}.parquet") < names.index("runs.parquet")
    assert len(read_table(out, "asset_history")) == 2 * len(NAMES)


@pytest.mark.system
def test_a_run_that_is_killed_anywhere_is_finished_by_another_machine(
    store: Store, data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(read, "UPLOAD_WAIT_S", 0.0)
    url = f"{store.url}/data"
    store.put(data, url)
    store.requests.clear()
    night(url, f"{store.url}/undisturbed")
    expected = timeless(f"{store.url}/undisturbed")
    changed = [path for method, path in store.requests if method in ("PUT", "POST", "DELETE")]

    def first(part: str) -> int:
        return next(number for number, path in enumerate(changed, 1) if f"/undisturbed/{part}" in path)

    # In the second asset, in its history, between tables, after the last table and at the very end.
    among_tables, last_table = first("catalog/") + 6, first("catalog/runs.parquet")
    taken_up = []
    for requests in (first("assets/b"), first("history/"), among_tables, last_table + 1, last_table + 2):
        out = f"{store.url}/out-{requests}"
        tree._kept.clear()
        store.requests.clear()
        child = os.fork()
        if child == 0:
            try:
                night(url, out)
            finally:
                os._exit(0)
        store.doomed[:] = [child, requests]
        _, status = os.waitpid(child, 0)
        store.doomed.clear()
        assert os.WIFSIGNALED(status)
        left = store.keys(out)
        before = len(read_table(out, "runs")) if "catalog/runs.parquet" in left else 0
        assert ".lock" in left
        # One is started again where it was, at once.
        if requests != among_tables:
            # As if the time had passed after which nobody believes in it.
            store.files.rm(f"{out}/.lock")
            another_machine(monkeypatch, tmp_path)
        plan = night(url, out)
        taken_up.append(len(plan.finished))
        assert len(plan.todo) + len(plan.finished) + len(plan.unchanged) == len(NAMES)
        assert timeless(out) == expected, f"killed after {requests} requests"
        past = read_table(out, "asset_history").groupby("run_id")["asset_id"].agg(list).to_dict()
        assert past == {run_id: list(NAMES) for run_id in read_table(out, "runs")["run_id"]}
        assert len(past) == before + 1
        assert not [name for name in store.keys(out) if name.startswith((RECORDS_FOLDER, ".lock"))]
    assert taken_up == [1, 4, 4, 0, 0]


def test_workers_on_another_machine_answer_through_the_store(store: Store, data: Path, tmp_path: Path) -> None:
    url, out = f"{store.url}/data", f"{store.url}/out"
    store.put(data, url)
    far = tmp_path / "far"
    # A worker that is a daemon may not start the process in which an asset runs.
    with process_cluster(daemon=False, ASSET2SIM_CACHE=str(far)) as cluster:
        settings = NO_VIEWS.model_copy(update={"run": RunSettings(scheduler=cluster.scheduler_address)})
        assert done(night(url, out, settings, dask=True)) == "abcd"
    assert read_table(out, "assets")["status"].tolist() == ["ok"] * 4
    assert (far / "data").is_dir() and not (tmp_path / "cache" / "data").exists()
    assert {f"assets/{name}/refined.urdf" for name in NAMES} <= set(store.keys(out))


def test_a_record_that_is_here_is_not_fetched(store: Store, data: Path) -> None:
    out = f"{store.url}/out"
    plan = night(data, out)
    content = plan.hashes["a"]
    store.files.pipe_file(f"{out}/{RECORDS_FOLDER}/{content}.json", b"{}")
    kept = KeptRecord(run_id="r", redo=Redo.CHANGED, record=make_record("a", content_hash=content))
    folder = working_folder(out)
    keep_record(folder, kept)
    assert store.asked("GET", lambda: fetch_record(out, content, "r", 1)) == []
    assert store.asked("GET", lambda: fetch_record(out, content, "r", 2)) == [f"out/{RECORDS_FOLDER}/{content}.json"]
    assert record_file(folder, content).read_bytes() == b"{}", "the second attempt's, from another machine"
