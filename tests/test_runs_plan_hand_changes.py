"""Results that people changed: noticed cheaply, kept until --force, and said."""

import os
import shutil
import subprocess
import time
from collections.abc import Iterable
from pathlib import Path

import pytest

from asset2sim.assets.checksums import FILE, changed_files, write_checksums
from asset2sim.catalog.read import read_table
from asset2sim.runs.plan import hand_changes, state
from asset2sim.runs.plan.hand_changes import changes_text, note_written
from asset2sim.runs.plan.state import open_state
from schemas.asset import AssetRecord, AssetRef, Unchanged
from schemas.vocabulary import Method, Redo
from tests.factories import make_record
from tests.incremental_runs import NO_VIEWS, asking, dataset, done, manifest, run

FILES = ("mobility.urdf", "hulls/a.obj", "overlay.json")


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    # Files of a test are always young; that they are not trusted then is a test of its own.
    monkeypatch.setattr(hand_changes, "SETTLED_NS", 0)
    monkeypatch.setattr(state, "SETTLED_NS", 0)
    return dataset(tmp_path / "data")


class Refine:
    """A pipeline that writes a folder as publish does."""

    def __init__(self, out: Path) -> None:
        self.out = out

    def __call__(self, ref: AssetRef) -> AssetRecord:
        folder = self.out / "assets" / ref.asset_id
        shutil.rmtree(folder, ignore_errors=True)
        for name in FILES:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(f"{name} of {ref.asset_id}")
        write_checksums(folder)
        time.sleep(0.02)  # the clock of files ticks in steps of some milliseconds
        return make_record(ref.asset_id, ref=ref)


@pytest.fixture
def out(data: Path, tmp_path: Path) -> Path:
    """The output of a run over the dataset."""
    run(data, tmp_path / "out", make=Refine(tmp_path / "out"))
    return tmp_path / "out"


def ids(unchanged: Iterable[Unchanged]) -> str:
    return "".join(item.asset_id for item in unchanged)


@pytest.mark.system
def test_the_list_is_one_that_sha256sum_checks(tmp_path: Path) -> None:
    Refine(tmp_path)(AssetRef(asset_id="a", path="/a"))
    folder = tmp_path / "assets" / "a"
    subprocess.run(["sha256sum", "--check", "--strict", FILE], cwd=folder, check=True, capture_output=True)
    assert changed_files(folder) == () and changed_files(tmp_path) is None


def test_an_edit_is_kept_said_and_gone_with_force(data: Path, out: Path) -> None:
    refine = Refine(out)
    edited = out / "assets" / "b" / "mobility.urdf"
    edited.write_text("by hand")
    plan = run(data, out, make=refine)
    assert (done(plan), ids(plan.unchanged), dict(plan.by_hand)) == ("", "abcd", {"b": ("mobility.urdf changed",)})
    assert edited.read_text() == "by hand"
    assert changes_text(plan.by_hand, Redo.CHANGED) == (
        "changed by hand since they were refined: b (mobility.urdf changed): kept; --force refines them anew"
    )
    forced = run(data, out, asking(Redo.ALL), make=refine)
    assert (done(forced), tuple(forced.by_hand)) == ("abcd", ("b",))
    assert "refined anew with --force" in (changes_text(forced.by_hand, Redo.ALL) or "")
    after = run(data, out, make=refine)
    assert (done(after), dict(after.by_hand)) == ("", {})


def test_files_that_are_cut_or_gone_are_named(data: Path, out: Path) -> None:
    (out / "assets" / "a" / "overlay.json").write_text("")
    (out / "assets" / "b" / "hulls" / "a.obj").unlink()
    (out / "assets" / "c" / FILE).unlink()
    (out / "assets" / "d" / FILE).write_text("no checksums")
    found = dict(run(data, out, make=Refine(out)).by_hand)
    assert found == {"a": ("overlay.json changed",), "b": ("hulls/a.obj removed",), "c": (f"{FILE} removed",),
                     "d": (f"{FILE} damaged",)}  # fmt: skip


def test_a_changed_input_does_not_overwrite_an_edit(data: Path, out: Path) -> None:
    refine = Refine(out)
    (out / "assets" / "b" / "mobility.urdf").write_text("by hand")
    manifest(data, {"a": "open", "b": "open", "c": "", "d": ""})
    plan = run(data, out, make=refine)
    assert (done(plan), ids(plan.unchanged), tuple(plan.by_hand)) == ("a", "bcd", ("b",))
    other = run(data, out, NO_VIEWS.model_copy(update={"method": Method.DIRECT}), make=refine)
    assert (done(other), ids(other.unchanged), tuple(other.by_hand)) == ("acd", "", ("b",))
    assert (out / "assets" / "b" / "mobility.urdf").read_text() == "by hand"
    assert len(read_table(out, "assets").query("asset_id == 'b'")) == 1


def test_an_edit_outlives_the_state_file(data: Path, out: Path) -> None:
    (out / "assets" / "b" / "mobility.urdf").write_text("by hand")
    (out / state.FILE).unlink()
    plan = run(data, out, make=Refine(out))
    assert (done(plan), tuple(plan.by_hand)) == ("acd", ("b",))


def test_what_is_added_newly_dated_or_signed_is_no_change_and_what_is_gone_is_made_anew(data: Path, out: Path) -> None:
    (out / "assets" / "a" / "views").mkdir()
    (out / "assets" / "a" / "views" / "front.png").write_text("later")
    os.utime(out / "assets" / "b" / "mobility.urdf")
    (out / "assets" / "c" / "mobility.urdf").write_text("by hand")
    write_checksums(out / "assets" / "c")
    shutil.rmtree(out / "assets" / "d")
    plan = run(data, out, make=Refine(out))
    assert (done(plan), ids(plan.unchanged), dict(plan.by_hand)) == ("d", "abc", {})


def test_an_unchanged_night_reads_no_file(data: Path, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[str] = []

    def watched(folder: Path) -> tuple[str, ...] | None:
        read.append(folder.name)
        return changed_files(folder)

    monkeypatch.setattr(hand_changes, "changed_files", watched)
    run(data, out, make=Refine(out))
    assert read == []
    os.utime(out / "assets" / "b" / "mobility.urdf")
    time.sleep(0.02)
    run(data, out, make=Refine(out))
    run(data, out, make=Refine(out))
    assert read == ["b"]


def test_a_folder_that_was_just_written_is_read_the_next_time(tmp_path: Path) -> None:
    out, folders = tmp_path / "out", dataset(tmp_path / "data")
    run(folders, out, make=Refine(out))
    with open_state(out) as opened:
        assert opened.execute("SELECT count(*) FROM outputs").fetchone() == (0,)
        assert hand_changes.hand_changes(opened, out, ["a"], None) == {}


def test_of_a_store_the_listing_tells(tmp_path: Path) -> None:
    with open_state(tmp_path) as opened:
        note_written(opened, tmp_path, ["a", "b"], {"a": "1", "b": "2", "c": "3"})
        there = {"a": "1", "b": "other", "c": "other"}
        assert hand_changes.hand_changes(opened, tmp_path, there, there) == {"b": ("files in the store changed",)}


def test_a_message_names_some_and_counts_the_rest() -> None:
    text = changes_text({f"{number}": ("x changed",) * 30 for number in range(25)}, Redo.CHANGED)
    assert text is not None and "and 15 more: kept" in text and "and 20 more)" in text
    assert changes_text({}, Redo.CHANGED) is None
