"""Stamps of measured blocks: one changed by hand is found by its numbers, one that the code left behind is named."""

import os
import subprocess
from pathlib import Path

import grimp
import pytest

from lab.pages import figures
from lab.pages.blocks import block_of, markers, with_block, write_block
from lab.pages.figures import FIGURES, edited, make_figures, measured_blocks, stale
from lab.pages.stamp import NO_HASH, SOURCES, code_hash, models_of, split_stamp, text_hash
from schemas.errors import UnknownChoiceError, UsageError

DOCS = Path(__file__).resolve().parents[2] / "docs"
ENTRIES = {
    "questions": "lab.pages.blocks", "loaders": "lab.loaders.loader_table", "held": "lab.loaders.held_table",
    "weights": "lab.weights.compare", "judged": "lab.flows.record_motion", "learn": "lab.flows.learn",
    "probe": "lab.flows.probe", "dataset": "lab.comparisons.dataset_table",
    **dict.fromkeys(("rules", "withheld", "origins", "corrections"), "lab.flows.compare"),
    **dict.fromkeys(("first", "compare", "shapes"), "lab.flows.compare_methods"),
}  # fmt: skip
"""Block → the module that makes it."""
TOLD_ONLY = ("lab.pages", "lab.options", "lab.runner", "lab.schemas.tables_", "lab.extension")
"""Modules that spread work, name columns and write pages, and decide no figure."""
TABLE = "| a | b |\n| --- | --- |\n| prior/noisy | 91 % |"


@pytest.fixture
def docs(tmp_path: Path) -> Path:
    """Pages with every measured block, each as it is when it was just made."""
    page = tmp_path / "page.md"
    page.write_text("\n".join(f"{markers(name)[0]}\n{markers(name)[1]}" for name in SOURCES), encoding="utf-8")
    for name in SOURCES:
        write_block(page, name, TABLE)
    return tmp_path


def test_no_number_of_a_measured_block_was_changed_by_hand() -> None:
    assert edited(DOCS) == [], "make figures ONLY=these, or undo the change"


def test_no_block_names_a_folder_of_one_machine() -> None:
    assert not [name for name, (_, text, _) in measured_blocks(DOCS).items() if "recorded//" in text]


def test_blocks_that_are_older_than_what_they_measure_are_named() -> None:
    older = stale(DOCS)
    assert set(older) <= set(FIGURES) == set(SOURCES)
    if older:
        pytest.xfail(f"older than the code, prompts or tables that they measure: {', '.join(older)}; make figures")


def test_a_fresh_block_says_where_it_comes_from(docs: Path) -> None:
    page, text, stamp = measured_blocks(docs)["compare"]
    assert text == TABLE and page == docs / "page.md" and stamp is not None
    assert stamp.models == "model prior/noisy (simulation of a fallible model)"
    assert (
        stamp.command == "make figures ONLY=compare" and "cores" in stamp.machine and stamp.code == code_hash("compare")
    )
    assert split_stamp(f"{TABLE}\n\n{stamp.line}") == (TABLE, stamp)
    assert models_of("first", "| recorded/../shared/vlm_answers |") == "model recorded/../shared/vlm_answers"
    assert models_of("learn", "| 100 % |").startswith("model prior/noisy (sim")
    assert edited(docs) == stale(docs) == []


def test_a_number_that_is_changed_by_hand_is_found(docs: Path) -> None:
    page = docs / "page.md"
    text = page.read_text(encoding="utf-8")
    old = block_of(text, "learn") or ""
    page.write_text(with_block(text, "learn", old.replace("91 %", "92 %")), encoding="utf-8")
    assert edited(docs) == ["learn"] and stale(docs) == []
    page.write_text(with_block(text, "probe", TABLE), encoding="utf-8")
    assert edited(docs) == stale(docs) == ["probe"], "no stamp at all"


def test_a_block_is_older_once_a_table_or_a_line_of_code_changes_and_not_with_a_comment(
    docs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    room = tmp_path / "checkout" / "lab" / "weights"
    room.mkdir(parents=True)
    monkeypatch.setattr("lab.pages.stamp.source_version", lambda root: "the product")
    source, table = room / "compare.py", room / "reference.csv"
    source.write_text("LIMIT = 2  # of what\n", encoding="utf-8")
    table.write_text("what,kg\nlaptop,1.4\n", encoding="utf-8")
    root = tmp_path / "checkout"
    before = code_hash("weights", root)
    source.write_text('"""Says what."""\n\nLIMIT = 2\n', encoding="utf-8")
    assert code_hash("weights", root) == before != NO_HASH
    table.write_text("what,kg\nlaptop,1.5\n", encoding="utf-8")
    changed = code_hash("weights", root)
    source.write_text("LIMIT = 3\n", encoding="utf-8")
    assert len({before, changed, code_hash("weights", root)}) == 3
    codes = {name: stamp.code for name, (_, _, stamp) in measured_blocks(docs).items() if stamp is not None}
    monkeypatch.setattr(figures, "code_hash", {**codes, "first": "another"}.__getitem__)
    assert stale(docs) == ["first"] and edited(docs) == []


def test_every_room_that_a_study_imports_is_in_its_hash() -> None:
    """But for the product's that decide an asset's result, which are in every hash."""
    graph = grimp.build_graph("lab", "asset2sim")
    assert set(ENTRIES) == set(SOURCES) - {"summary"}
    for name, entry in ENTRIES.items():
        rooms = tuple(room.removesuffix(".py").replace("/", ".") for room in SOURCES[name])
        for module in {entry, *graph.find_upstream_modules(entry)}:
            decides = module.startswith(("lab.", "asset2sim.load", "asset2sim.gym")) and "." in module
            packages = graph.find_children(module)
            if decides and not packages and not module.startswith(TOLD_ONLY):
                assert any(f"{module}.".startswith(f"{room}.") for room in rooms), f"{name}: {module}"


def test_a_recorded_answer_that_is_edited_makes_its_tables_older(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lab.pages.stamp.source_version", lambda root: "the product")
    (tmp_path / "lab/answers").mkdir(parents=True)
    (tmp_path / "lab/flows").mkdir()
    files = (tmp_path / "lab/answers/9912.json", tmp_path / "lab/flows/compare_methods.py")
    for file, text in zip(files, ('{"scale": 1}', "A = 1"), strict=True):
        file.write_text(text, encoding="utf-8")
    before = {name: code_hash(name, tmp_path) for name in SOURCES}
    files[0].write_text('{"scale": 2}', encoding="utf-8")
    after = {name: code_hash(name, tmp_path) for name in SOURCES}
    assert {name for name in SOURCES if before[name] != after[name]} == {"first", "shapes"}
    files[1].write_text("A = 2", encoding="utf-8")
    changed = {name for name in SOURCES if code_hash(name, tmp_path) != after[name]}
    assert changed == {"first", "compare", "shapes"}


def test_only_what_is_older_is_made_and_a_step_once(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    ran: list[str] = []

    class Done:
        returncode = 0

    def run(words: str, shell: bool) -> Done:
        ran.append(words.removeprefix("make --no-print-directory "))
        return Done()

    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(figures, "stale", lambda docs: ["questions", "summary"])
    (tmp_path / "partnet_mobility").mkdir()
    make_figures(tmp_path, Path("out"))
    assert ran == ["flow OUT=out/samples", "summary OUT=out/samples", "questions OUT=out/samples"]
    ran.clear()
    make_figures(tmp_path, Path("out"), ["weights"])
    assert ran == [f"weights SHARED={os.path.relpath(tmp_path)}"], "no folder of one machine is published"
    with pytest.raises(UnknownChoiceError, match="wieghts"):
        make_figures(tmp_path, Path("out"), ["wieghts"])
    with pytest.raises(UsageError, match="SHARED="):
        make_figures(tmp_path / "none", Path("out"))
    Done.returncode = 2
    with pytest.raises(UsageError, match="goes on from here"):
        make_figures(tmp_path, Path("out"))


def test_every_step_is_a_target_of_the_makefile() -> None:
    targets = (DOCS.parent / "Makefile").read_text(encoding="utf-8")
    for steps in FIGURES.values():
        for step in steps:
            assert f"\n{step.split()[0]}: " in targets, step
    assert text_hash(" x\n") == text_hash("x")
