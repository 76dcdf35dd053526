"""A local folder and the objects below a URL: only what changed travels, and nothing lands outside."""

import os
import time
from pathlib import Path

import pytest

from asset2sim.storage import mirror
from asset2sim.storage.mirror import FILE, ObjectsChangedError, local_names, pull, push, send_folder
from asset2sim.storage.objects import StoreError, list_objects, object_info, open_store, store_usage_error
from schemas.errors import UsageError
from tests.object_store import SECRET, Store

PARTS = ("tables/", "state.db")


def fill(store: Store, **texts: str) -> str:
    url = f"{store.url}/set"
    for name, text in texts.items():
        store.files.pipe_file(f"{url}/{name.replace('__', '/')}.x", text.encode())
    return url


def names(folder: Path) -> list[str]:
    return local_names(folder, ["./"])


def test_only_what_changed_is_fetched(store: Store, tmp_path: Path) -> None:
    url, folder = fill(store, tables__a="1", tables__b="2", other__c="3"), tmp_path / "copy"
    assert sorted(store.asked("GET", lambda: pull(url, folder, PARTS))) == ["set/tables/a.x", "set/tables/b.x"]
    assert names(folder) == ["tables/a.x", "tables/b.x"]
    assert store.asked("GET", lambda: pull(url, folder, PARTS)) == []
    fill(store, tables__a="9", tables__d="4")
    assert sorted(store.asked("GET", lambda: pull(url, folder, PARTS))) == ["set/tables/a.x", "set/tables/d.x"]
    assert (folder / "tables/a.x").read_text() == "9"
    # What somebody did to the copy is undone, and so is what the loss of the notes makes unsure.
    (folder / "tables/b.x").write_text("mine")
    assert store.asked("GET", lambda: pull(url, folder, PARTS)) == ["set/tables/b.x"]
    (folder / FILE).write_bytes(b"damaged" * 100)
    assert len(store.asked("GET", lambda: pull(url, folder, PARTS))) == 3


def test_what_is_gone_there_goes_here_with_what_is_hidden(store: Store, tmp_path: Path) -> None:
    url, folder = fill(store, tables__a="1", tables__m__b="2"), tmp_path / "copy"
    pull(url, folder, PARTS)
    (folder / "tables" / ".left").mkdir()
    (folder / "tables" / ".left" / "half").write_text("")
    (folder / "state.db").write_text("")
    (folder / "cache").mkdir()
    (folder / "cache" / "kept").write_text("")
    store.files.rm(f"{url}/tables/m/b.x")
    pull(url, folder, PARTS)
    assert sorted(path.name for path in folder.rglob("*")) == sorted(["tables", "a.x", "cache", "kept", FILE])


def test_only_what_changed_is_sent(store: Store, tmp_path: Path) -> None:
    url, folder = fill(store, tables__a="1", tables__b="2"), tmp_path / "copy"
    pull(url, folder, PARTS)
    (folder / "tables/b.x").write_text("22")
    (folder / "tables/n.x").write_text("new")
    sent = store.asked("PUT", lambda: push(url, folder, names(folder)))
    assert sorted(sent) == ["set/tables/b.x", "set/tables/n.x"]
    assert store.asked("PUT", lambda: push(url, folder, names(folder))) == []
    assert store.asked("GET", lambda: pull(url, folder, PARTS)) == []


def test_a_folder_is_replaced_as_a_whole(store: Store, tmp_path: Path) -> None:
    url = fill(store, old="1", views__gone="2", kept="3")
    store.files.pipe_file(f"{url}/old [1].x", b"5")
    store.files.pipe_file(f"{url}/old 1.x", b"6")
    folder = tmp_path / "asset"
    (folder / "views").mkdir(parents=True)
    (folder / "kept.x").write_text("33")
    (folder / "views" / "new [1].x").write_text("4")
    (folder / "old 1.x").write_text("6")
    send_folder(url, folder)
    assert store.keys(url) == ["kept.x", "old 1.x", "views/new [1].x"]
    assert store.files.cat_file(f"{url}/kept.x") == b"33"


def test_a_pull_is_of_one_moment(store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody writes both tables while they are fetched: never one of before and one of after."""
    url, folder = fill(store, tables__a="1", tables__b="1"), tmp_path / "copy"
    fetch, times = mirror.fetch, iter(["2", "3"])

    def disturbed(*args: object) -> None:
        fetch(*args)  # type: ignore[arg-type]
        if (text := next(times, None)) is not None:
            fill(store, tables__a=text, tables__b=text)

    monkeypatch.setattr(mirror, "fetch", disturbed)
    pull(url, folder, PARTS)
    assert [(folder / name).read_text() for name in names(folder)] == ["3", "3"]
    fill(store, tables__a="4")
    monkeypatch.setattr(mirror, "fetch", lambda *_: (fetch(*_), fill(store, tables__a=str(time.time_ns()))))
    with pytest.raises(ObjectsChangedError, match="being written to all the time"):
        pull(url, folder, PARTS)


def test_no_object_is_written_outside(store: Store, tmp_path: Path) -> None:
    url = fill(store, tables__a="1")
    for name in ("tables/../../../evil", "tables//evil", "tables/./evil", "tables/..\\evil"):
        store.files.call_s3("put_object", Bucket=store.url[5:], Key=f"set/{name}", Body=b"evil")
    folder = tmp_path / "deep" / "down" / "copy"
    pull(url, folder, PARTS)
    assert names(folder) == ["tables/a.x"] and not list(tmp_path.rglob("*evil*"))


def test_a_store_that_fails_is_one_line_without_secrets(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(StoreError, match=r"s3://no-such-bucket/x: not there .*bucket") as told:
        list_objects("s3://no-such-bucket/x")
    assert told.value.missing
    assert object_info(f"{store.url}/nothing") is None and list_objects(f"{store.url}/nothing") == {}
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:1")
    monkeypatch.setenv("AWS_MAX_ATTEMPTS", "1")
    type(store.files).clear_instance_cache()
    with pytest.raises(StoreError, match="Could not connect") as told:
        list_objects(f"{store.url}/x")
    line = str(store_usage_error(told.value))
    assert "\n" not in line and SECRET not in line and "endpoint" in line
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.delenv(name)
    type(store.files).clear_instance_cache()
    with pytest.raises(StoreError, match="credentials") as told:
        list_objects(f"{store.url}/x")
    assert told.value.refused
    type(store.files).clear_instance_cache()


def test_a_package_that_is_missing_is_named() -> None:
    pytest.importorskip("fsspec")
    with pytest.raises(UsageError, match="abfs:// needs the package adlfs; `pip install adlfs`"):
        open_store("abfs://container/folder")
    with pytest.raises(UsageError, match="no store is known by 'foo'"):
        open_store("foo://bucket/folder")


def test_copies_are_those_of_this_user(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from asset2sim.storage.objects import cache_root, reading_folder, working_folder

    monkeypatch.delenv("ASSET2SIM_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_root() == tmp_path / "asset2sim"
    folders = {working_folder(f"s3://b/{name}") for name in ("x/out", "y/out", "out")}
    assert len(folders) == 3 and all(folder.name.startswith("out-") for folder in folders)
    assert reading_folder("s3://b/x/out") not in folders
    assert working_folder(Path("out")) == Path("out") and os.fspath(tmp_path)
