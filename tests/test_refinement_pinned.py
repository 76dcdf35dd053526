"""Links that meet in every state pass through each other; those that some state parts do not."""

from pathlib import Path

import pytest

from asset2sim.assets.authored_overlap import authored_shapes
from asset2sim.physics.kinematics import link_to_root, tree_of
from asset2sim.refinement.collision.let_joints_move import pinned_pairs, sleeved_pairs, stacked_pairs, with_limits
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef
from schemas.overlay import Overlay
from schemas.vocabulary import Source, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, box_obj, joint, link, mesh, prior, read, robot, shape, written

RAIL = link("rail", shape("2 0.05 0.05"))
CART = link("cart", shape("0.2 0.2 0.1", xyz="0 0.2 0"))
SLIDE = joint("slide", "prismatic", "rail", "cart", axis="1 0 0", limit="-0.8 0.8")


@pytest.mark.parametrize(
    ("pole", "limit", "pinned"),
    [("0 0 0.45", "-1.5 1.5", True), ("0 0 0.525", "-1.5 1.5", False), ("0 0.1 0.45", "-1.5 1.5", False)],
)
def test_a_pole_pinned_in_its_carts_rail_passes_it(tmp_path: Path, pole: str, limit: str, pinned: bool) -> None:
    text = robot(
        RAIL, CART, link("pole", shape("0.05 0.05 1", xyz=pole)), SLIDE,
        joint("hinge", "revolute", "cart", "pole", axis="0 1 0", limit=limit),
    )  # fmt: skip
    item = read(written(tmp_path, text))
    limits = {"slide": (-0.8, 0.8), "hinge": (-1.5, 1.5)}
    start, shapes = {"slide": 0.0, "hinge": 0.0}, authored_shapes(item, 1.0)
    found = pinned_pairs(tree_of(item.features.joints), "rail", limits, start, [("rail", "pole")], shapes, {})
    assert found == [("rail", "pole")] * pinned


@pytest.mark.parametrize(
    ("axis", "up", "sleeved"), [("0 0 1", 0.2, True), ("1 0 0", 0.2, False), ("0 0 1", 0.251, False)]
)
def test_a_spindle_passes_the_column_that_it_is_drawn_into(tmp_path: Path, axis: str, up: float, sleeved: bool) -> None:
    text = robot(
        link("foot", shape("0.06 0.06 0.3")), link("helper", ""),
        link("seat", shape("0.03 0.03 0.2", xyz=f"0 0 {up}")),
        joint("lift", "prismatic", "foot", "helper", axis="0 0 1", limit="0 0.1"),
        joint("turn", "continuous", "helper", "seat", axis=axis),
    )  # fmt: skip
    item = read(written(tmp_path, text))
    tree, shapes = tree_of(item.features.joints), authored_shapes(item, 1.0)
    assert sleeved_pairs(tree, "foot", [("foot", "seat")], shapes, 2e-3) == [("foot", "seat")] * sleeved


@pytest.mark.parametrize(("gap", "pinned"), [(0.0, True), (1e-4, False)])
def test_a_knob_that_turns_face_on_face_on_its_stand_passes_it(tmp_path: Path, gap: float, pinned: bool) -> None:
    can = '<{{}}><origin xyz="{xyz}"/><geometry><cylinder radius="{radius}" length="{length}"/></geometry></{{}}>'
    stand = can.format(xyz="0 0 0.015", radius=0.05, length=0.03).format(*["collision"] * 2)
    knob = can.format(xyz="0 0 0", radius=0.025, length=0.09).format(*["collision"] * 2)
    text = robot(
        link("base", ""), link("stand", stand), link("knob", knob), joint("on", "fixed", "base", "stand"),
        joint("turn", "continuous", "base", "knob", xyz=f"0 0 {0.075 + gap}", axis="0 0 1"),
    )  # fmt: skip
    item = read(written(tmp_path, text))
    shapes = authored_shapes(item, 1.0)
    found = pinned_pairs(tree_of(item.features.joints), "base", {}, {"turn": 0.0}, [("stand", "knob")], shapes, {})
    assert found == [("stand", "knob")] * pinned


@pytest.mark.parametrize(
    ("before", "offset", "turns", "stacked"),
    [
        (0.0006, 0.0, "continuous", True),
        (0.0001, 0.0, "continuous", False),
        (0.0006, 0.02, "continuous", False),
        (0.0006, 0.0, "prismatic", False),
    ],
)
def test_hands_of_a_clock_pass_each_other(
    tmp_path: Path, before: float, offset: float, turns: str, stacked: bool
) -> None:
    text = robot(
        link("face", shape("0.3 0.3 0.02")), link("hour", shape("0.006 0.08 0.0005", xyz="0 0.04 0")),
        link("minute", shape("0.004 0.12 0.0005", xyz=f"{-offset} 0.06 {before}")),
        joint("short", "continuous", "face", "hour", xyz="0 0 0.012", axis="0 0 1"),
        joint("long", turns, "face", "minute", xyz=f"{offset} 0 0.012", axis="0 0 1", limit="0 1"),
    )  # fmt: skip
    item = read(written(tmp_path, text))
    tree, pair = tree_of(item.features.joints), ("hour", "minute")
    points = {name: geometry.points for name, geometry in item.geometry.items()}
    found = stacked_pairs(tree, link_to_root(tree, "face", {}), [pair, ("face", "hour")], points)
    assert found == [pair] * stacked


def carton(folder: Path, wide: float, reach: float) -> Path:
    """A carton of 0.4 m, drawn closed, with four flaps ``wide`` m to either side, that reach ``reach`` m inwards."""
    low, high, top = -0.2, 0.2, 0.3
    flaps = {"west": ("0 -1 0", low, 0.0), "east": ("0 1 0", high, 0.0),
             "south": ("1 0 0", 0.0, low), "north": ("-1 0 0", 0.0, high)}  # fmt: skip
    card = 0.004
    # fmt: off
    walls = {"floor": ((low, low, 0.0), (high, high, card)),
             "w": ((low, low, 0.0), (low + card, high, top)), "e": ((high - card, low, 0.0), (high, high, top)),
             "s": ((low, low, 0.0), (high, low + card, top)), "n": ((low, high - card, 0.0), (high, high, top))}
    # fmt: on
    files = {f"{name}.obj": box_obj(*ends) for name, ends in walls.items()}
    parts = [link("body", "".join(mesh(f"{name}.obj") for name in walls))]
    for name, (axis, x, y) in flaps.items():
        ends = [(-wide, wide)] * 2
        for at, way in enumerate((x, y)):
            if way:
                ends[at] = (0.0, reach) if way < 0.0 else (-reach, 0.0)
        (left, right), (near, far) = ends
        files[f"{name}.obj"] = box_obj((left, near, 0.0), (right, far, card))
        place = f"{x} {y} {top + 0.001}"
        parts += [
            link(name, mesh(f"{name}.obj")),
            joint(f"fold_{name}", "revolute", "body", name, xyz=place, axis=axis, limit="0 4.5"),
        ]
    return written(folder, robot(*parts), files)


@pytest.mark.system
@pytest.mark.parametrize(("wide", "reach", "crossing"), [(0.198, 0.19, 4), (0.1, 0.09, 0)])
def test_all_four_flaps_of_a_carton_close(tmp_path: Path, wide: float, reach: float, crossing: int) -> None:
    path = carton(tmp_path / "carton", wide, reach)
    asked = AssetRef(asset_id="carton", path=str(path), category="Box", prompt="A closed carton with four flaps.")
    record = refine_asset(asked, tmp_path / "out", NO_VIEWS, prior)
    assert record.overlay is not None
    assert record.status is Status.OK, record.reason
    assert all(abs(flap.initial_position) < 0.1 for flap in record.overlay.joints)
    assert len(record.overlay.passing) == crossing
    assert len([finding for finding in record.findings if finding.code == "links_pass"]) == crossing


@pytest.mark.parametrize(
    ("asked", "upper", "now"), [(1.6, 1.5, 1.5), (1.55, 1.5, 1.55), (1.6, 1.2, 1.6)], ids=["end", "number", "far"]
)
def test_a_part_asked_to_be_at_its_end_is_asked_at_where_that_is_drawn_in_to(
    asked: float, upper: float, now: float, tmp_path: Path
) -> None:
    turn = joint("turn", "revolute", "rail", "cart", axis="0 0 1", limit="0 1.6")
    wish = Overlay(scale=1.0, initial_joint_positions={"turn": asked}, asked=("initial_joint_positions.turn",))
    done, _ = validate(read(written(tmp_path, robot(RAIL, CART, turn))), wish, Source.MODEL, 0.5, NO_VIEWS.physics)
    assert done.joints[0].asked_position == asked
    assert with_limits(done, {"turn": (0.0, upper)}).joints[0].asked_position == pytest.approx(now)
