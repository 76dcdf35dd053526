"""Every check of the verdict by every way in which users get an object, on two refined samples."""

import pytest

from lab.loaders.routes import routes
from lab.loaders.touched import TouchedRow, touch_all, touched_table
from tests.assets import RAW
from tests.commands import one_after_the_other

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
