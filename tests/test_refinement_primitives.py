"""Boxes and cylinders that a file draws are cut where they overlap or drag, as meshes are, and made again so."""

from pathlib import Path

import pytest

from asset2sim.assets.hulls import exact_links, primitive_hulls
from asset2sim.assets.meshes.cylinder import cylinder_of
from schemas.asset import AssetRef
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, Source, Status
from tasks.pipeline import refine_asset
from tasks.remake import remake_asset
from tests.assets import NO_VIEWS, joint, link, prior, read, robot, shape, written


def case(width: float, depth: float, height: float, wall: float = 0.02) -> str:
    """The walls, floor and top of a case that is open to the front (+x)."""
    sides = [shape(f"{depth} {wall} {height}", xyz=f"0 {side * (width - wall) / 2} {height / 2}") for side in (-1, 1)]
    plates = [shape(f"{depth} {width} {wall}", xyz=f"0 0 {z}") for z in (wall / 2, height - wall / 2)]
    return "".join((*sides, *plates, shape(f"{wall} {width} {height}", xyz=f"{(wall - depth) / 2} 0 {height / 2}")))


def cupboard() -> str:
    """Two doors that are drawn 2 mm lower than the case, which is to stand on the floor."""
    parts, hinges = [link("body", case(0.8, 0.4, 0.9))], []
    for side, name in ((-1, "left"), (1, "right")):
        leaf = shape("0.018 0.396 0.9", xyz=f"0.01 {-side * 0.198} 0.448")
        parts.append(link(f"{name}_door", leaf + shape("0.02 0.02 0.12", xyz=f"0.03 {-side * 0.36} 0.5")))
        hinges.append(joint(f"{name}_hinge", "revolute", "body", f"{name}_door", xyz=f"0.2 {side * 0.398} 0",
                            axis=f"0 0 {side}", limit="0 1.57"))  # fmt: skip
    return robot(*parts, *hinges)


def microwave() -> str:
    """A door that is drawn a centimetre into the walls of its case, which is fixed to what the door hangs on."""
    return robot(
        link("base", shape("0.36 0.5 0.004", xyz="0 0 -0.002")),
        link("body", case(0.5, 0.36, 0.29)),
        link("door", shape("0.04 0.38 0.288", xyz="0.02 0.19 0.145")),
        joint("fixed", "fixed", "base", "body"),
        joint("door_hinge", "revolute", "base", "door", xyz="0.17 -0.249 0", axis="0 0 -1", limit="0 1.9"),
    )


@pytest.mark.system
@pytest.mark.parametrize(("urdf", "category"), [(cupboard(), "StorageFurniture"), (microwave(), "Microwave")],
                         ids=["drags", "overlaps"])  # fmt: skip
def test_boxes_are_cut_and_made_again(urdf: str, category: str, tmp_path: Path) -> None:
    """Of boxes that nothing cuts the doors drag, with 40 N in MuJoCo, or start 10° open."""
    ref = AssetRef(asset_id="one", path=str(written(tmp_path / "one", urdf)), category=category)
    engine = EngineSettings(verify=(Engine.MUJOCO,))
    record = refine_asset(ref, tmp_path / "out", NO_VIEWS.model_copy(update={"engine": engine}), prior)
    assert record.status is Status.OK, record.reason
    assert record.overlay is not None
    assert all(own.initial_position == 0.0 and own.position_source is Source.RULE for own in record.overlay.joints)
    assert "collision_cut" in {finding.code for finding in record.findings}
    again = remake_asset(ref, tmp_path / "out/assets/one", tmp_path / "again")
    assert again.outcome == "same", again.reason


def test_hulls_of_boxes_and_cylinders_stand_where_these_are_drawn(tmp_path: Path) -> None:
    rim = '<collision><origin xyz="0 0 1" rpy="1.5707963 0 0"/><geometry><cylinder radius="0.2" length="0.1"/>' \
        "</geometry></collision>"  # fmt: skip
    ball = '<collision><geometry><sphere radius="0.3"/></geometry></collision>'
    item = read(written(tmp_path, robot(link("body", shape("0.4 0.2 0.1", xyz="0 0 0.05")), link("wheel", rim + ball),
                                        joint("axle", "continuous", "body", "wheel", axis="0 1 0"))))  # fmt: skip
    hulls = primitive_hulls(item, 2.0)
    (box,), (wheel,) = hulls["body"], hulls["wheel"]
    assert box.min(axis=0).tolist() == pytest.approx([-0.4, -0.2, 0.0])
    assert box.max(axis=0).tolist() == pytest.approx([0.4, 0.2, 0.2])
    cylinder = cylinder_of(wheel)
    assert cylinder is not None and (cylinder.radius, cylinder.length) == pytest.approx((0.4, 0.2))
    assert cylinder.middle.tolist() == pytest.approx([0.0, 0.0, 2.0]) and abs(cylinder.axis[1]) == pytest.approx(1.0)
    assert exact_links(item) == {"body", "wheel"}, "cutting them takes no more than of a mesh that is its own hull"
