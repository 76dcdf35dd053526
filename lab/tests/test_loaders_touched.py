"""Every check of the verdict by every way in which users get an object, on two refined samples."""

from pathlib import Path

import pytest

from asset2sim.assets.exports.mjcf import export_mjcf
from asset2sim.assets.folder import URDF_NAME
from asset2sim.checks.mechanism import mechanism
from asset2sim.checks.opening import openings
from lab.loaders.routes import plain_mjcf, routes
from lab.loaders.touched import TouchedRow, touch_all, touched_table
from tests.assets import RAW
from tests.commands import one_after_the_other
from tests.exported import FRICTION, arm
from tests.interaction_objects import SETTINGS

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
