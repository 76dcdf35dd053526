"""README and documentation are true: their table is of the sample dataset as it is, what they name exists, and pages
that are made from the schemas are as made."""

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from asset2sim.catalog.read import query
from asset2sim.catalog.write import write_run
from asset2sim.checks.declared_check import failure_guide
from asset2sim.models.gateway.abilities import check_model
from asset2sim.models.gateway.environment import load_litellm
from asset2sim.packs.declared_pack import known_packs
from flows.schedule import nightly_schedule
from lab.pages import reference
from lab.pages.blocks import FOLDER, QUESTIONS, frame_table, markers, question, questions_block, with_block
from schemas.errors import UsageError
from schemas.settings import ModelSettings
from schemas.vocabulary import FailureMode
from tests.assets import ROOT
from tests.factories import make_failure, make_record
from tests.provider_table import PROVIDERS, Provider, provider_table
from tests.samples.bad_assets import bad_assets
from tests.test_catalog_history import night
from tests.test_project_links import unresolved

README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")}
TEXT = "\n".join([README, *PAGES.values()])
BEGIN, END = markers("summary")


def table() -> dict[str, str]:
    block = PAGES["output.md"].split(BEGIN, 1)[1].split(END, 1)[0]
    lines = [line for line in block.splitlines() if line.startswith("| ") and not line.startswith("| --- ")]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return {row[0]: row[2] for row in rows[1:]}


def test_the_summary_table_is_of_the_sample_dataset_as_it_is() -> None:
    with (ROOT / "data/raw/manifest.csv").open(encoding="utf-8", newline="") as stream:
        ids = {row["asset_id"] for row in csv.DictReader(stream)}
    assert set(table()) == ids, "stale: run make flow, then make summary"


def test_the_verdicts_in_the_table_are_those_that_the_planted_defects_must_have() -> None:
    verdicts = table()
    for item in bad_assets():
        allowed = {"ok" if outcome == "none" else str(outcome) for outcome in item.outcomes}
        assert verdicts.pop(item.blueprint.asset_id) in allowed
    assert set(verdicts.values()) == {"ok"}


def test_every_make_target_that_the_readme_names_exists() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = set(re.findall(r"^([a-z-]+):", makefile, flags=re.MULTILINE))
    named = set(re.findall(r"`make ([a-z-]+)|^make ([a-z-]+)", TEXT, flags=re.MULTILINE))
    named = {name for pair in named for name in pair if name}
    assert named and named <= targets


def test_every_table_that_the_readme_names_is_published() -> None:
    catalog = (ROOT / "catalog.yaml").read_text(encoding="utf-8")
    for name in ("assets", "links", "joints", "model_calls", "trace", "findings", "runs"):
        assert f"`{name}`" in TEXT and name in catalog
    assert nightly_schedule(ROOT / "catalog.yaml")[0]


def test_the_pictures_that_the_readme_shows_are_there_and_small() -> None:
    """But for the badge of a workflow, which GitHub draws."""
    for folder, text in ((ROOT, README), *((ROOT / "docs", page) for page in PAGES.values())):
        for picture in re.findall(r"!\[[^\]]*\]\((?!\.\./\.\./actions/)([^)]+)\)", text):
            assert 0 < (folder / picture).stat().st_size < 1_000_000


@pytest.mark.parametrize("name", ["README", *PAGES])
def test_every_page_with_figures_of_the_simulated_model_says_that_it_is_one(name: str) -> None:
    """From a page alone a reader can say which figure is a simulation."""
    text = README if name == "README" else PAGES[name]
    if "prior/noisy" in text and name not in ("dictionary.md", "settings.md"):
        assert "simulation of a fallible model" in " ".join(text.split()), name


def test_the_readme_is_short_and_its_links_are_there() -> None:
    assert len(README.split()) < 900
    links = {link.partition("#")[0] for link in re.findall(r"(?<!!)\[[^\]]+\]\(([^)]+)\)", README)}
    assert {f"docs/{name}" for name in PAGES} - {"docs/index.md", "docs/settings.md", "docs/gallery.md"} <= links


@pytest.mark.parametrize("name", reference.PAGES)
def test_the_pages_from_the_schemas_are_as_made(name: str) -> None:
    assert PAGES[name] == reference.PAGES[name](), "stale: run make docs"


def test_the_table_of_checks_is_as_they_declare() -> None:
    page = PAGES["checks.md"]
    assert page == with_block(page, reference.BLOCK, reference.checks_table()), "stale: run make docs"


def test_every_failure_mode_has_its_cause_and_remedy() -> None:
    assert set(failure_guide()) == set(FailureMode) - {FailureMode.NONE}


def test_every_finding_that_stages_make_is_explained() -> None:
    """Codes as they stand in the sources; those that are put together at run time are seen by whoever queries them."""
    named = {row["code"] for row in reference.finding_rows()}
    sources = [
        path.read_text(encoding="utf-8") for room in ("asset2sim", "tasks") for path in (ROOT / room).rglob("*.py")
    ]
    codes = {code for text in sources for code in re.findall(r'\bcode="([a-z_]+)"', text)}
    codes |= {code for text in sources for code in re.findall(r'\b(?:info|note|warning|error)\(\s*"([a-z_]+)"', text)}
    assert len(codes) > 40 and codes - named == set(), "add them to lab/pages/findings.csv"


@pytest.mark.system
def test_the_documentation_builds_without_a_warning_with_search_and_the_gallery(tmp_path: Path) -> None:
    report = tmp_path / "report"
    (report / "objects" / "a box").mkdir(parents=True)
    (report / "objects" / "a box" / "index.html").write_text("<p>a page</p>")
    (report / "objects" / "a box" / "after.webp").write_bytes(b"")
    (report / "index.html").write_text('<script id="data" type="application/json">{"id":["a box"]}</script>')
    command = [
        sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-d", str(tmp_path / "trees"), "docs",
        str(tmp_path / "html"),
    ]  # fmt: skip
    shown = {**os.environ, "ASSET2SIM_REPORT": str(report)}
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=shown)
    assert done.returncode == 0, done.stderr
    site = tmp_path / "html"
    for name in PAGES:
        assert (site / name.replace(".md", ".html")).is_file()
    assert (site / "search.html").is_file() and '"gallery"' in (site / "searchindex.js").read_text(encoding="utf-8")
    gallery = (site / "gallery.html").read_text(encoding="utf-8")
    assert 'href="report/objects/a%20box/index.html"' in gallery and "report/objects/a%20box/after.webp" in gallery
    assert list(unresolved(site)) == []


def test_every_pack_has_a_page() -> None:
    pages = "\n".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs/consumers").glob("*.md"))
    assert [name for name in known_packs() if f"asset2sim pack OUT --for {name} --out" not in pages] == []


def test_a_block_replaces_the_old_one_and_nothing_else() -> None:
    text = f"before\n{BEGIN}\nold\n{END}\nafter\n"
    assert with_block(text, "summary", "new") == f"before\n{BEGIN}\n\nnew\n\n{END}\nafter\n"
    assert with_block(with_block(text, "summary", "new"), "summary", "new") == with_block(text, "summary", "new")


def test_the_way_of_one_asset_is_that_of_the_pipeline() -> None:
    rows = re.findall(r"^\| (\w+) \| .* \| `(tasks/\w+\.py)` \| (.*) \|$", PAGES["method.md"], flags=re.MULTILINE)
    pipeline = (ROOT / "tasks/pipeline.py").read_text(encoding="utf-8").partition("def run_stages")[2]
    order = [name.lower() for name in re.findall(r"run\(\s*Stage\.(\w+)", pipeline)]
    assert [name for name, _, _ in rows] == list(dict.fromkeys(order))
    assert [module for _, module, _ in rows] == [f"tasks/{name}.py" for name, _, _ in rows]
    modules = [module for _, module, _ in rows]
    places = modules + [place for *_, does in rows for place in re.findall(r"`([^`]+)`", does)]
    assert [place for place in places if not (ROOT / place).exists()] == []


def test_contributing_names_every_room_and_no_other() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = set(re.findall(r"^\| `([a-z0-9_/]+)(?:/|\.py)` \|", text, flags=re.MULTILINE))
    inside = {f"asset2sim/{path.name}" for path in (ROOT / "asset2sim").iterdir() if (path / "__init__.py").is_file()}
    inside |= {f"asset2sim/{path.stem}" for path in (ROOT / "asset2sim").glob("*.py") if path.stem != "__init__"}
    assert named == {"schemas", "tasks", "flows", "lab"} | inside


PAGE = Path(__file__).resolve().parents[1] / "docs/models.md"
LOCAL = "http://127.0.0.1:8000/v1"


@pytest.fixture(autouse=True)
def no_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [name for provider in PROVIDERS for name in provider.variables]
    for name in (*names, "OPENAI_API_BASE", "ANTHROPIC_AUTH_TOKEN"):
        monkeypatch.delenv(name, raising=False)


def test_the_readme_has_the_table_as_it_is_made() -> None:
    assert provider_table() in PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("provider", [p for p in PROVIDERS if p.variables], ids=lambda provider: provider.name)
@pytest.mark.system  # the first import of LiteLLM opens a socket
def test_the_variables_are_those_that_litellm_reads(provider: Provider, monkeypatch: pytest.MonkeyPatch) -> None:
    report = load_litellm().validate_environment(provider.example)
    assert set(report["missing_keys"]) == set(provider.variables)
    for name in provider.variables[: 1 if provider.either else None]:
        monkeypatch.setenv(name, "test-value-0123456789")
    assert load_litellm().validate_environment(provider.example)["keys_in_environment"]
    check_model(ModelSettings(model=provider.example))


@pytest.mark.parametrize(
    "provider", [p for p in PROVIDERS if any(n.endswith("_API_KEY") for n in p.variables)], ids=lambda p: p.name
)
@pytest.mark.system  # as above
def test_a_missing_key_is_a_usage_error_that_names_it(provider: Provider) -> None:
    if provider.name == "Azure OpenAI":
        pytest.skip("a login may stand for its key")
    with pytest.raises(UsageError, match=provider.variables[0]):
        check_model(ModelSettings(model=provider.example))


@pytest.mark.parametrize("provider", [p for p in PROVIDERS if not p.variables], ids=lambda provider: provider.name)
@pytest.mark.system  # as above
def test_servers_of_ones_own_need_none(provider: Provider) -> None:
    address = None if provider.name == "Ollama" else LOCAL
    check_model(ModelSettings(model=provider.example, api_base=address))


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two nights: an asset breaks, another is mended, and one takes long to measure."""
    folder = tmp_path_factory.mktemp("out")
    slow = make_record("slow", seconds={"extract": 1.0, "measure": 99.5})
    write_run(folder, night(1), [make_record("breaks"), make_failure("mended", FailureMode.JAM), slow])
    write_run(folder, night(2), [make_failure("breaks", FailureMode.DRIFT), make_record("mended"), slow])
    return folder


def answer(out: Path, name: str) -> list[tuple[object, ...]]:
    return list(query(out, question(name)[1]).itertuples(index=False, name=None))


def test_every_file_is_a_question_and_runs(out: Path) -> None:
    assert {path.stem for path in (ROOT / FOLDER).glob("*.sql")} == set(QUESTIONS)
    for name in QUESTIONS:
        assert question(name)[0].endswith("?")
        assert answer(out, name), name


def test_the_answers_are_right(out: Path) -> None:
    assert [row[:3] for row in answer(out, "modes")] == [("none", 2, 66.7), ("drift", 1, 33.3)]
    assert answer(out, "changes") == [("breaks", "Box", "none", "drift"), ("mended", "Box", "jam", "none")]
    calls = answer(out, "calls")
    assert calls == [("prior", "overlay", 2, 0, 2400, 0.02), ("prior", "state", 2, 2, 0, 0.0)]
    assert answer(out, "slowest")[0] == ("slow", "Box", 100.5, "measure", 99.5, 2)
    assert answer(out, "weak")[0][:3] == ("Box", 3, 1)


def test_the_documentation_asks_them_all_and_names_files_that_exist(out: Path) -> None:
    begin, end = markers("questions")
    block = (ROOT / "docs/catalog.md").read_text(encoding="utf-8").split(begin, 1)[1].split(end, 1)[0]
    columns = questions_block(out)
    for name in QUESTIONS:
        heading, _, _ = frame_table(query(out, question(name)[1])).partition("\n")
        assert question(name)[0] in block and heading in block and heading in columns, "stale: run make questions"
        assert f"(`{FOLDER}/{name}.sql`)" in block


def test_a_cell_is_never_more_than_text() -> None:
    frame = pd.DataFrame({"a": ["x|y", None], "n": [1.5, None]})
    assert frame_table(frame).splitlines() == ["| a | n |", "| --- | ---: |", "| x\\|y | 1.5 |", "| – | – |"]
