"""What is said of engines' own loaders is so: every yes and no is measured again, in every installed engine."""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from asset2sim.engines.registry import installed
from lab.loaders.loader_table import (
    BLOCK,
    BOX,
    BUCKET,
    ELSEWHERE,
    LID,
    MODULES,
    PEDAL,
    ROWS,
    SampleObjects,
    compared,
    measured,
    samples_of,
)
from lab.pages.blocks import main, markers
from schemas.errors import UsageError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, prior, sample
from tests.engine_worlds import every_engine

PAGE = (Path(__file__).resolve().parents[2] / "docs/load.md").read_text(encoding="utf-8")


def tables() -> list[list[list[str]]]:
    """The block's two tables, as rows of cells, headings first."""
    begin, end = markers(BLOCK)
    parts = PAGE.split(begin, 1)[1].split(end, 1)[0].split("\n\n")
    rows = [[line for line in part.strip().splitlines() if not line.startswith("| ---")] for part in parts]
    found = [part for part in rows if part and part[0].startswith("|")]
    return [[[cell.strip() for cell in line.strip("|").split("|")] for line in part] for part in found]


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SampleObjects]:
    out = tmp_path_factory.mktemp("out")
    settings = NO_VIEWS.model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,))})
    for name in (LID, PEDAL, BUCKET, BOX):
        refine_asset(sample(name), out, settings, prior)
    with samples_of(out) as found:
        yield found


@pytest.mark.system
@every_engine
def test_every_yes_and_no_is_what_the_engine_does(engine: Engine, samples: SampleObjects) -> None:
    ways = import_module(MODULES[engine]).LOADERS
    (headings, *rows), _ = tables()
    cells = measured(samples, ways)
    assert {row[0] for row in rows} == set(cells)
    for name, *said in rows:
        for way in ways:
            found = cells[name][way.name]
            stated = said[headings[1:].index(way.name)].split(":")[0]
            assert stated == found.verdict, f"{name}, {way.name}: {found.text}; stale: run make flow, then make loaders"


@pytest.mark.system
def test_our_mjcf_loses_nothing_and_holds_its_lid(samples: SampleObjects) -> None:
    if Engine.MUJOCO not in installed():
        pytest.skip("MuJoCo is not installed")
    urdf, mjcf = import_module(MODULES[Engine.MUJOCO]).LOADERS
    cells = measured(samples, (urdf, mjcf))
    assert {cells[name][mjcf.name].verdict for name in ROWS} == {"yes"}
    held = cells["held lid stays, 3 s"]
    assert held[mjcf.name].verdict == "yes" and held[urdf.name].verdict == "no"


def test_the_block_has_every_row_every_engine_and_the_ones_not_measured_apart() -> None:
    measured_here, elsewhere = tables()
    assert [row[0] for row in measured_here[1:]] == list(ROWS), "stale: run make loaders"
    assert [row[0] for row in elsewhere[1:]] == [name for name, *_ in ELSEWHERE]
    for engine in Engine:
        assert engine.value in PAGE.split(markers(BLOCK)[0], 1)[1].split(markers(BLOCK)[1], 1)[0]
    assert {cell.split(":")[0] for row in measured_here[1:] for cell in row[1:]} <= {"yes", "no", "partly"}


def test_a_term_is_honoured_within_a_tenth() -> None:
    assert compared(0.92, 1.0, "N·m").text == "yes"
    assert compared(0.85, 1.0, "N·m").text == "no: 0.85 N·m"


def test_an_output_without_the_samples_is_a_mistake(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UsageError, match="no refined 'laptop_silver'"), samples_of(tmp_path):
        pass
    (tmp_path / "PAGE.md").write_text("nothing", encoding="utf-8")
    assert main(["loaders", str(tmp_path), str(tmp_path / "PAGE.md")]) == 2
    assert "lacks the lines" in capsys.readouterr().err
