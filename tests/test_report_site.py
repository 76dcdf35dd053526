"""The report's files: which are made anew, from where, and what becomes of bad ones."""

import json
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from PIL import Image

from asset2sim.catalog.read import read_table
from asset2sim.catalog.run import finish_run, start_run
from asset2sim.catalog.write import write_run
from asset2sim.models.gateway import questions
from asset2sim.models.gateway.answer_cache import FOLDER, StoredAnswer, store_answer
from asset2sim.models.gateway.questions import keep_question, read_question
from asset2sim.report.index_page import figures, index_page
from asset2sim.report.site import write_report_of, write_site
from asset2sim.report.snapshot import NEEDED, read_snapshot
from schemas.alignment import Score
from schemas.asset import AssetRecord
from schemas.errors import UsageError
from schemas.request import LabelledImage, ModelRequest, Turn
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Method
from tests.factories import make_alignment, make_call, make_failure, make_record
from tests.object_store import Store
from tests.refined_things import drawer

REQUEST = ModelRequest(purpose="synthesis", system="Answer <b>well</b>.", text="Box & lid <script>alert(1)</script>")


def published(out: Path, *records: AssetRecord, dataset: str = "dataset") -> None:
    write_run(out, finish_run(start_run(Settings(), dataset)), list(records))


def stamps(out: Path) -> dict[str, int]:
    return {path.parent.name: path.stat().st_mtime_ns for path in (out / "report/objects").glob("*/index.html")}


def page(out: Path, asset_id: str) -> str:
    return (out / "report/objects" / asset_id / "index.html").read_text(encoding="utf-8")


def test_only_pages_of_what_changed_are_made_anew_and_those_of_what_is_gone_go(tmp_path: Path) -> None:
    published(tmp_path, *(make_record(name) for name in "abc"))
    assert (write_site(tmp_path).written, write_site(tmp_path).written) == (3, 0)
    before = stamps(tmp_path)
    published(tmp_path, make_failure("b", FailureMode.TIMEOUT))
    site = write_site(tmp_path)
    after = stamps(tmp_path)
    assert site.written == 1 and site.pages == 3 and {name for name in after if after[name] != before[name]} == {"b"}
    assert "timeout" in page(tmp_path, "b")
    assert 'href="../a/index.html">previous: a' in page(tmp_path, "b") and 'rel="next" href="../c/' in page(
        tmp_path, "b"
    )
    (tmp_path / "report/objects/c/drop.webp").write_bytes(b"a loop")
    assert write_site(tmp_path).written == 1 and 'src="drop.webp"' in page(tmp_path, "c")
    (tmp_path / "motions/a/box-close").mkdir(parents=True)
    (tmp_path / "motions/a/box-close/motion.mp4").write_bytes(b"a film")
    assert write_site(tmp_path).written == 1
    assert 'href="../../../motions/a/box-close/motion.mp4">box-close</a>' in page(tmp_path, "a")
    run = finish_run(start_run(Settings(), "dataset"))
    write_run(tmp_path, run, [make_record("a")], present={"a", "b"})
    write_site(tmp_path)
    assert set(stamps(tmp_path)) == {"a", "b"} and not (tmp_path / "report/objects/c").exists()
    assert write_site(tmp_path, anew=True).written == 2


def test_the_figures_stand_beside_those_of_the_run_before_over_the_same(tmp_path: Path) -> None:
    published(tmp_path, make_record("a"), make_failure("b", FailureMode.TIMEOUT))
    assert {figure.name for figure in figures(read_snapshot(tmp_path))} & {"new failures", "mended"} == set()
    published(tmp_path, make_record("x"), dataset="another")
    published(tmp_path, make_failure("a", FailureMode.DRIFT), make_record("b"))
    found = {figure.name: figure for figure in figures(read_snapshot(tmp_path))}
    assert found["pass"].now == "1 of 2" and found["pass"].then == "1 of 2" and found["pass"].change == "same"
    assert found["new failures"].now == found["mended"].now == "1"
    values = index_page(read_snapshot(tmp_path), set())
    data = values["data"]
    assert dict(zip(data["id"], data["change"], strict=True)) == {"a": 1, "b": 2, "x": 0}
    categories, methods, months = values["groups"]
    assert values["modes"] == ("drift",) and categories.lines == (("Box", 3, "66.7 %", (1,)),)
    assert methods.lines == (("asset2sim, prior/household", 3, "66.7 %", (1,)),)
    assert months.lines == ((f"{datetime.now(UTC):%Y-%m}", 2, "50.0 %", (1,)),)


def test_the_index_reads_the_columns_that_it_shows_and_no_others(tmp_path: Path) -> None:
    # All columns of ten thousand assets took 410 MB, these take 180.
    published(tmp_path, make_record("a"))
    found = read_snapshot(tmp_path)
    columns = {name: set(frame.columns) for name, frame in found.tables.items()} | {"assets": set(found.assets[0])}
    wanted = {name: part.columns for name, part in NEEDED.items() if part.columns is not None}
    assert {name: columns[name] for name in wanted} == {name: set(of) for name, of in wanted.items()}


def test_of_several_methods_the_page_is_of_the_last_and_the_index_has_all(tmp_path: Path) -> None:
    published(tmp_path, make_record("a", method=Method.DIRECT, reason="by the first"))
    published(tmp_path, make_record("a"))
    write_site(tmp_path)
    assert "Also refined by" in page(tmp_path, "a") and "direct" in page(tmp_path, "a")
    assert len(index_page(read_snapshot(tmp_path), set())["data"]["id"]) == 2


def test_a_page_has_a_row_for_each_further_check_that_was_run(tmp_path: Path) -> None:
    contents = {"contents": 0.5, "contents_interiors": 2, "contents_room_l": 3.25, "contents_free": 0.875}
    reason = {"contents_reason": "drawer: the ball <falls> through"}
    published(tmp_path, make_record("a", further=contents | reason), make_record("b"))
    write_site(tmp_path)
    row = page(tmp_path, "a").split('id="further"')[1].split("</table>")[0]
    said = "<td>0.500, interiors 2, room 3.25 l, free 0.875, reason drawer: the ball &lt;falls&gt; through</td>"
    assert said in row and row.count("<tr>") == 1 and 'id="further"' not in page(tmp_path, "b")


@pytest.mark.parametrize(
    ("score", "said"), [(1.0, "✓ met"), (0.797, "79 % met"), (0.9999, "99 % met"), (0.0, "✗ missed")]
)
def test_what_was_asked_is_met_as_far_as_the_catalog_says(score: float, said: str, tmp_path: Path) -> None:
    half = Score(value=0.5, reason="half")
    alignment = make_alignment(scale=Score(value=score, reason="a small Box"), state=half)
    published(tmp_path, make_record("a", alignment=alignment))
    write_site(tmp_path)
    table = page(tmp_path, "a").split('id="asked"')[1].split("</table>")[0]
    (row,) = [line for line in table.split("<tr>") if "a small Box" in line]
    assert said in row and table.count(" met<") + table.count("missed<") == 2, "the size and the state, and no more"


def test_questions_and_answers_are_shown_word_for_word_and_never_obeyed(tmp_path: Path) -> None:
    call = make_call(prompt_hash="0123456789abcdef", answer_file=f"{'7' * 64}.json")
    keep_question(tmp_path / questions.FOLDER, call.prompt_hash, REQUEST)
    kept = StoredAnswer(model=call.model, purpose="synthesis", prompt_hash=call.prompt_hash, content='{"scale": 0.5}')
    store_answer(tmp_path / FOLDER, "7" * 64, kept)
    evil = "<img src=x onerror=alert(1)></script><script>alert(2)</script>"
    published(tmp_path, make_record("a", calls=(call,), category=evil), make_record("b"))
    write_site(tmp_path)
    text = page(tmp_path, "a")
    assert "Box &amp; lid &lt;script&gt;" in text and "&#34;scale&#34;: 0.5" in text
    (system,) = (tmp_path / "report/prompts").glob("*.txt")
    assert system.read_text(encoding="utf-8") == REQUEST.system and f"prompts/{system.name}" in text
    assert "Not kept here" in page(tmp_path, "b")
    index = (tmp_path / "report/index.html").read_text(encoding="utf-8")
    assert "<img src=x" not in index + text and index.count("</script>") == 2


def test_of_a_conversation_the_longest_question_is_kept(tmp_path: Path) -> None:
    longer = REQUEST.model_copy(
        update={"turns": (Turn(role="assistant", content="first"), Turn(role="user", content="?"))}
    )
    for asked in (REQUEST, longer, REQUEST):
        keep_question(tmp_path, "abc", asked)
    found = read_question(tmp_path, "abc")
    assert found is not None and [turn.content for turn in found.turns] == ["first", "?"]
    pictured = longer.model_copy(update={"images": (LabelledImage(label="front", png=b"png"),)})
    keep_question(tmp_path, "abc", pictured)
    assert (found := read_question(tmp_path, "abc")) is not None and found.images == ("front",)
    (tmp_path / "abc.json").write_text("{")
    assert read_question(tmp_path, "abc") is None


def test_names_of_any_kind_have_pages_that_the_index_finds(tmp_path: Path) -> None:
    names = ("a b", "100%", "ü#1")
    published(tmp_path, *(make_record(name) for name in names))
    write_site(tmp_path)
    assert set(stamps(tmp_path)) == set(names)


def test_a_damaged_state_makes_all_anew_and_a_folder_without_runs_is_an_error(tmp_path: Path) -> None:
    published(tmp_path, make_record("a"))
    write_site(tmp_path)
    (tmp_path / "report/pages.json").write_text("{")
    assert write_site(tmp_path).written == 1 and "a" in json.loads((tmp_path / "report/pages.json").read_text())
    with pytest.raises(UsageError, match="no catalog"):
        write_site(tmp_path / "empty")


def view(out: Path, asset_id: str, colour: str) -> Path:
    file = out / "assets" / asset_id / "views/perspective.png"
    file.parent.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", (32, 32), colour).save(file)
    return file


def pictures(out: Path, asset_id: str) -> set[str]:
    return {path.name for path in (out / "report/objects" / asset_id).glob("*.webp")}


def test_pictures_are_made_of_the_views_that_are_there_and_again_when_those_change(tmp_path: Path) -> None:
    published(tmp_path, make_record("a"), make_record("b"))
    view(tmp_path, "a", "red")
    write_site(tmp_path, before=False)
    assert (pictures(tmp_path, "a"), pictures(tmp_path, "b")) == ({"after.webp", "thumb.webp"}, set())
    assert "No pictures" in page(tmp_path, "b") and '"picture":[1,0]' in (tmp_path / "report/index.html").read_text()
    red = (tmp_path / "report/objects/a/thumb.webp").read_bytes()
    view(tmp_path, "a", "blue")
    view(tmp_path, "b", "blue")
    write_site(tmp_path, before=False)
    assert (tmp_path / "report/objects/a/thumb.webp").read_bytes() != red
    assert 'src="after.webp"' in page(tmp_path, "b"), "drawn later"


def test_a_run_without_pictures_of_what_came_leaves_those_that_there_are(tmp_path: Path) -> None:
    published(tmp_path, make_record("a"))
    view(tmp_path, "a", "red")
    write_site(tmp_path, before=True)
    came = tmp_path / "report/objects/a/before.webp"
    came.write_bytes(b"as it came")
    write_site(tmp_path, before=False)
    assert came.is_file()
    published(tmp_path, make_record("a"))
    write_site(tmp_path, before=False)
    assert not came.exists(), "another refinement, perhaps of other files"


@pytest.mark.system
def test_a_run_draws_what_failed_moving_and_the_command_draws_the_rest(tmp_path: Path) -> None:
    for name in "ab":
        drawer(tmp_path / "assets" / name)
        view(tmp_path, name, "red")
    failed = make_failure("b", FailureMode.EFFORT).model_copy(update={"ref": make_record("b").ref, "written": True})
    published(tmp_path, make_record("a"), failed)
    loops = {"sweep.webp", "release.webp"}
    write_site(tmp_path, loops=False)
    assert "size.webp" in pictures(tmp_path, "a") and not loops & pictures(tmp_path, "a")
    assert "asset2sim report --out" in page(tmp_path, "a") and loops <= pictures(tmp_path, "b")
    before = (tmp_path / "report/objects/b/sweep.webp").stat().st_mtime_ns
    assert write_site(tmp_path).written == 1 and loops <= pictures(tmp_path, "a")
    assert 'src="sweep.webp"' in page(tmp_path, "a") and "asset2sim report --out" not in page(tmp_path, "a")
    assert write_site(tmp_path, loops=False).written == 0 and loops <= pictures(tmp_path, "a"), "those there are stay"
    assert (tmp_path / "report/objects/b/sweep.webp").stat().st_mtime_ns == before


@pytest.mark.system
def test_what_came_is_drawn_again_only_where_it_or_what_was_made_of_it_is_another(tmp_path: Path) -> None:
    raw, out = drawer(tmp_path / "raw") / "mobility.urdf", tmp_path / "out"
    drawer(out / "assets/a")
    record = make_record("a")
    record = record.model_copy(update={"ref": record.ref.model_copy(update={"path": str(raw.parent)})})
    came = out / "report/objects/a/before.webp"

    def drawn(colour: str) -> bytes:
        published(out, record)
        view(out, "a", colour)
        write_site(out, loops=False)
        return came.read_bytes()

    assert drawn("red").startswith(b"RIFF")
    came.write_bytes(b"as it came")
    assert drawn("blue") == b"as it came", "refined again, to the same"
    raw.write_text(raw.read_text().replace("</robot>", "<!-- another --></robot>"))
    assert drawn("blue").startswith(b"RIFF")


@pytest.mark.system
def test_the_report_of_a_bucket_lies_in_the_bucket_whichever_machine_writes_it(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, there = tmp_path / "here", f"{store.url}/out"
    published(here, make_record("a"), make_record("b"))
    view(here, "a", "red")
    store.put(here, there)
    for machine in ("one", "another"):
        monkeypatch.setenv("ASSET2SIM_CACHE", str(tmp_path / machine))
        site = write_report_of(there)
        assert site.written == (2 if machine == "one" else 0)
    kept = {name.removeprefix("report/") for name in store.keys(there) if name.startswith("report/")}
    assert kept >= {"index.html", "report.css", "objects/a/thumb.webp", "objects/b/index.html"}
    index = store.files.cat_file(f"{there}/report/index.html").decode()
    assert '"picture":[1,0]' in index
    write_run(here, finish_run(start_run(Settings(), "dataset")), [make_record("a")], present={"a"})
    store.put(here / "catalog", f"{there}/catalog")
    store.put(here / "history", f"{there}/history")
    write_report_of(there)
    left = {name for name in store.keys(there) if name.startswith("report/objects/")}
    assert not any(name.startswith("report/objects/b/") for name in left)
    text = store.files.cat_file(f"{there}/report/objects/a/index.html").decode()
    assert 'src="after.webp"' in text and "report/objects/a/after.webp" in left


@pytest.mark.system
def test_the_loops_of_a_buckets_objects_are_made_of_its_files_and_lie_beside_their_pages(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, there = tmp_path / "here", f"{store.url}/moving"
    published(here, make_record("a"))
    drawer(here / "assets/a")
    view(here, "a", "red")
    store.put(here, there)
    for machine in ("one", "another"):
        monkeypatch.setenv("ASSET2SIM_CACHE", str(tmp_path / machine))
        assert write_report_of(there).written == (1 if machine == "one" else 0)
    place = f"{there}/report/objects/a"
    text = store.files.cat_file(f"{place}/index.html").decode()
    for name in ("sweep.webp", "release.webp"):
        assert f'src="{name}"' in text
        with Image.open(BytesIO(store.files.cat_file(f"{place}/{name}"))) as loop:
            assert loop.n_frames > 10  # type: ignore[attr-defined]


def test_an_output_of_an_earlier_version_has_its_report(tmp_path: Path) -> None:
    published(tmp_path, make_record("a"))
    file = tmp_path / "catalog" / "assets.parquet"
    whole = pq.read_table(file)
    later = ["authored_json", "kept", "mended", "supplied", "doubtful"]
    pq.write_table(whole.drop_columns(later), file)
    assert write_site(tmp_path).written == 1 and "refined by" in page(tmp_path, "a")
    assert read_table(tmp_path, "assets")[later].isna().all(axis=None)
