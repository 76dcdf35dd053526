"""The rows on engines' own loaders, measured again in every engine, and every check by every way to load."""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from asset2sim.assets.exports.mjcf import export_mjcf
from asset2sim.assets.folder import URDF_NAME
from asset2sim.checks.mechanism import mechanism
from asset2sim.checks.opening import openings
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
from lab.loaders.routes import plain_mjcf, routes
from lab.loaders.touched import TouchedRow, touch_all, touched_table
from lab.pages.blocks import main, markers
from schemas.errors import UsageError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, RAW, prior, sample
from tests.commands import one_after_the_other
from tests.engine_worlds import every_engine
from tests.exported import FRICTION, arm
from tests.interaction_objects import SETTINGS

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


SAMPLES = ("trashcan_pedal", "laptop_silver")
"""A light part that a spring returns, an armature and a friction hinge; a lid that holds."""
KNOWN = {("trashcan_pedal", "USD"): "reset"}
"""UsdPhysics has no rolling friction: read back, a round bin that is tilted rolls on."""


@pytest.fixture(scope="module")
def rows(tmp_path_factory: pytest.TempPathFactory, prefect_server: str) -> list[TouchedRow]:
    out = tmp_path_factory.mktemp("touched")
    options = ["--export", "mjcf,usd", "--no-views", "--no-report", "--workers", "1", "--assets", ",".join(SAMPLES)]
    one_after_the_other([["refine", str(RAW), "--out", str(out), *options]], prefect_server)
    return touch_all(out, out / "rows", None, 0, ())


@pytest.mark.system
def test_what_users_touch_passes_what_the_verdict_says(rows: list[TouchedRow]) -> None:
    assert {(row.asset_id, row.route) for row in rows} == {(name, way.name) for name in SAMPLES for way in routes()}
    for row in rows:
        allowed = KNOWN.get((row.asset_id, row.route), "none")
        assert not [one for one in row.failures if not one.startswith(allowed)], row
        assert row.n_efforts and not row.efforts, row


@pytest.mark.system
def test_the_table_counts_ways(rows: list[TouchedRow]) -> None:
    bad = rows[0].model_copy(update={"failures": ("hold: it falls",), "efforts": ("j: 1 N, the catalog 2 N",)})
    table = touched_table([bad, *rows[1:]])
    assert f"| {bad.route} | 1 of 2 | {bad.n_efforts + rows[len(routes())].n_efforts - 1} of" in table
    assert "hold 1" in table


@pytest.mark.system
def test_a_dial_takes_the_same_by_its_mjcf_whose_clicks_are_sines(tmp_path: Path) -> None:
    """0.1 N·m of the click and 0.02 of friction: a sine is at its most a quarter of the way, and less beyond."""
    overlay = arm(tmp_path, bias=(-5.0, 0.0, -0.1, 0.1, 0.5), type="continuous", damping=0.01, friction=0.02)
    export_mjcf(tmp_path, overlay, SETTINGS.timestep_s)
    urdf = tmp_path / URDF_NAME
    with plain_mjcf(urdf, plane=False, timestep_s=SETTINGS.timestep_s, contact_friction=FRICTION) as world:
        (record,) = openings(world, mechanism(urdf, overlay), SETTINGS)
    assert record.opening == pytest.approx(0.12, rel=0.05) and record.closing == pytest.approx(0.12, rel=0.05)
