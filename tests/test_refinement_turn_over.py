"""What does not stand as authored is written as it lies: the whole object turned, and nothing within it moved."""

from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.read import read_urdf, root_of, tree_joint
from asset2sim.checks.declared_check import Case
from asset2sim.physics.kinematics import link_to_root
from asset2sim.refinement.dynamics.remedies import lie_broad, lie_down
from asset2sim.validation.validate import validate
from schemas.asset import AssetRecord, AssetRef
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, Source, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, joint, link, prior, read, robot, sample, saying, shape, written
from tests.marks import OBJECTS, needs_objects

TALL = robot(
    link("body", shape("0.02 0.02 0.14", xyz="0 0 0.07")),
    link("cap", shape("0.024 0.024 0.04", xyz="0 0 0.02")),
    joint("pull", "prismatic", "body", "cap", xyz="0 0 0.12", axis="0 0 1", limit="0 0.03"),
)


def overlay_of(folder: Path, category: str) -> tuple[Case, PhysicsOverlay]:
    item = read(written(folder, TALL), category)
    overlay, _ = validate(item, Overlay(scale=1.0), Source.MODEL, 0.5, NO_VIEWS.physics)
    return Case(item.features, NO_VIEWS, ()), overlay


def turned_case(case: Case, angle: float) -> Case:
    return Case(case.features, case.settings, (), (angle, 0.0, 0.0))


def test_a_pen_lies_as_it_falls_and_a_lamp_only_leans(tmp_path: Path) -> None:
    case, small = overlay_of(tmp_path / "pen", "Pen")
    assert lie_down(case, small) is None, "it rests as it is set down"
    lying = lie_down(turned_case(case, 1.5), small)
    assert lying is not None and lying.turned_rad == pytest.approx((1.5, 0.0, 0.0))
    further = lie_down(turned_case(case, 0.1), lying)
    assert further is not None and further.turned_rad == pytest.approx((1.6, 0.0, 0.0)), "turns add up"
    case, large = overlay_of(tmp_path / "post", "Lamp")
    assert lie_down(turned_case(case, 1.5), large) is None, "a lamp that topples is not mended by lying"
    assert lie_down(turned_case(case, 0.3), large) is not None


@pytest.mark.system
def test_a_pen_that_is_authored_upright_on_its_tip_is_written_lying(tmp_path: Path) -> None:
    tip = robot(
        link("body", shape("0.012 0.012 0.13", xyz="0 0 0.075") + shape("0.001 0.001 0.02", xyz="0.008 0 0.01")),
        link("cap", shape("0.016 0.016 0.04", xyz="0 0 0.02")),
        joint("pull", "prismatic", "body", "cap", xyz="0 0 0.14", axis="0 0 1", limit="0 0.03"),
    )
    folder = written(tmp_path / "pen", tip)
    record = refine_asset(AssetRef(asset_id="pen", path=str(folder), category="Pen"), tmp_path / "out", NO_VIEWS, prior)
    assert record.overlay is not None
    assert record.status is Status.OK, record.reason
    assert "laid_down" in {finding.code for finding in record.findings}
    urdf = tmp_path / "out" / "assets" / record.ref.asset_id / URDF_NAME
    robot_model = read_urdf(urdf)
    poses = link_to_root([tree_joint(item) for item in robot_model.joints], root_of(robot_model), {})
    axis = poses["cap"][:3, :3] @ np.array([0.0, 0.0, 1.0])
    assert abs(axis[2]) < 0.1
    origins = [
        item.find("origin") for item in etree.parse(str(urdf)).getroot().iterfind("link[@name='body']/collision")
    ]
    assert origins and all(origin is not None and "rpy" in origin.attrib for origin in origins)


@pytest.mark.system
@needs_objects
def test_a_real_suitcase_that_its_lid_pulls_over_is_laid_on_its_back_and_keeps_the_state_that_is_asked(
    tmp_path: Path,
) -> None:
    settings = NO_VIEWS.model_copy(update={"engine": EngineSettings(verify=(Engine.PYBULLET,), interact=True)})
    record = refine_asset(sample("103755", OBJECTS), tmp_path, settings, prior)
    assert record.status is Status.OK and record.overlay is not None, record.reason
    assert [finding.code for finding in record.findings].count("laid_down") == 1
    lid = next(item for item in record.overlay.joints if item.name == "joint_1")
    (report,) = record.reports
    assert report.interaction is not None and lid.asked_position is not None
    (seen,) = [item for item in report.interaction.settled if item.joint == "joint_1"]
    assert seen.share <= settings.thresholds.state_share and seen.asked == lid.asked_position


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
