"""Parts of objects that no table lists do what such parts do, however they are labelled: they stay or return."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asset2sim.physics.mass_matrix import Pull
from asset2sim.validation.handling import Handling
from asset2sim.validation.limits import Range
from asset2sim.validation.mechanisms import caught_where_it_drops, mechanism_bias, nearer_end, steady_force
from asset2sim.validation.positions import Start
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef
from schemas.mechanism import CAUGHT, EffortRange
from schemas.overlay import JointPhysics, JointProposal, Overlay, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source, Status, UpAxis
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, joint, link, prior, read, robot, shape, validated, written
from tests.factories import make_features
from tests.planted_mechanisms import HELD, PLANTED, flap, made, round_shape

BODY = shape("0.04 0.04 0.2") + shape("0.15 0.025 0.025", xyz="0.06 0 0.09")
STICK = shape("0.1 0.02 0.012", xyz="0.04 0 0.006")
CROSS = shape("0.07 0.012 0.01") + shape("0.012 0.07 0.01")
DISC = "".join(
    f'<{tag}><geometry><cylinder radius="0.02" length="0.02"/></geometry></{tag}>' for tag in ("visual", "collision")
)
ANY = EffortRange(kind="door", least_n=1.0, most_n=45.0, source="a test")
PLATE = shape("0.01 0.08 0.08")


def described(
    folder: Path, name: str, category: str, words: str, part: str, label: str, **hinge: str
) -> PhysicsOverlay:
    """The overlay of an object of a body (``hinge["body"]``) and one part, by the offline model and the rules."""
    body, kind, up = hinge.pop("body"), hinge.pop("kind"), hinge.pop("up", None)
    made = robot(link("base", body), link("part", part), joint("turn", kind, "base", "part", **hinge))
    files = {"semantics.txt": f"base free body\npart hinge {label}\n"} if label else {}
    ref = AssetRef(
        asset_id=name,
        path=str(written(folder / name, made, files)),
        category=category,
        prompt=words,
        up=UpAxis(up) if up else None,
    )
    return overlay_of(ref, folder)


def overlay_of(ref: AssetRef, folder: Path) -> PhysicsOverlay:
    """The overlay of an asset by the offline model and the rules."""
    return validated(ref, folder / "out").overlay


def only(overlay: PhysicsOverlay) -> JointPhysics:
    (made,) = overlay.joints
    return made


@pytest.mark.parametrize("label", ["switch", "lever", "knob", "handle", "rocker", ""])
@pytest.mark.parametrize(
    ("part", "hinge"),
    [
        (STICK, {"kind": "revolute", "axis": "0 -1 0", "limit": "0 0.7"}),
        (CROSS, {"kind": "continuous", "axis": "0 0 1"}),
        (DISC, {"kind": "revolute", "axis": "0 0 1", "limit": "0 3"}),
    ],
    ids=["stick", "cross", "disc"],
)
def test_taps_stay_where_they_are_put(tmp_path: Path, label: str, part: str, hinge: dict[str, str]) -> None:
    overlay = described(tmp_path, "kitchen_tap", "Faucet", "A tap.", part, label, body=BODY, xyz="0 0 0.11", **hinge)
    made = only(overlay)
    assert made.stiffness == 0.0 and made.holds, "no spring brings it back"
    assert made.effort_range is not None and made.effort_range.kind == "tap handle"
    assert made.friction > 1.25 * abs(made.gravity_load)
    handle = next(link.mass_kg for link in overlay.links if link.name == "part")
    assert handle < 0.35, "a cast handle, and no solid one"


def test_an_object_of_no_stated_category_is_known_by_its_words(tmp_path: Path) -> None:
    hinge = {"kind": "revolute", "axis": "0 -1 0", "limit": "0 0.7", "xyz": "0 0 0.11"}
    made = only(described(tmp_path, "thing_7", "", "A dripping tap.", STICK, "", body=BODY, **hinge))
    assert made.effort_range is not None and made.effort_range.kind == "tap handle" and made.holds


@pytest.mark.parametrize("label", ["switch", "lever", "button", "slider", ""])
def test_wall_switches_take_what_rockers_take(tmp_path: Path, label: str) -> None:
    hinge = {"kind": "revolute", "axis": "0 1 0", "limit": "-0.12 0.12", "xyz": "-0.008 0 0"}
    part = shape("0.008 0.03 0.05")
    made = only(described(tmp_path, "switch_3", "Switch", "A light switch.", part, label, body=PLATE, **hinge))
    assert made.effort_range is not None and made.effort_range.kind == "rocker or toggle" and made.holds
    assert made.mechanism == "bistable" and made.bias is not None
    assert made.initial_position in (made.lower, made.upper), "on or off, not between"
    for end in (made.lower, made.upper):
        pressed = made.exerted(end or 0.0) * (1.0 if end == made.upper else -1.0)
        assert 2.8 * 0.02 < pressed < 11.0 * 0.03 and pressed > 5.0 * made.friction, "it snaps to either"


@pytest.mark.parametrize("category", ["Lamp", "FloorLamp"])
def test_a_lamps_switch_snaps_though_its_arms_stay_anywhere(tmp_path: Path, category: str) -> None:
    hinge = {"kind": "revolute", "axis": "0 1 0", "limit": "0 0.25", "xyz": "0 0 0.11"}
    snaps = only(described(tmp_path, "a", category, "", shape("0.02 0.016 0.004"), "switch", body=BODY, **hinge))
    stays = only(described(tmp_path, "b", category, "", STICK, "rotation_bar", body=BODY, **hinge))
    assert (snaps.mechanism, stays.mechanism) == ("bistable", "friction")


@pytest.mark.parametrize(
    ("category", "words", "label", "part", "kind", "holds"),
    [
        ("", "A ball valve.", "lever", STICK, "lever", True),
        ("", "A jar with a lid.", "lid", DISC, "screw lid", True),
        ("KitchenPot", "A pot.", "lid", DISC, "lid that lies loose", False),
        ("Toilet", "A toilet.", "lever", STICK, "lever", False),
        ("Lamp", "A lamp with a rocker.", "rocker", shape("0.03 0.02 0.008"), "rocker or toggle", True),
        ("Lamp", "A desk lamp.", "head", STICK, "joint of a lamp", True),
        ("Lighter", "A lighter.", "lid", shape("0.012 0.03 0.02"), "small lid", True),
        ("Door", "A door.", "knob", shape("0.05 0.05 0.03"), "door knob", False),
        ("", "A fire extinguisher.", "squeeze_lever", STICK, "trigger", False),
    ],
)
def test_other_parts_stay_or_return(
    tmp_path: Path, category: str, words: str, label: str, part: str, kind: str, holds: bool
) -> None:
    turns = part is DISC
    hinge = (
        {"kind": "continuous", "axis": "0 0 1"} if turns else {"kind": "revolute", "axis": "0 -1 0", "limit": "0 1.5"}
    )
    made = only(described(tmp_path, "thing", category, words, part, label, body=BODY, xyz="0 0 0.12", **hinge))
    assert made.effort_range is not None and made.effort_range.kind == kind
    assert made.holds is holds and (made.stiffness > 0.0) is (not holds and kind != "lid that lies loose")
    kept = made.friction + (made.bias.most if made.bias is not None else 0.0)
    assert not holds or kept >= made.effort_range.least_n * 0.005, "felt at 5 mm from its axis"


@pytest.mark.parametrize(("radius", "turn"), [(0.014, True), (0.03, False)])
def test_a_doors_thumb_turn_stays_and_its_knob_returns(tmp_path: Path, radius: float, turn: bool) -> None:
    knob = "".join(
        f'<{tag}><geometry><cylinder radius="{radius}" length="0.02"/></geometry></{tag}>'
        for tag in ("visual", "collision")
    )
    hinge = {"kind": "revolute", "axis": "0 1 0", "limit": "0 1.57", "xyz": "0.3 -0.04 0"}
    made = only(described(tmp_path, "a", "Door", "A door.", knob, "knob", body=shape("0.8 0.04 2"), **hinge))
    assert made.holds is turn and (made.stiffness > 0.0) is not turn


@pytest.mark.parametrize(
    ("label", "category", "motion", "axis"),
    [("lever", "Toaster", "prismatic", "0 0 -1"), ("lever", "Dispenser", "revolute", "0 -1 0")],
)
def test_levers_of_toasters_and_dispensers_return(
    tmp_path: Path, label: str, category: str, motion: str, axis: str
) -> None:
    hinge = {"kind": motion, "axis": axis, "limit": "0 0.08" if motion == "prismatic" else "0 0.4"}
    made = only(described(tmp_path, "a", category, "", STICK, label, body=BODY, xyz="0.08 0 0.1", **hinge))
    assert made.stiffness > 0.0 and made.effort_range is not None
    assert made.effort_range.kind == {"Toaster": "toaster lever", "Dispenser": "trigger"}[category]


@pytest.mark.parametrize(
    ("label", "words", "limit", "clicks"),
    [
        ("selector", "A toaster oven.", None, 12),
        ("program_selector", "A washing machine.", "0 4.7", 9),
        ("rotary_switch", "A heater.", "0 1.0", 2),
        ("knob", "A gas cooker.", "0 4.7", 0),
        ("volume", "An amplifier.", None, 0),
    ],
)
def test_selectors_click_and_other_knobs_do_not(
    tmp_path: Path, label: str, words: str, limit: str | None, clicks: int
) -> None:
    hinge = {"kind": "revolute", "axis": "0 0 1", "limit": limit} if limit else {"kind": "continuous", "axis": "0 0 1"}
    made = only(described(tmp_path, "thing", "", words, DISC, label, body=BODY, xyz="0 0 0.12", **hinge))
    assert (made.bias is None) is (clicks == 0) and made.friction > 0.0
    if made.bias is None:
        return
    turn = 2.0 * math.pi if made.lower is None or made.upper is None else made.upper - made.lower
    assert made.bias.period == pytest.approx(turn / clicks) and made.exerted(made.initial_position) == 0.0
    drawn = made.exerted(made.initial_position + 0.4 * made.bias.period)
    assert drawn == pytest.approx(-2.0 * made.friction), "back, with twice its friction"
    assert made.exerted(made.initial_position + 1.6 * made.bias.period) == pytest.approx(-drawn), "on to the next"
    assert made.effort_range is not None
    arm_m = 0.03
    assert made.effort_range.least_n < (made.friction - drawn) / arm_m < made.effort_range.most_n, "N at its rim"


FRIDGE = {"kind": "revolute", "axis": "0 0 1", "limit": "0 2", "xyz": "-0.33 -0.3 0.03"}
FRIDGE_DOOR = shape("0.05 0.6 1.6", xyz="0 0.3 0")


@pytest.mark.parametrize(("size", "least", "most"), [("0.6 0.6 1.7", 10.0, 20.0), ("0.6 0.6 1.65", 10.0, 20.0)])
def test_a_refrigerator_has_a_seal_that_lets_go_as_they_do(
    tmp_path: Path, size: str, least: float, most: float
) -> None:
    made = only(described(tmp_path, "a", "Refrigerator", "A fridge.", FRIDGE_DOOR, "door", body=shape(size), **FRIDGE))
    assert made.mechanism == "seal" and made.bias is not None
    assert least < -made.exerted(made.closed) / 0.6 < most, "N at its edge"
    assert made.exerted(0.05) == 0.0, "and nothing once it is open by a few centimetres"


def test_a_seal_never_tips_what_stands_light(tmp_path: Path) -> None:
    small = shape("0.05 0.1 0.3", xyz="0 0.05 0")
    hinge = {"kind": "revolute", "axis": "0 0 1", "limit": "0 2", "xyz": "-0.075 -0.05 0.01"}
    words = "A toy fridge 0.3 m tall that weighs 0.5 kg."
    made = only(described(tmp_path, "a", "Refrigerator", words, small, "door", body=shape("0.1 0.1 0.33"), **hinge))
    assert made.bias is not None and -made.exerted(made.closed) < 0.5 * 0.5 * 9.81 * 0.1, "half of what tips it"


@pytest.mark.parametrize(("closed", "caught"), [(0.0, True), (0.002, True), (1.0, False)])
def test_a_catch_presses_on_a_stop_alone(closed: float, caught: bool) -> None:
    door = make_features("7").movable_joints[0]
    span = Range(door, 0.0, 2.0, closed, 2.0, Source.AUTHORED)
    kind = Handling(ANY, anywhere=False, counterbalanced=False)
    for mechanism in CAUGHT:
        start = Start(span, closed, Source.RULE, requested=False)
        bias = mechanism_bias(start, replace(kind, mechanism=mechanism, lever=0.4), 0.0, PhysicsSettings())
        assert (bias is not None) is caught, "what is shut in the middle of its range would run away"


@pytest.mark.parametrize(("spring", "left"), [(0.0, 14.0), (-8.0, 6.0), (-30.0, 3.5), (8.0, 14.0)])
def test_a_catch_and_the_springs_that_pull_a_door_shut_let_go_together(spring: float, left: float) -> None:
    door = make_features("7").movable_joints[0]
    kind = Handling(ANY, anywhere=False, counterbalanced=True, mechanism="latch", lever=0.7)
    for way in (1.0, -1.0):
        low, high = sorted((0.0, 2.0 * way))
        start = Start(Range(door, low, high, 0.0, 2.0 * way, Source.AUTHORED), 0.0, Source.RULE, requested=False)
        bias = mechanism_bias(start, kind, 0.0, PhysicsSettings(), way * spring)
        assert bias is not None and -way * bias.at(0.0) == pytest.approx(left), "20 N at its edge, of both together"


@pytest.mark.parametrize(
    ("name", "arm_m", "mechanism", "least", "most"),
    [
        ("compartment", 0.18, "latch", 4.0, 22.2),
        ("cupboard", 0.35, "latch", 1.0, 5.0),
        ("shampoo", 0.05, "detent", 2.0, 45.0),
        ("power_strip", 0.02, "bistable", 1.0, 15.0),
        ("shutter", 1.0, "spring return", 0.5, 4.0),
    ],
)
def test_what_keeps_a_planted_part_lets_go_at_a_hands_force(
    tmp_path: Path, name: str, arm_m: float, mechanism: str, least: float, most: float
) -> None:
    item = next(one for one in (*PLANTED, *HELD) if one.name == name)
    found = only(overlay_of(made(item, tmp_path / "in"), tmp_path))
    assert found.mechanism == mechanism
    assert least < (abs(found.exerted(found.initial_position)) + found.friction) / arm_m < most, "N at its edge"


@pytest.mark.parametrize(("load", "closed_load", "caught"), [(1.0, 0.0, True), (-1.0, 0.0, False), (1.0, -0.5, False)])
def test_a_leaf_that_gravity_opens_is_caught_and_one_that_gravity_shuts_is_not(
    load: float, closed_load: float, caught: bool
) -> None:
    """Load at 90° and where it is shut, N·m towards larger angles: a · cos(q) + b · sin(q)."""
    hinge = make_features("7").movable_joints[0].model_copy(update={"openness_confidence": 1.0})
    span = Range(hinge, 0.0, math.pi / 2.0, 0.0, math.pi / 2.0, Source.AUTHORED)
    leaf = Handling(ANY, anywhere=False, counterbalanced=False, leaf=True)
    pull = Pull(0.0, closed_load, load, prismatic=False)
    assert pull.at(span.open) == pytest.approx(load)
    settings = PhysicsSettings()
    assert (caught_where_it_drops(leaf, span, pull, settings).mechanism == "latch") is caught
    guess = replace(span, joint=hinge.model_copy(update={"openness_confidence": 0.1}))
    assert caught_where_it_drops(leaf, guess, pull, settings) is leaf, "which end is shut is a guess"
    flap = replace(span, lower=-3.0, open=-3.5)
    assert caught_where_it_drops(leaf, flap, Pull(0.0, closed_load, -load), settings) is leaf, "a carton's flap"
    bail = replace(leaf, leaf=False)
    assert caught_where_it_drops(bail, span, pull, settings) is bail, "a bail hangs down"


HEAVY = {
    "chest": (
        "Box", "A wooden chest 1.2 m wide that weighs 60 kg, lid half open.", shape("0.5 1 0.45"),
        shape("0.5 1 0.03", xyz="-0.25 0 0.015"), {"axis": "0 1 0", "limit": "0 1.9", "xyz": "0.25 0 0.226"},
    ),
    "flap": (
        "StorageFurniture", "A wall cabinet 1.2 m wide with a flap that opens upwards, flap half open.",
        shape("0.35 1.2 0.6"), shape("0.025 1.2 0.6", xyz="0 0 -0.3"),
        {"axis": "0 1 0", "limit": "0 1.6", "xyz": "-0.19 0 0.3"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("force", [-7.5, 28.0])
def test_the_spring_of_a_slide_is_as_strong_at_either_end(force: float) -> None:
    slide = make_features("7").movable_joints[1]
    bias = steady_force(Range(slide, -0.02, 0.1, -0.02, 0.1, Source.AUTHORED), force)
    assert [bias.at(place) for place in (-0.02, 0.0, 0.1)] == pytest.approx([force] * 3)


@pytest.mark.parametrize(("axis", "mechanism"), [("0 0 1", "strut"), ("0 1 0", "friction")])
def test_a_sash_that_slides_up_is_balanced(tmp_path: Path, axis: str, mechanism: str) -> None:
    frame, sash = shape("0.06 1 1.6", xyz="0.05 0 0"), shape("0.04 0.9 0.7", xyz="0 0 -0.4")
    slide = {"axis": axis, "limit": "0 0.6"}
    overlay = described(
        tmp_path, "sash", "Window", "", sash, "translation_window", body=frame, kind="prismatic", up="z", **slide
    )
    made = only(overlay)
    assert made.mechanism == mechanism
    carried, weight = made.exerted(made.initial_position), made.gravity_load
    assert carried == pytest.approx(-0.95 * weight, rel=1e-3) if axis == "0 0 1" else carried == 0.0


@pytest.mark.parametrize("name", HEAVY)
def test_what_gravity_shuts_and_no_hand_would_lift_has_a_strut(tmp_path: Path, name: str) -> None:
    category, words, body, part, hinge = HEAVY[name]
    label = "rotation_lid" if name == "chest" else "rotation_door"
    overlay = described(tmp_path, name, category, words, part, label, body=body, kind="revolute", up="z", **hinge)
    made = only(overlay)
    assert made.mechanism == "strut" and made.effort_range is not None
    carried = made.exerted(made.initial_position)
    assert carried * made.gravity_load < 0.0 and abs(carried) > 0.6 * abs(made.gravity_load)
    lever = 0.5 if name == "chest" else 0.6
    force = (abs(made.gravity_load + carried) + made.friction) / (lever * overlay.scale)
    assert force < made.effort_range.most_n, "by hand"
    assert made.friction > abs(made.gravity_load + carried), "and it stays"


def test_a_model_may_name_a_mechanism(tmp_path: Path) -> None:
    item = read(written(tmp_path, robot(
        link("base", BODY), link("part", shape("0.03 0.02 0.008")),
        joint("turn", "revolute", "base", "part", xyz="0 0 0.12", axis="0 1 0", limit="-0.2 0.2"),
    )))  # fmt: skip
    for mechanism, holds in (("bistable", True), ("friction", True), ("free", False)):
        asked = JointProposal(name="turn", mechanism=mechanism)
        overlay, _ = validate(item, Overlay(scale=1.0, joints=(asked,)), Source.MODEL, 0.5, NO_VIEWS.physics)
        made = only(overlay)
        assert (made.mechanism, made.holds) == (mechanism, holds) and (made.bias is not None) is (
            mechanism == "bistable"
        )


@pytest.mark.parametrize(
    ("at", "closed", "opened", "end"),
    [
        (0.0, 0.0, 0.2, -0.2),
        (0.0, 0.0, -0.2, 0.2),
        (0.15, 0.0, 0.2, 0.2),
        (0.05, 0.2, -0.2, 0.2),
        (0.0, -0.2, 0.2, -0.2),
    ],
)
def test_what_snaps_starts_at_an_end_of_its_range(
    tmp_path: Path, at: float, closed: float, opened: float, end: float
) -> None:
    """Also where what counts as closed is the middle, as of a lever that is drawn upright."""
    hinge = joint("turn", "revolute", "base", "part", xyz="0 0 0.12", axis="0 1 0", limit="-0.2 0.2")
    parts = link("base", BODY), link("part", shape("0.03 0.02 0.008"))
    turn = read(written(tmp_path, robot(*parts, hinge))).features.joint("turn")
    span = Range(turn, -0.2, 0.2, closed, opened, Source.AUTHORED)
    assert nearer_end(Start(span, at, Source.RULE, False)) == end


def test_a_rocker_starts_where_a_search_has_placed_it(tmp_path: Path) -> None:
    item = read(written(tmp_path, robot(
        link("base", BODY), link("part", shape("0.03 0.02 0.008")),
        joint("turn", "revolute", "base", "part", xyz="0 0 0.12", axis="0 1 0", limit="-0.2 0.2"),
    )))  # fmt: skip
    snaps = Overlay(scale=1.0, joints=(JointProposal(name="turn", mechanism="bistable"),))
    for placed, start in (({}, (-0.2, 0.2)), ({"turn": 0.19}, (0.19,))):
        overlay, _ = validate(item, snaps, Source.MODEL, 0.5, NO_VIEWS.physics, placed=placed)
        assert only(overlay).initial_position in start


@pytest.mark.system
@pytest.mark.parametrize("name", ["chest", "flap", "fridge", "switch"])
def test_mechanisms_pass_every_check_in_every_engine(tmp_path: Path, name: str) -> None:
    if name in HEAVY:
        category, words, body, part, hinge = HEAVY[name]
        hinge, label = {"kind": "revolute", **hinge}, "rotation_lid" if name == "chest" else "rotation_door"
    elif name == "fridge":
        category, words, body, part, hinge, label = (
            "Refrigerator", "A fridge.", shape("0.6 0.6 1.7"), FRIDGE_DOOR, FRIDGE, "door",
        )  # fmt: skip
    else:
        category, words, body, part, label = "Switch", "A light switch, off.", PLATE, shape("0.008 0.03 0.05"), "switch"
        hinge = {"kind": "revolute", "axis": "0 1 0", "limit": "-0.12 0.12", "xyz": "-0.008 0 0"}
    kind = hinge["kind"]
    made = robot(
        link("base", body),
        link("part", part),
        joint("turn", kind, "base", "part", **{k: v for k, v in hinge.items() if k != "kind"}),
    )
    folder = written(tmp_path / name, made, {"semantics.txt": f"base free body\npart hinge {label}\n"})
    ref = AssetRef(asset_id=name, path=str(folder), category=category, prompt=words, up=UpAxis.Z)
    record = refine_asset(ref, tmp_path / "out", NO_VIEWS, prior)
    assert record.status is Status.OK, record.reason


@pytest.mark.parametrize(
    ("category", "words", "height_m", "most_n"),
    [("GarageDoor", "A garage door.", 2.1, 150.0), ("StorageFurniture", "A wall unit with a lift-up door.", 0.4, 22.2)],
)
def test_what_is_lifted_open_is_balanced_over_its_whole_arc(
    tmp_path: Path, category: str, words: str, height_m: float, most_n: float
) -> None:
    """A panel hinged along its upper edge weighs m g h / 2 sin(q) on its hinge; it stays wherever it is left, and a
    hand moves it (EN 12604 for garages)."""
    body, part, kind, xyz, axis, limit = flap(1.1 * height_m, height_m, 0.3)
    hinge = {"body": body, "kind": kind, "xyz": xyz, "axis": axis, "limit": limit, "up": "z"}
    overlay = described(tmp_path, "lifted", category, words, part, "door", **hinge)
    made, (panel,) = only(overlay), (item for item in overlay.links if item.name == "part")
    half = 0.5 * height_m * overlay.scale
    for position in np.linspace(0.1, 1.4, 7):
        left = made.exerted(position) - 9.81 * panel.mass_kg * half * math.sin(position)
        assert abs(left) < made.friction, f"it stays at {position:.2f}"
        assert abs(left) + made.friction < most_n * 2.0 * half


@pytest.mark.parametrize(
    ("category", "limit", "words", "free", "start"),
    [
        ("TrashCan", "-1.2 1.15", "", True, 0.0),
        ("TrashCan", "-1.2 1.15", "A swing bin, its flap half open.", True, 0.575),
        ("TrashCan", "0 1.2", "", False, 0.0),
        ("Box", "-1.2 1.15", "", False, None),
    ],
)
def test_a_bins_lid_that_opens_to_either_side_swings(
    tmp_path: Path, category: str, limit: str, words: str, free: bool, start: float | None
) -> None:
    """It hangs shut below its pins, as it is drawn, and falls back there; boxes are drawn half open."""
    flap, hinge = shape("0.2 0.2 0.02", xyz="0 0 -0.03"), {"kind": "revolute", "axis": "0 1 0", "xyz": "0 0 0.6"}
    body = shape("0.3 0.3 0.5", xyz="0 0 0.25") + shape("0.3 0.02 0.15", xyz="0 0.14 0.575")
    overlay = described(tmp_path, "bin", category, words, flap, "lid", body=body, limit=limit, **hinge)
    made = only(overlay)
    assert (made.mechanism == "free") is free and made.holds is not free
    if start is not None:
        assert made.initial_position == pytest.approx(start, abs=0.03)
    if free:
        mass = next(item.mass_kg for item in overlay.links if item.name == "part")
        falls = mass * 9.81 * 0.03 * overlay.scale * math.sin(0.3)
        assert made.closed == pytest.approx(0.0, abs=0.03) and made.friction < falls, "from 17 degrees it falls back"


def test_a_screw_is_said_to_turn_in_its_plane(tmp_path: Path) -> None:
    jar = made(next(one for one in HELD if one.name == "pickles"), tmp_path / "in")
    (said,) = (item for item in validated(jar, tmp_path / "out").findings if item.code == "screw_in_place")
    assert said.value is not None and said.limit is not None and 1.0 < said.value < said.limit < 10.0, "N·m"


@pytest.mark.parametrize(
    ("across_m", "high_m", "kg", "start_n"), [(0.205, 0.29, 1.5, 5.0), (0.25, 0.4, 2.4, 10.0), (0.29, 0.65, 4.5, 15.0)]
)
def test_a_pedal_bin_is_heavy_enough_for_a_foot(
    tmp_path: Path, across_m: float, high_m: float, kg: float, start_n: float
) -> None:
    """Bins of 5, 12 and 30 l weigh what makers state, within a factor of 1.6; a pedal takes at most half of what tips
    its bin over the edge before which the foot presses, m g r / reach."""
    pedal, reach = shape("0.05 0.08 0.004", xyz="-0.025 0 0"), 0.05
    hinge = {"kind": "revolute", "axis": "0 -1 0", "limit": "0 0.2", "xyz": f"{-across_m / 2.0} 0 0.02", "up": "z"}
    body = round_shape(across_m / 2.0, high_m, f"0 0 {high_m / 2.0}")
    overlay = described(tmp_path, "bin", "TrashCan", "A pedal bin.", pedal, "foot_pad", body=body, **hinge)
    mass, made = sum(item.mass_kg for item in overlay.links), only(overlay)
    assert kg / 1.6 < mass < 1.6 * kg
    end = made.stiffness * abs(made.spring_reference - made.open) / reach
    assert end < 0.6 * mass * 9.81 * across_m / 2.0 / reach
    assert made.stiffness * abs(made.spring_reference - made.closed) / reach > start_n


def test_a_staplers_arm_presses_back_as_it_is_pressed_shut_and_opens_lightly_to_be_filled(tmp_path: Path) -> None:
    arm, plate = shape("0.16 0.02 0.01", xyz="0.08 0 0.005"), shape("0.18 0.04 0.01", xyz="0.08 0 -0.005")
    made = only(
        described(
            tmp_path, "stapler", "Stapler", "A slightly open stapler, with spring behavior in its joint for stapling.",
            arm, "lid", body=plate, kind="revolute", axis="0 -1 0", limit="0 2.3",
        )
    )  # fmt: skip
    assert made.bias is not None and made.mechanism == made.bias.kind == "spring return"
    rest = made.initial_position
    assert 0.1 < rest < 1.0 and made.bias.at(rest) == 0.0
    pressed = made.bias.at(made.closed) + made.stiffness * (rest - made.closed)
    assert pressed == pytest.approx(3.0 * 0.16, rel=0.1), "3 N at its edge; it was pressed by 0.4 N"
    opened = -made.bias.at(rest + 0.5)
    assert 0.0 < made.friction < opened < pressed, "it comes back from wherever it is opened to, and swings no more"


def test_a_chairs_gas_spring_is_locked_where_it_is_set_down(tmp_path: Path) -> None:
    seat = shape("0.45 0.45 0.08") + shape("0.05 0.4 0.5", xyz="-0.2 0 0.3")
    overlay = described(tmp_path, "chair", "Chair", "An office chair.", seat, "seat", body=shape("0.5 0.5 0.4"),
                        kind="prismatic", axis="0 0 -1", xyz="0 0 0.25", limit="0 0.07")  # fmt: skip
    made, kg = only(overlay), next(link.mass_kg for link in overlay.links if link.name == "part")
    fall_j, sags_m = 9.81 * kg * 0.02, 0.1 * 0.07 * overlay.scale
    braked_n = made.friction - abs(made.gravity_load + made.exerted(made.initial_position))
    assert made.holds and braked_n * sags_m > fall_j, "of a fall of 2 cm it keeps nine tenths of its height"
