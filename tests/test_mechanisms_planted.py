"""Planted objects, named as other datasets name their parts, in the hand: pushed and let go through asset2sim.load."""

from pathlib import Path

import pytest

from asset2sim.checks.effort import effort_verdict
from asset2sim.guidance.csv_rows import csv_rows
from asset2sim.guidance.parts import part_name
from schemas.interaction import Effort
from schemas.mechanism import EffortRange
from schemas.vocabulary import Engine, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, prior
from tests.factories import make_joint
from tests.hand import felt
from tests.planted_mechanisms import ABSENT, FRESH, HELD, PLANTED, SELDOM, faults, made

ONE_ENGINE = NO_VIEWS.model_copy(update={"engine": NO_VIEWS.engine.model_copy(update={"verify": (Engine.MUJOCO,)})})
BY_NAME = {item.name: item for item in (*PLANTED, *FRESH, *HELD, *SELDOM, *ABSENT)}


@pytest.mark.system
@pytest.mark.parametrize(
    "name",
    [
        "gap_microwave", "gap_handle", "suite_door", "suite_leaf", "akb_condiment", "gz_valve",
        "casa_dishwasher", "opd_fridge", "selector", "butterfly", "brake", "porthole", "throttle", "shutter",
        "breaker_panel", "press", "vise_screw", "bell", "cutter_arm", "revolving", "toggle", "usb_cap", "stand_screen",
        "fan_column", "mouse_button", "wall_dimmer",
    ],
)  # fmt: skip
def test_a_part_is_what_a_hand_expects_whatever_its_dataset_calls_it(tmp_path: Path, name: str) -> None:
    item = BY_NAME[name]
    record = refine_asset(made(item, tmp_path / "in"), tmp_path / "out", ONE_ENGINE, prior)
    assert record.status is Status.OK, record.reason
    folder = tmp_path / "out" / "assets" / name
    wrong = [fault for engine in ("mujoco", "pybullet") for fault in faults(item, felt(folder, engine))]
    assert not wrong


@pytest.mark.parametrize(
    ("label", "names", "part"),
    [
        ("hinge_door", ("link_0", "joint_0"), "door"),
        ("slider_button", (), "button"),
        ("", ("knob_front_left_main", "knob_front_left_joint"), "knob"),
        ("", ("caseLidLink", ""), "lid"),
        ("", ("Door_latch", "latch_joint"), "lock"),
        ("", ("valve_wheel", "wheel_joint"), "handwheel"),
        ("", ("button_plunger", "slide"), "button"),
        ("", ("second_drawer", ""), "drawer"),
        ("", ("drawer_second", ""), "drawer"),
        ("", ("link_0", "second"), "hand"),
        ("door_frame", ("link_3", ""), ""),
        ("", ("clock_block", ""), ""),
        ("", ("AKIBA-DOOR-BODYSET5_link", "KNOB"), "knob"),
        ("", ("ROOM610-SHELF0-BODYSET2_link", "DRAWER4"), "drawer"),
        ("furniture_body", ("link_1", ""), ""),
    ],
)
def test_a_compound_name_is_what_its_head_says(label: str, names: tuple[str, ...], part: str) -> None:
    assert part_name(label, *names) == part


EFFORTS = {f"{r['part']}-{r['category']}-{r['motion']}-{r['kind']}": r for r in csv_rows("efforts")}


@pytest.mark.parametrize("row", EFFORTS.values(), ids=EFFORTS)
def test_too_loose_and_too_tight_of_every_kind_fail(row: dict[str, str]) -> None:
    assert row["source"], "every bound is stated somewhere"
    least, most = float(row["least_n"]) or 20.0 * float(row["least_share"]), float(row["most_n"])
    assert 0.0 < least < most, "of a part of 20 N where only a share is stated"
    joint = make_joint("turn", "revolute", 0.0).model_copy(
        update={"effort_range": EffortRange(kind=row["kind"], least_n=least, most_n=most, source=row["source"])}
    )
    ways = {"joint": "turn", "way": "opening", "lever_m": 0.5, "tips_at_n": None, "slides_at_n": None}
    for force, passes in ((0.9 * least, False), (1.1 * least, True), (0.95 * most, True), (1.05 * most, False)):
        seen = Effort.model_validate({**ways, "effort": 0.5 * force})
        assert effort_verdict([seen], joint, "any").passed is passes
