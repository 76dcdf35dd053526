"""The README is true: its table is of the sample dataset as it is, its targets and options exist."""

import csv
import re
import tomllib
from pathlib import Path

from asset2sim.studies.readme.blocks import markers, with_block
from asset2sim.studies.samples.bad_assets import bad_assets
from flows.schedule import nightly_schedule

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BEGIN, END = markers("summary")


def table() -> dict[str, str]:
    block = README.split(BEGIN, 1)[1].split(END, 1)[0]
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
    named = set(re.findall(r"`?make ([a-z-]+)", README)) - {"sure"}
    assert named and named <= targets


def test_every_table_that_the_readme_names_is_published() -> None:
    catalog = (ROOT / "catalog.yaml").read_text(encoding="utf-8")
    for name in ("assets", "links", "joints", "model_calls", "trace", "findings", "runs"):
        assert f"`{name}`" in README and name in catalog
    assert nightly_schedule(ROOT / "catalog.yaml")[0]


def test_the_pictures_that_the_readme_shows_are_there_and_small() -> None:
    pictures = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", README)
    assert pictures
    for picture in pictures:
        assert 0 < (ROOT / picture).stat().st_size < 1_000_000


def test_a_block_replaces_the_old_one_and_nothing_else() -> None:
    text = f"before\n{BEGIN}\nold\n{END}\nafter\n"
    assert with_block(text, "summary", "new") == f"before\n{BEGIN}\n\nnew\n\n{END}\nafter\n"
    assert with_block(with_block(text, "summary", "new"), "summary", "new") == with_block(text, "summary", "new")


def test_the_way_of_one_asset_is_that_of_the_pipeline() -> None:
    rows = re.findall(r"^\| (\w+) \| .* \| `(tasks/\w+\.py)` \| (.*) \|$", README, flags=re.MULTILINE)
    pipeline = (ROOT / "tasks/pipeline.py").read_text(encoding="utf-8")
    order = [name.lower() for name in re.findall(r"run\(\s*Stage\.(\w+)", pipeline)]
    assert [name for name, _, _ in rows] == order
    assert [module for _, module, _ in rows] == [f"tasks/{name}.py" for name, _, _ in rows]
    modules = [module for _, module, _ in rows]
    places = modules + [place for *_, does in rows for place in re.findall(r"`([^`]+)`", does)]
    assert [place for place in places if not (ROOT / place).exists()] == []


def test_contributing_names_every_room_and_no_other() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = set(re.findall(r"^\| `([a-z0-9_/]+)(?:/|\.py)` \|", text, flags=re.MULTILINE))
    inside = {f"asset2sim/{path.name}" for path in (ROOT / "asset2sim").iterdir() if (path / "__init__.py").is_file()}
    inside |= {f"asset2sim/{path.stem}" for path in (ROOT / "asset2sim").glob("*.py") if path.stem != "__init__"}
    assert named == {"schemas", "tasks", "flows"} | inside
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    (rooms,) = (item["layers"] for item in contracts if item.get("containers") == ["asset2sim"])
    assert {f"asset2sim/{room}" for layer in rooms for room in layer.split(" | ")} == inside
