"""Ropes, hoses and chains: links that cross pieces join pass each other, held ones hang."""

import math
from collections.abc import Sequence
from pathlib import Path

import pytest
from lxml import etree

from asset2sim.assets.urdf.read import passing_pairs
from asset2sim.intake.origin import crossing
from schemas.asset import AssetRef
from schemas.settings import EngineSettings
from schemas.support import SupportKind
from schemas.vocabulary import Engine, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, joint, link, prior, robot, shape, written

PIECE = shape("0.1 0.02 0.02", xyz="0.05 0 0")


def rope(pieces: int, *, first: str = "", axes: Sequence[str] = ("0 1 0", "0 0 1")) -> str:
    """A rope that stands out from a hook along x, each piece on a cross of hinges that meet in a point."""
    parts = [link("hook", first or shape("0.05 0.2 0.2", xyz="-0.03 0 0"))]
    above, at = "hook", "0 0 0"
    for number in range(pieces):
        for order, axis in enumerate(axes):
            last = order == len(axes) - 1
            below = f"piece_{number}" if last else f"cross_{number}_{order}"
            parts += [link(below, PIECE if last else ""), joint(f"bend_{number}_{order}", "revolute", above, below,
                      xyz=at, axis=axis, limit="-1.7 1.7")]  # fmt: skip
            above, at = below, "0 0 0"
        at = "0.1 0 0"
    return robot(*parts)


def test_links_that_meet_in_one_point_pass_but_leaves_of_one_pin_do_not() -> None:
    ball = etree.fromstring(rope(2, axes=("1 0 0", "0 1 0", "0 0 1")).split("?>")[1])
    assert {*crossing(ball)} == {
        ("hook", "cross_0_1"), ("cross_0_0", "piece_0"), ("hook", "piece_0"),
        ("piece_0", "cross_1_1"), ("cross_1_0", "piece_1"), ("piece_0", "piece_1"),
    }  # fmt: skip
    assert crossing(etree.fromstring(rope(3, axes=("0 1 0", "0 0.1 -1")).split("?>")[1])), "askew"
    assert not crossing(etree.fromstring(rope(3, axes=("0 1 0", "0 -1 0.1")).split("?>")[1])), "a stapler's pin"
    assert not crossing(etree.fromstring(rope(3).replace('xyz="0 0 0"', 'xyz="0.001 0 0"').split("?>")[1]))


@pytest.mark.system
def test_a_rope_of_18_hinges_hangs_and_is_ok(tmp_path: Path) -> None:
    folder = written(tmp_path / "rope", rope(9))
    settings = NO_VIEWS.model_copy(update={"support": SupportKind.FIXED,
                                           "engine": EngineSettings(verify=(Engine.MUJOCO,))})  # fmt: skip
    record = refine_asset(AssetRef(asset_id="rope", path=str(folder)), tmp_path / "out", settings, prior)
    assert record.status is Status.OK, record.reason
    overlay = record.overlay
    assert overlay is not None
    at = {item.name: item.initial_position for item in overlay.joints}
    # By hand: of a rope that stands out horizontally the first hinge turns down by 90°, the others stay.
    assert at["bend_0_0"] == pytest.approx(math.pi / 2, abs=0.02)
    assert all(abs(value) < 0.02 for name, value in at.items() if name != "bend_0_0")
    weight = 9.81 * sum(item.mass_kg for item in overlay.links if item.name != "hook")
    # Its moment straight out, of which only a share is left as friction.
    assert all(not item.holds and item.friction < 0.1 * weight * 0.45 for item in overlay.joints)
    written_urdf = etree.parse(str(tmp_path / "out" / "assets" / "rope" / "mobility.urdf")).getroot()
    assert ("piece_3", "piece_4") in passing_pairs(written_urdf)
