"""Objects asked to be open open as far as they stand; those that may lie on any side lie on their broad one."""

from pathlib import Path

import pytest

from asset2sim.checks.declared_check import Case
from asset2sim.refinement.dynamics.remedies import lie_broad
from asset2sim.validation.validate import validate
from schemas.asset import AssetRecord, AssetRef
from schemas.overlay import Overlay
from schemas.vocabulary import Source, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, joint, link, read, robot, saying, shape, written


def opened(folder: Path, words: str, height: float) -> AssetRecord:
    """A drawer of three quarters of the mass on a body of 0.3 m, asked for in these words, all the way out: out by d,
    the whole's middle is 0.75 d before the body's, so that it tips over from d = 0.2 m on."""
    chest = robot(
        link("body", shape(f"0.3 0.3 {height}", xyz=f"0 0 {height / 2}")),
        link("drawer", shape("0.3 0.3 0.1", xyz="0 0 0.05")),
        joint("slide", "prismatic", "body", "drawer", xyz=f"0 0 {height + 0.001}", axis="1 0 0", limit="0 0.3"),
    )
    ask = saying({
        "scale": 1.0, "initial_joint_positions": {"slide": 0.3}, "asked": ["slide"],
        "links": [{"name": "body", "mass_kg": 1.0}, {"name": "drawer", "mass_kg": 3.0}],
    })  # fmt: skip
    path = written(folder / "chest", chest)
    ref = AssetRef(asset_id="chest", path=str(path), category="StorageFurniture", prompt=words)
    return refine_asset(ref, folder / "out", NO_VIEWS, ask)


@pytest.mark.system
@pytest.mark.parametrize("height", [0.1, 0.5])
def test_a_drawer_that_would_tip_its_chest_over_is_open_as_far_as_that_stands(tmp_path: Path, height: float) -> None:
    # The lower one would come to rest leaning on its drawer by 19°.
    record = opened(tmp_path, "An open chest of drawers, freestanding.", height)
    assert record.status is Status.OK and record.overlay is not None, record.reason
    # 0.85 and 0.7 of 0.3 m are beyond 0.2 m.
    assert record.overlay.initial_positions["slide"] == pytest.approx(0.55 * 0.3)
    (told,) = [finding.message for finding in record.findings if finding.code == "state_moved"]
    assert "as far as it stands" in told


@pytest.mark.system
def test_what_is_asked_to_be_all_the_way_open_fails_where_it_tips_over(tmp_path: Path) -> None:
    record = opened(tmp_path, "A freestanding chest with its drawer open all the way.", height=0.5)
    assert record.status is Status.FAILED and record.overlay is not None
    assert record.overlay.initial_positions["slide"] == pytest.approx(0.3)
    assert "tip" in (record.reason or "")


@pytest.mark.parametrize(
    ("category", "thin", "turned"),
    [
        # The lid is on the side of -x: a quarter turn about y brings it on top.
        ("Suitcase", "0.1 0.4 0.3", (0.0, 1.5707963, 0.0)),
        ("Suitcase", "0.4 0.3 0.1", None),  # it lies already
        ("Lamp", "0.1 0.4 0.3", None),  # not put down on any side
    ],
)
def test_a_case_is_laid_on_its_broad_side_under_its_lid(
    tmp_path: Path, category: str, thin: str, turned: tuple[float, float, float] | None
) -> None:
    x, y, z = (float(edge) for edge in thin.split())
    case = robot(
        link("base", shape(thin, xyz=f"{x / 2} 0 {z / 2}")),
        link("lid", shape(f"0.04 {y} {z}", xyz=f"-0.02 0 {z / 2}")),
        joint("hinge", "revolute", "base", "lid", axis="0 1 0", limit="-1.57 0"),
    )
    item = read(written(tmp_path, case), category)
    overlay, _ = validate(item, Overlay(scale=1.0), Source.MODEL, 0.5, NO_VIEWS.physics)
    laid = lie_broad(Case(item.features, NO_VIEWS, ()), overlay)
    assert (None if laid is None else laid.turned_rad) == (None if turned is None else pytest.approx(turned))
