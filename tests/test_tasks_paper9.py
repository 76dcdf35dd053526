"""The paper's nine objects: refined, hardly any overlap, at rest, and a drop from 5 cm does not make them explode."""

from pathlib import Path

import pytest

from asset2sim.checks.rest import observe
from schemas.vocabulary import Engine, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, prior, sample
from tests.marks import OBJECTS, needs_objects

pytestmark = [pytest.mark.system, needs_objects]

NINE = ("103275", "19179", "102181", "100221", "9912", "7236", "101673", "103755", "102703")
PENETRATION_M = 5e-4
FASTEST_M_S = 6.0
DROP_M = 0.05


@pytest.mark.parametrize("asset_id", NINE)
def test_an_object_is_interaction_ready_and_survives_a_drop(asset_id: str, tmp_path: Path) -> None:
    record = refine_asset(sample(asset_id, OBJECTS), tmp_path, NO_VIEWS, prior)
    assert record.status is Status.OK, record.reason
    assert record.overlay is not None and record.measurement is not None
    assert record.measurement.penetration_m <= PENETRATION_M
    assert record.measurement.console == ()
    urdf = tmp_path / "assets" / asset_id / "mobility.urdf"
    states, friction = record.overlay.initial_positions, record.overlay.contact_friction
    dropped = observe(Engine.PYBULLET, urdf, states, friction, DROP_M, NO_VIEWS.engine)
    # Falling 5 cm ends at 1 m/s: the object did fall, and nothing was flung.
    assert 0.8 <= dropped.peak_speed <= FASTEST_M_S
