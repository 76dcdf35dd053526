"""Things that are put down on any side are laid where it would tip over as authored, with what moves on top."""

from dataclasses import replace
from functools import reduce
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.validation.lying import lying_side
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef, Overrides, StatedPosition
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.thresholds import Thresholds
from schemas.vocabulary import Source, UpAxis
from tasks.extract import guidance_of, lying_asset
from tasks.progress import AssetJob
from tasks.validate import validate_overlay
from tests.assets import NO_VIEWS, joint, link, prior, read, robot, shape, written

CASE = robot(
    link("base", shape("0.06 0.24 0.18", xyz="0.03 0 0.09")),
    link("lid", shape("0.03 0.24 0.18", xyz="-0.015 0 0.09")),
    joint("hinge", "revolute", "base", "lid", axis="0 -1 0", limit="0 3.1416"),
)
"""A suitcase that stands on its hinges' edge; its lid falls to the side of -x as it opens."""
SMALL = 0.6
REMOTE = robot(
    link("body", shape("0.02 0.05 0.18", xyz="0 0 0.09")),
    *(link(f"key_{n}", shape("0.002 0.01 0.01", xyz=f"0.011 0 {0.03 * n}")) for n in (1, 2, 3, 4)),
    *(joint(f"press_{n}", "prismatic", "body", f"key_{n}", axis="-1 0 0", limit="0 0.001") for n in (1, 2, 3, 4)),
)


def proposed(folder: Path, urdf: str, category: str, opened: float = 0.0) -> tuple[Extraction, PhysicsOverlay]:
    item = read(written(folder, urdf), category)
    at = {"hinge": opened} if opened else {}
    return item, validate(item, Overlay(scale=SMALL, initial_joint_positions=at), Source.MODEL, 0.5, NO_VIEWS.physics)[
        0
    ]


@pytest.mark.parametrize(("opened", "up"), [(1.5708, UpAxis.MINUS_X), (3.1416, UpAxis.MINUS_X)])
def test_an_open_suitcase_lies_on_its_base(tmp_path: Path, opened: float, up: UpAxis) -> None:
    item, overlay = proposed(tmp_path, CASE, "Suitcase", opened)
    side, finding = lying_side(item, overlay, Thresholds())
    assert side is up and finding is not None
    assert finding.code == "laid_down" and finding.value is not None and finding.value < 0.2
    assert "state --up=z" in finding.message


def test_a_remote_lies_with_its_keys_up_and_a_cupboard_is_not_laid_down(tmp_path: Path) -> None:
    assert lying_side(*proposed(tmp_path / "remote", REMOTE, "Remote"), Thresholds())[0] is UpAxis.X
    assert lying_side(*proposed(tmp_path / "cupboard", CASE, "StorageFurniture", 3.0), Thresholds()) == (UpAxis.Z, None)
    deep = (
        ("0.06 0.24", "0.2 0.24"),
        ('xyz="0.03', 'xyz="0.1'),
        ("0.03 0.24", "0.2 0.24"),
        ('xyz="-0.015', 'xyz="-0.1'),
    )
    thick = reduce(lambda urdf, change: urdf.replace(*change), deep, CASE)
    assert lying_side(*proposed(tmp_path / "trunk", thick, "Suitcase"), Thresholds()) == (UpAxis.Z, None), "it stands"


@pytest.mark.parametrize(("part", "up"), [("lid", UpAxis.X), ("drawer", UpAxis.Z)])
def test_what_has_a_drawer_stands_as_drawn_though_no_table_knows_it(tmp_path: Path, part: str, up: UpAxis) -> None:
    urdf = robot(
        link("body", shape("0.02 0.05 0.18", xyz="0 0 0.09")),
        link(part, shape("0.002 0.04 0.16", xyz="0.011 0 0.09")),
        joint("slide", "prismatic", "body", part, axis="1 0 0", limit="0 0.05"),
    )
    assert lying_side(*proposed(tmp_path, urdf, ""), Thresholds())[0] is up


def test_physics_are_those_of_the_object_as_it_lies_unless_its_up_axis_is_stated(tmp_path: Path) -> None:
    item, _ = proposed(tmp_path / "case", CASE, "Suitcase")
    proposal = Overlay(scale=SMALL, initial_joint_positions={"hinge": 1.5708}, asked=("hinge",))
    ref = AssetRef(asset_id="case", path=str(tmp_path / "case"), category="Suitcase")
    job = AssetJob(ref, tmp_path / "out", NO_VIEWS, prior)
    laid = validate_overlay(job, item, proposal, rules=True)
    lid = laid.overlay.joints[0]
    assert laid.extraction.features.rest_size[2] == pytest.approx(0.09, abs=1e-3), "as high as it is thick"
    assert abs(lid.gravity_load) < 0.1, "its lid stands upright, where it lay level"
    assert lying_asset(job, UpAxis.MINUS_X)[1] == laid.extraction.features
    for stays in ({"up": UpAxis.Z}, {"part": "case"}):
        kept = AssetJob(ref.model_copy(update=stays), tmp_path / "out", NO_VIEWS, prior)
        assert validate_overlay(kept, item, proposal, rules=True).extraction is item


def test_a_handle_that_words_fold_down_is_so_where_its_case_lies(tmp_path: Path) -> None:
    """Standing, its handle folds to either side alike; lying, one of these is up. A numbered position stays."""
    handle = link("handle", shape("0.01 0.1 0.04", xyz="0 0 0.02"))
    folds = joint("fold", "revolute", "base", "handle", xyz="0.015 0 0.18", axis="0 1 0", limit="-1.2 1.2")
    urdf = CASE.replace("</robot>", f"{handle}{folds}</robot>")
    item, _ = proposed(tmp_path / "case", urdf, "Suitcase")
    drawn = item.features.joint("fold")
    up_when_laid = drawn.model_copy(update={"closed": -1.2, "open": 1.2})
    joints = tuple(up_when_laid if joint.name == "fold" else joint for joint in item.features.joints)
    item = replace(item, features=item.features.model_copy(update={"joints": joints}))
    at = {"hinge": 1.5708, "fold": -1.2}
    proposal = Overlay(scale=SMALL, initial_joint_positions=at, asked=("hinge", "fold"))
    ref = AssetRef(
        asset_id="case", path=str(tmp_path / "case"), category="Suitcase",
        prompt="A small suitcase with its lid half open and its handle folded down.",
    )  # fmt: skip
    guidance = guidance_of(ref, item.features)
    assert "fold" in guidance.of_joints
    for exact, folded in ((False, 1.2), (True, -1.2)):
        stated = Overrides(joints={"fold": StatedPosition(value=-1.2)}) if exact else None
        own = ref.model_copy(update={"overrides": stated})
        laid = validate_overlay(
            AssetJob(own, tmp_path / "out", NO_VIEWS, prior, guidance=guidance), item, proposal, rules=True
        )
        assert laid.features is not None and laid.overlay.initial_positions["fold"] == pytest.approx(folded, abs=1e-3)
        assert laid.overlay.initial_positions["hinge"] == pytest.approx(1.5708)
