"""Which end is closed where shape does not tell: parts of which gravity, overlaps and places do."""

from dataclasses import replace
from pathlib import Path

import pytest

from asset2sim.intake.guessed_ends import with_likelier_ends
from asset2sim.intake.origin import extract
from schemas.asset import AssetRef
from schemas.vocabulary import UpAxis
from tests.assets import joint, link, read, robot, shape, written

FRAME = "".join(shape("0.3 0.02 0.6", xyz=f"0 {y} 0.3") for y in (-0.2, 0.2))
SURE, FALLS = 0.3, "closed at the other end it would fall open"


def thing(part: str, kind: str, xyz: str, axis: str, limit: str, label: str) -> str:
    return robot(
        link("frame", FRAME), link(label, part), joint("j", kind, "frame", label, xyz=xyz, axis=axis, limit=limit)
    )


LIFTED = shape("0.2 0.3 0.01")
HUNG = shape("0.01 0.3 0.12", xyz="0 0 -0.06")


@pytest.mark.parametrize(
    ("urdf", "closed", "other"),
    [
        (thing(LIFTED, "prismatic", "0 0 0.1", "0 0 1", "0 0.01", "lid"), 0.0, FALLS),
        (thing(LIFTED, "prismatic", "0 0 0.1", "0 0 -1", "-0.01 0", "lid"), 0.0, FALLS),
        (thing(LIFTED, "prismatic", "0 0 0.11", "0 0 1", "-0.01 0", "lid"), -0.01, FALLS),
        (thing(HUNG, "revolute", "0 0 0.36", "0 1 0", "0 1", "flap"), 0.0, FALLS),
        (thing(shape("0.06 0.3 0.01", xyz="0.03 0 0"), "revolute", "0 0 0.36", "0 1 0", "0 1.57", "flap"),
         1.57, FALLS),
    ],
    ids=["lid", "turned", "drawn lifted", "flap", "drawn raised"],
)  # fmt: skip
def test_a_lid_is_closed_where_it_does_not_fall_open(tmp_path: Path, urdf: str, closed: float, other: str) -> None:
    item = read(written(tmp_path, urdf), "Box")
    assert item.features.joints[0].openness_confidence < SURE, "its shape does not tell"
    (found,) = with_likelier_ends(item, SURE).features.joints
    assert found.closed == pytest.approx(closed) and found.other_reading == other
    assert found.openness_confidence == item.features.joints[0].openness_confidence, "a guess stays one"


@pytest.mark.parametrize(("limit", "off"), [("0 1.5", 0.0), ("-1.5 0", 0.0), ("-0.5 1", None)])
def test_a_tap_is_off_where_it_is_drawn_at_an_end(tmp_path: Path, limit: str, off: float | None) -> None:
    """A lever that is drawn upright makes its tap the smaller the further it is turned, as what closes does."""
    tap = thing(shape("0.01 0.016 0.12", xyz="0 0 0.06"), "revolute", "0 0 0.6", "0 1 0", limit, "switch")
    item = read(written(tmp_path, tap.replace(FRAME, shape("0.3 0.05 0.6", xyz="0 0 0.3"))), "Faucet")
    (before,), (found,) = item.features.joints, with_likelier_ends(item, 1.1).features.joints
    assert before.closed != 0.0, "by its shape it is off where it lies"
    assert found.closed == (before.closed if off is None else off)


def test_a_bins_swing_lid_is_shut_where_it_is_drawn(tmp_path: Path) -> None:
    bin_ = thing(shape("0.2 0.3 0.02", xyz="0 0 -0.03"), "revolute", "0 0 0.55", "0 1 0", "-1.2 1.15", "lid")
    item = read(written(tmp_path, bin_), "TrashCan")
    (found,) = with_likelier_ends(item, 1.1).features.joints
    assert (found.closed, found.open) == (0.0, 1.15)


@pytest.mark.parametrize(("lower", "closed"), [(-0.04, 0.0), (-0.4, -0.4), (0.0, 0.0)], ids=["slack", "ajar", "none"])
def test_a_lid_is_closed_where_it_is_drawn_and_not_a_little_beyond(tmp_path: Path, lower: float, closed: float) -> None:
    lid = thing(shape("0.3 0.42 0.01", xyz="0.15 0 0.005"), "revolute", "-0.15 0 0.6", "0 -1 0", f"{lower} 2", "lid")
    item = read(written(tmp_path, lid), "Box")
    assert item.features.joints[0].closed == pytest.approx(lower), "by its shape it is closed at its limit"
    (found,) = with_likelier_ends(item, SURE).features.joints
    assert (found.closed, found.open, found.lower) == pytest.approx((closed, 2.0, lower))


def test_of_two_doors_that_are_drawn_shut_both_are_shut_where_they_are_drawn(tmp_path: Path) -> None:
    """Beside what is far larger, as a kitchen, their shape tells nothing, or a little of the wrong end."""
    leaf = "0.02 0.4 0.5"
    kitchen = robot(
        link("frame", shape("0.6 3 0.6", xyz="-0.31 0 1.5") + shape("0.7 3 0.9", xyz="-0.3 0 0.45")),
        link("left_door", shape(leaf, xyz="0 0.2 0")), link("right_door", shape(leaf, xyz="0 -0.2 0")),
        joint("left", "revolute", "frame", "left_door", xyz="0 -0.4 1.5", axis="0 0 1", limit="-1.57 0"),
        joint("right", "revolute", "frame", "right_door", xyz="0 0.4 1.5", axis="0 0 1", limit="0 1.57"),
    )  # fmt: skip
    item = read(written(tmp_path, kitchen), "KitchenUnit")
    turned = [each.model_copy(update={"closed": each.open, "open": each.closed}) for each in item.features.joints]
    for joints in (item.features.joints, tuple(turned)):
        guessed = replace(item, features=item.features.model_copy(update={"joints": joints}))
        assert [found.closed for found in with_likelier_ends(guessed, 1.1).features.joints] == [0.0, 0.0]


def test_what_either_end_means_alike_stays_and_bails_have_no_closed_end(tmp_path: Path) -> None:
    upright = thing(shape("0.04 0.3 0.5", xyz="0 0 0.3"), "revolute", "0 0 0", "0 0 1", "0 3.1416", "door")
    bail = thing(HUNG, "revolute", "0 0 0.36", "0 1 0", "0.2 1.2", "handle")
    for name, urdf, told in (("door", upright, True), ("bail", bail, False)):
        item = read(written(tmp_path / name, urdf), "Box")
        (before,), (found,) = item.features.joints, with_likelier_ends(item, SURE).features.joints
        assert (found.closed, found.open) == (before.closed, before.open)
        assert ("nothing that is odd" in found.other_reading) is told


@pytest.mark.parametrize(("up", "closed"), [(UpAxis.Z, None), (UpAxis.Y, 1.2), (UpAxis.MINUS_Y, -1.2)])
def test_a_handle_is_folded_down_where_it_sinks_to_however_its_case_lies(
    tmp_path: Path, up: UpAxis, closed: float | None
) -> None:
    case = robot(
        link("case", shape("0.4 0.1 0.3")), link("handle", shape("0.1 0.01 0.04", xyz="0 0 0.02")),
        joint("j", "revolute", "case", "handle", xyz="0 0 0.15", axis="1 0 0", limit="-1.2 1.2"),
    )  # fmt: skip
    folder = written(tmp_path / "case", case)
    item = extract(AssetRef(asset_id="case", path=str(folder), category="Suitcase"), tmp_path / "shapes", up)
    (before,), (found,) = item.features.joints, with_likelier_ends(item, SURE).features.joints
    assert found.closed == (before.closed if closed is None else pytest.approx(closed))
    assert not found.other_reading, "which way it lies is no guess"


@pytest.mark.parametrize("pressed", [0.0, 0.3, 0.6, 0.9])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_button_is_closed_where_it_stands_out_however_far_it_is_drawn_in(
    tmp_path: Path, pressed: float, way: float
) -> None:
    travel, drawn = 0.004, pressed * 0.004
    limit = f"{-drawn} {travel - drawn}" if way > 0.0 else f"{drawn - travel} {drawn}"
    urdf = robot(
        link("case", shape("0.2 0.3 0.05")), link("button", shape("0.01 0.01 0.01")),
        joint("j", "prismatic", "case", "button", xyz=f"0.05 0.1 {0.025 - drawn}", axis=f"0 0 {-way}", limit=limit),
    )  # fmt: skip
    item = read(written(tmp_path, urdf), "Remote")
    (found,) = with_likelier_ends(item, SURE).features.joints
    assert (found.closed, found.open) == pytest.approx((-way * drawn, way * (travel - drawn)))
