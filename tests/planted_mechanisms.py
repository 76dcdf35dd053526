"""Objects as other datasets name their parts, with what a hand expects of each: written before any rule was fitted to
them. ``python -m tests.planted_mechanisms FOLDER [NAME …]`` refines all, or these, pushes them and prints them.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from schemas.asset import AssetRef
from schemas.features import Features
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import Status, UpAxis
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, joint, link, prior, robot, shape, written
from tests.hand import Felt, felt


def round_shape(radius: float, length: float, xyz: str = "0 0 0", along: str = "0 0 0") -> str:
    """A URDF cylinder as visual and collision; ``along`` turns it from z, rpy."""
    inside = f'<origin xyz="{xyz}" rpy="{along}"/><geometry><cylinder radius="{radius}" length="{length}"/></geometry>'
    return "".join(f"<{tag}>{inside}</{tag}>" for tag in ("visual", "collision"))


def leaf(width: float, height: float, depth: float = 0.5, low: float = 0.02, thick: float = 0.02) -> tuple[str, ...]:
    """A leaf on an upright hinge before a body: body, part, type, place, axis, limits."""
    body = shape(f"{depth} {width} {height + 2 * low}", xyz=f"0 0 {height / 2 + low}")
    part = shape(f"{thick} {width} {height}", xyz=f"0 {width / 2} 0")
    return body, part, "revolute", f"{-depth / 2 - thick / 2 - 0.002} {-width / 2} {height / 2 + low}", "0 0 1", "0 1.9"


def drop(width: float, height: float, depth: float = 0.55, low: float = 0.12) -> tuple[str, ...]:
    """A door that drops open on a hinge along its lower edge."""
    body = shape(f"{depth} {width} {height + 2 * low}", xyz=f"0 0 {height / 2 + low}")
    part = shape(f"0.03 {width} {height}", xyz=f"0 0 {height / 2}")
    return body, part, "revolute", f"{-depth / 2 - 0.017} 0 {low}", "0 -1 0", "0 1.5"


def flap(width: float, height: float, depth: float = 0.35) -> tuple[str, ...]:
    """A front that is lifted on a hinge along its upper edge."""
    body = shape(f"{depth} {width} {height}", xyz=f"0 0 {height / 2}")
    part = shape(f"0.018 {width} {height}", xyz=f"0 0 {-height / 2}")
    return body, part, "revolute", f"{-depth / 2 - 0.011} 0 {height}", "0 1 0", "0 1.5"


def lid(width: float, depth: float, height: float, thick: float = 0.01, most: float = 1.8) -> tuple[str, ...]:
    """A lid on a level hinge at the back of a body."""
    part = shape(f"{depth} {width} {thick}", xyz=f"{-depth / 2} 0 {thick / 2}")
    body = shape(f"{depth} {width} {height}", xyz=f"0 0 {height / 2}")
    return body, part, "revolute", f"{depth / 2} 0 {height + 0.001}", "0 1 0", f"0 {most}"


def drawer(width: float, height: float, depth: float, travel: float) -> tuple[str, ...]:
    """A block that slides out of the front of a body of shelves."""
    wall = shape(f"{depth} {width + 0.04} 0.02", xyz=f"0 0 {2 * height + 0.02}")
    body = wall + shape(f"{depth} {width + 0.04} {height}", xyz=f"0 0 {height / 2}")
    part = shape(f"{depth} {width} {height - 0.02}")
    return body, part, "prismatic", f"-0.01 0 {1.5 * height}", "-1 0 0", f"0 {travel}"


def push(size: float, travel: float, body: str = "0.04 0.12 0.2") -> tuple[str, ...]:
    """A button on the front of a body, which goes into it."""
    depth, _, height = (float(value) for value in body.split())
    part = round_shape(size / 2, 0.006, "-0.003 0 0", "0 1.5708 0")
    at = f"{-depth / 2 - travel} 0 {height / 2}"
    return shape(body, xyz=f"0 0 {height / 2}"), part, "prismatic", at, "1 0 0", f"0 {travel}"


def turn(radius: float, limits: str = "", body: str = "0.3 0.3 0.3", bar: bool = False) -> tuple[str, ...]:
    """A knob, or a bar across, that turns on the front of a body."""
    depth, _, height = (float(value) for value in body.split())
    disc = round_shape(radius, 0.02, "-0.012 0 0", "0 1.5708 0")
    part = shape(f"0.012 {2 * radius} 0.014", xyz="-0.012 0 0") if bar else disc
    kind = "revolute" if limits else "continuous"
    return shape(body, xyz=f"0 0 {height / 2}"), part, kind, f"{-depth / 2} 0 {height / 2}", "1 0 0", limits


def cap(radius: float, height: float, limits: str = "") -> tuple[str, ...]:
    """A round cap on top of a round body."""
    body = round_shape(1.3 * radius, height, f"0 0 {height / 2}")
    kind = "revolute" if limits else "continuous"
    return body, round_shape(radius, 0.02, "0 0 0.011"), kind, f"0 0 {height}", "0 0 1", limits


def lever(length: float, axis: str, limits: str, body: str = "0.08 0.08 0.25") -> tuple[str, ...]:
    """A stick that turns on the front of a body."""
    depth, _, height = (float(value) for value in body.split())
    part = shape(f"0.012 {length} 0.015", xyz=f"-0.02 {length / 2} 0")
    place = f"{-depth / 2} 0 {0.8 * height}"
    return shape(body, xyz=f"0 0 {height / 2}"), part, "revolute", place, axis, limits


@dataclass(frozen=True)
class Planted:
    """An object: dataset's category, words, semantic label, link and joint name, shape; least and most force (N) at its
    part's edge the harder way from shut; ``left``: what it does when left at half its way; the range of its longest
    edge (m) and of its part's mass (kg), how it is held, and the joint position at which it is shut."""

    name: str
    category: str
    words: str
    label: str
    names: tuple[str, str]
    shape: tuple[str, ...]
    force_n: tuple[float, float]
    left: str = ""
    size_m: tuple[float, float] = (0.0, 100.0)
    part_kg: tuple[float, float] = (0.0, 1000.0)
    support: str = ""
    shut: float | None = None


P = Planted
PLANTED = (
    # GAPartNet: parts by "<motion>_<part>", joints joint_0
    P("gap_microwave", "Microwave", "A microwave oven.", "hinge_door", ("link_0", "joint_0"), leaf(0.34, 0.26, 0.35),
      (6, 35), "latched"),
    P("gap_drawer", "StorageFurniture", "A chest of drawers.", "slider_drawer", ("link_0", "joint_0"),
      drawer(0.5, 0.2, 0.4, 0.3), (1, 22.2), "stays"),
    P("gap_button", "Remote", "A remote control.", "slider_button", ("link_0", "joint_0"),
      push(0.01, 0.0015, "0.02 0.05 0.18"), (0.5, 4), "returns"),
    P("gap_bin", "TrashCan", "A bin, closed.", "hinge_lid", ("link_0", "joint_0"), lid(0.3, 0.3, 0.4), (0.5, 22.2)),
    P("gap_knob", "Oven", "An oven.", "hinge_knob", ("link_0", "joint_0"), turn(0.02, "0 4.7", "0.5 0.6 0.6"), (0.3,
      15),
      "stays"),
    P("gap_handle", "Door", "A door.", "revolute_handle", ("link_0", "joint_0"),
      lever(0.12, "1 0 0", "0 0.8", "0.05 0.9 2"), (4, 22.2), "returns"),
    # AKB-48: no labels, categories in lower case
    P("akb_bottle", "bottle", "", "", ("bottle_lid", "joint_1"), cap(0.016, 0.22), (25, 150), "stays"),
    P("akb_scissor", "scissor", "", "", ("scissor_blade_2", "joint_1"),
      lever(0.15, "1 0 0", "0 0.9", "0.006 0.02 0.15"), (0.3, 22.2), "stays"),
    P("akb_cutter", "cutter", "A box cutter.", "", ("cutter_blade", "joint_1"),
      push(0.012, 0.04, "0.15 0.02 0.03"), (1, 22.2), "stays"),
    P("akb_condiment", "condiment", "A jar of mustard with a screw top.", "", ("screw_top", "joint_0"),
      cap(0.035, 0.1, "0 12"), (25, 150), "stays"),
    # OPDMulti: drawer, door, lid; no category
    P("opd_fridge", "", "A fridge.", "door", ("part_3", "joint_3"), leaf(0.6, 1.5, 0.6, 0.05, 0.05), (10, 20),
      "swings"),
    P("opd_washer", "WashingMachine", "A washing machine.", "door", ("part_2", "joint_2"),
      leaf(0.34, 0.34, 0.5, 0.25, 0.04), (8, 45), "latched"),
    # robosuite
    P("suite_door", "", "A door in a frame.", "", ("Door_latch", "latch_joint"),
      lever(0.13, "1 0 0", "0 1.57", "0.05 0.9 2"), (4, 22.2), "returns"),
    P("suite_leaf", "", "A door.", "", ("Door_door", "Door_hinge"), leaf(0.8, 2.0, 0.15, 0.02, 0.04), (0.3, 22.2),
      "swings"),
    # Gazebo
    P("gz_valve", "", "A pipe valve.", "", ("valve_wheel", "wheel_joint"), turn(0.12, "", "0.3 0.2 0.4"), (2, 220),
      "stays"),
    P("gz_mailbox", "", "A mailbox.", "", ("mailbox_flag_link", "flag_joint"),
      lever(0.15, "1 0 0", "0 1.57", "0.3 0.2 0.25"), (0.3, 22.2), "stays"),
    P("gz_fuel_can", "", "A jerry can.", "", ("gas_cap_link", "gas_cap_joint"), cap(0.03, 0.35), (25, 150), "stays"),
    P("gz_panel", "", "A control panel.", "", ("push_button_link", "push_button_joint"), push(0.03, 0.005), (0.5, 11),
      "returns"),
    P("gz_toggle", "", "A machine with a toggle switch.", "", ("toggle_switch_link", "toggle_switch_joint"),
      lever(0.03, "0 0 1", "-0.3 0.3", "0.1 0.2 0.2"), (1, 15), "snaps"),
    P("gz_gripper_case", "", "A case.", "", ("caseLidLink", "caseLidJoint"), lid(0.4, 0.3, 0.12), (0.5, 22.2)),
    # RoboCasa
    P("casa_microwave", "Microwave", "A microwave.", "", ("microdoorroot", "microjoint"), leaf(0.36, 0.28, 0.38),
      (6, 35), "latched"),
    P("casa_stove", "", "A gas stove.", "", ("knob_front_left_main", "knob_front_left_joint"),
      turn(0.02, "0 2.9", "0.6 0.7 0.9"), (0.3, 15), "stays"),
    P("casa_sink", "", "A kitchen sink with a tap.", "", ("handle_main", "handle_joint"),
      lever(0.1, "1 0 0", "0 1.2", "0.4 0.6 0.3"), (1, 22.2), "stays"),
    P("casa_coffee", "CoffeeMachine", "A coffee machine.", "", ("start_button_main", "start_button_joint"),
      push(0.02, 0.003, "0.25 0.2 0.35"), (0.5, 11), "returns"),
    P("casa_dishwasher", "Dishwasher", "A dishwasher.", "", ("door_main", "door_joint"), drop(0.6, 0.6), (8, 45),
      "latched"),
    P("casa_oven", "Oven", "An oven.", "", ("door_main", "door_joint"), drop(0.58, 0.4), (8, 45), "latched"),
    P("casa_fridge_bin", "Refrigerator", "A fridge with a drawer.", "", ("fridge_drawer0", "drawer0_slide"),
      drawer(0.5, 0.25, 0.5, 0.35), (1, 22.2), "stays"),
    # words for parts that no dataset's list has
    P("dimmer", "", "A wall dimmer.", "dimmer", ("a", "j"), turn(0.025, "0 4.7", "0.02 0.08 0.08"), (0.2, 10), "stays"),
    P("selector", "WashingMachine", "A washing machine.", "program_selector", ("a", "j"),
      turn(0.03, "", "0.55 0.6 0.85"), (0.3, 15), "stays"),
    P("combination", "Safe", "A safe.", "combination_dial", ("a", "j"), turn(0.04, "", "0.4 0.4 0.4"), (0.2, 15),
      "stays"),
    P("treadle", "TrashCan", "A pedal bin.", "treadle", ("a", "j"),
      lid(0.08, 0.1, 0.05, 0.01, 0.3), (8, 60), "returns"),
    P("desk_lamp", "Lamp", "A desk lamp.", "lower_arm", ("a", "j"),
      lever(0.35, "1 0 0", "-1 1", "0.15 0.15 0.1"), (0.5, 22.2), "stays"),
    P("baby_gate", "", "A baby gate.", "swing_gate", ("a", "j"), leaf(0.75, 0.8, 0.05, 0.02), (0.3, 22.2), "swings"),
    P("cupboard", "StorageFurniture", "A cupboard.", "leaf", ("a", "j"), leaf(0.35, 0.6, 0.3), (0.3, 22.2), "swings"),
    P("small_door", "StorageFurniture", "A bathroom cabinet.", "panel_door", ("a", "j"), leaf(0.25, 0.35, 0.15),
      (0.2, 22.2), "swings"),
    P("butterfly", "", "A ball valve.", "butterfly_handle", ("a", "j"), turn(0.04, "0 1.57", "0.1 0.06 0.06", True),
      (1, 45), "stays"),
    P("car_bonnet", "", "A car body 3.5 m long with a bonnet, bonnet half open.", "bonnet", ("a", "j"),
      lid(1.3, 1.0, 0.8, 0.03, 1.0), (0.5, 60), "stays"),
    P("lift_front", "StorageFurniture", "A wall cabinet 0.9 m wide with a front that is lifted, half open.",
      "lift_up_front", ("a", "j"), flap(0.9, 0.4), (0.5, 45), "stays"),
    P("toolbox", "", "A toolbox.", "clasp", ("a", "j"), lever(0.05, "0 1 0", "0 1.5", "0.2 0.4 0.2"), (2, 40)),
    P("fan", "Fan", "A fan.", "rotor", ("a", "j"), turn(0.15, "", "0.1 0.15 0.4"), (0, 2)),
)  # fmt: skip

FRESH = (
    P("front_door_right", "StorageFurniture", "A kitchen base unit.", "", ("frontDoorRight", "j_4"), leaf(0.45, 0.7,
      0.5),
      (0.1, 22.2), "swings"),
    P("sliding", "Wardrobe", "A wardrobe.", "sliding_door_left", ("a", "j"), drawer(0.9, 1.6, 0.5, 0.8), (1, 40),
      "stays"),
    P("porthole", "WashingMachine", "A washing machine.", "porthole", ("a", "j"), leaf(0.34, 0.34, 0.5, 0.25, 0.04),
      (8, 45), "latched"),
    P("cooker_dial", "", "A cooker.", "", ("stove_dial_3", "dial_3_hinge"), turn(0.022, "0 5", "0.6 0.6 0.9"), (0.3,
      15),
      "stays"),
    P("corked", "", "A wine bottle.", "", ("cork_link", "cork_slide"),
      (round_shape(0.035, 0.3, "0 0 0.15"), round_shape(0.01, 0.04, "0 0 0.01"), "prismatic", "0 0 0.31", "0 0 1",
       "0 0.05"), (2, 150), "stays"),
    P("throttle", "", "A boat's control.", "", ("throttle_lever", "throttle"), lever(0.2, "1 0 0", "-1 1"), (1, 45),
      "stays"),
    P("brake", "", "A driving simulator.", "", ("brake_pedal_link", "brake"), lid(0.06, 0.12, 0.3, 0.01, 0.4), (8, 90),
      "returns"),
    P("doorbell", "", "A doorbell.", "", ("bell_push_button", "push"), push(0.02, 0.003, "0.03 0.06 0.1"), (0.5, 11),
      "returns"),
    P("lamp_switch", "Lamp", "A table lamp with a switch.", "switch", ("a", "j"),
      lever(0.02, "0 0 1", "-0.2 0.2", "0.12 0.12 0.3"), (0.5, 15), "snaps"),
    P("breaker", "", "A fuse box.", "breaker_switch", ("a", "j"), lever(0.03, "0 0 1", "-0.35 0.35", "0.1 0.3 0.3"),
      (2, 30), "snaps"),
    P("fridge_upper", "", "A tall refrigerator.", "", ("fridgeDoorUpper", "upper_hinge"), leaf(0.6, 0.6, 0.6, 0.5,
      0.05),
      (10, 20), "swings"),
    P("hot_tap", "", "A washbasin with two taps.", "", ("faucet_handle_hot", "hot"), turn(0.03, "0 3.1", "0.4 0.5 0.2"),
      (1, 22.2), "stays"),
    P("shower", "", "A shower.", "shower_valve", ("a", "j"), turn(0.035, "0 3.1", "0.1 0.2 0.3"), (0.5, 22.2), "stays"),
    P("volume", "", "An amplifier.", "volume", ("a", "j"), turn(0.02, "0 4.7", "0.3 0.4 0.12"), (0.1, 8), "stays"),
    P("case_latch", "Suitcase", "A suitcase.", "latch_left", ("a", "j"), lever(0.04, "0 1 0", "0 1.5", "0.2 0.6 0.4"),
      (2, 40)),
    P("piano", "", "A piano.", "piano_key", ("a", "j"), lid(0.022, 0.4, 0.8, 0.02, 0.05), (0.2, 3)),
    P("gearshift", "", "A car's cockpit.", "gearshift", ("a", "j"), lever(0.25, "1 0 0", "-0.4 0.4", "0.4 0.3 0.4"),
      (1, 60), "stays"),
    P("glovebox", "", "A car's dashboard.", "", ("glovebox_lid", "glovebox"), drop(0.35, 0.2, 0.4), (0.5, 45)),
    P("jam", "", "A jar of jam.", "", ("jarLid", "lid_turn"), cap(0.035, 0.1), (25, 150), "stays"),
    P("box_top", "", "A cardboard box.", "", ("flap_left_2", "flap2"), lid(0.3, 0.15, 0.2), (0.05, 22.2)),
)  # fmt: skip
"""Written after the tables had been widened for those above, and before they were run."""

HELD = (
    P("basin_mixer", "Faucet", "A basin mixer.", "mixer_lever", ("a", "j"), lever(0.1, "0 -1 0", "0 0.5"), (1, 22.2),
      "stays", (0.1, 0.4)),
    P("garden_tap", "", "A garden tap.", "", ("spigot_handle", "spigot"),
      turn(0.03, "0 1.57", "0.06 0.04 0.08", True), (1, 45), "stays"),
    P("cross_tap", "", "A bath tub with a tap.", "", ("cross_handle", "valve_1"), turn(0.035, "", "0.7 1.6 0.6"),
      (1, 22.2), "stays", (1.3, 1.9)),
    P("soap", "", "A bottle of liquid soap.", "", ("pump_head_link", "pump"),
      (round_shape(0.035, 0.14, "0 0 0.07"), round_shape(0.012, 0.03, "0 0 0.03"), "prismatic", "0 0 0.14", "0 0 -1",
       "0 0.015"), (8, 45), "returns"),
    P("shampoo", "Bottle", "A shampoo bottle.", "flip_top", ("a", "j"),
      (round_shape(0.03, 0.18, "0 0 0.09"), round_shape(0.025, 0.015, "-0.025 0 0.008"), "revolute", "0.025 0 0.181",
       "0 1 0", "0 2"), (2, 45)),
    P("pickles", "", "A jar of pickles.", "", ("twist_off_lid", "twist"), cap(0.04, 0.13, "0 6.28"), (25, 150),
      "stays", (0.1, 0.25)),
    P("pills", "", "A pill bottle.", "", ("childproof_cap", "cap_turn"), cap(0.018, 0.07), (15, 150), "stays"),
    P("range", "Oven", "A kitchen range.", "oven_door", ("a", "j"), drop(1.16, 0.65, 0.97, 0.41), (8, 45), "latched",
      (0.8, 1.05)),
    P("double_oven", "Oven", "", "upper_door", ("a", "j"), drop(0.48, 0.37, 0.46, 0.37), (8, 45), "latched",
      (1.05, 1.5), support="fixed"),
    P("wall_unit", "StorageFurniture", "A kitchen wall unit.", "door", ("link_2", "j"), leaf(0.4, 0.7, 0.3, 0.01),
      (0.2, 22.2), "swings", (0.55, 1.0), support="fixed"),
    P("medicine", "", "A mirrored medicine cabinet.", "", ("mirror_door", "mirror_hinge"), leaf(0.4, 0.55, 0.13, 0.01),
      (0.2, 22.2), "swings", (0.4, 0.8), support="fixed"),
    P("locker", "", "A steel locker.", "locker_door", ("a", "j"), leaf(0.3, 1.7, 0.45, 0.05, 0.001), (0.2, 22.2),
      "swings", (1.4, 2.0), (1.5, 12)),
    P("fridge_sheet", "Refrigerator", "", "door", ("link_1", "joint_1"), leaf(0.6, 1.6, 0.6, 0.05, 0.001), (10, 20),
      "swings", (1.4, 2.0), (6, 30)),
    P("strongbox", "Safe", "", "door", ("link_1", "joint_1"), leaf(0.35, 0.35, 0.35, 0.03, 0.002), (0.1, 22.2), "",
      (0.25, 0.9), (3, 60)),
    P("paddle", "", "A light switch.", "", ("rocker_paddle", "paddle"), lever(0.03, "0 0 1", "-0.15 0.15",
      "0.02 0.08 0.12"), (1, 11), "snaps", (0.07, 0.16), support="fixed"),
    P("power_strip", "", "A power strip.", "", ("power_switch", "switch"), lever(0.01, "0 0 1", "-0.2 0.2",
      "0.05 0.3 0.04"), (1, 15), "snaps", (0.2, 0.6)),
    P("tool_chest", "", "A tool chest.", "draw_latch", ("a", "j"), lever(0.05, "0 1 0", "0 1.5", "0.3 0.5 0.25"),
      (2, 40)),
    P("compartment", "", "A car's dashboard with a glove compartment.", "", ("compartment_door", "compartment"),
      drop(0.35, 0.18, 0.3, 0.1), (4, 45), "latched"),
    P("fan_speed", "Fan", "A fan.", "speed_selector", ("a", "j"), turn(0.018, "0 4.7", "0.1 0.15 0.4"), (0.3, 15),
      "clicks"),
    P("open_bin", "TrashCan", "", "", ("top", "joint_0"),
      (shape("0.3 0.3 0.5", xyz="0 0 0.25"), shape("0.01 0.3 0.3", xyz="0 0 0.15"), "revolute", "0.15 0 0.506",
       "0 1 0", "-1.57 0.1"), (0.3, 22.2), shut=-1.57),
    P("suitcase_edge", "Suitcase", "A suitcase that stands on its edge.", "lid", ("a", "j"), leaf(0.6, 0.4, 0.1, 0.0,
      0.1), (0.1, 22.2), "", (0.4, 0.9), support="freestanding"),
    P("flush", "Toilet", "A toilet.", "", ("flush_handle", "flush"), lever(0.07, "1 0 0", "-0.5 0", "0.6 0.4 0.75"),
      (4, 22.2), "returns", (0.6, 0.95)),
    P("step_bin", "", "A step-on bin.", "", ("foot_pedal", "pedal_hinge"),
      (round_shape(0.13, 0.4, "0 0 0.2"), shape("0.06 0.05 0.002", xyz="-0.03 0 0"), "revolute", "-0.13 0 0.03",
       "0 -1 0", "0 0.15"), (15, 90), "returns"),
    P("shutter", "Camera", "A compact camera.", "shutter_release", ("a", "j"),
      (shape("0.03 0.1 0.06", xyz="0 0 0.03"), round_shape(0.004, 0.002, "0 0 0.001"), "prismatic", "0 0.03 0.06",
       "0 0 -1", "0 0.0002"), (0.5, 4), "returns", (0.08, 0.15)),
)  # fmt: skip
"""Written before any remedy of what they show, and run for the first time after they were committed."""

AFTER = (
    P("bread_box", "", "A bread box.", "", ("front_flap", "flap_hinge"), drop(0.35, 0.2, 0.25, 0.01), (1, 22.2),
      "latched"),
    P("mail_front", "", "A mailbox.", "", ("mail_door", "mail_hinge"), drop(0.2, 0.15, 0.3, 0.02), (1, 22.2),
      "latched"),
    P("sideboard", "", "A sideboard.", "", ("cupboardDoorLeft", "j_1"), leaf(0.45, 0.55, 0.4, 0.1), (1, 20), "swings"),
    P("vanity", "", "A bathroom vanity.", "door", ("link_0", "joint_0"), leaf(0.4, 0.5, 0.45, 0.1), (1, 20), "swings"),
    P("ketchup", "", "A ketchup bottle.", "", ("snap_lid", "snap"),
      (round_shape(0.03, 0.2, "0 0 0.1"), round_shape(0.02, 0.02, "-0.02 0 0.011"), "revolute", "0.02 0 0.201",
       "0 1 0", "0 2.2"), (2, 45)),
    P("flask", "", "A vacuum flask.", "", ("stopper_link", "stopper_turn"), cap(0.025, 0.25), (15, 150), "stays"),
    P("opener", "", "A garage door opener.", "", ("link_1", "joint_1"), push(0.012, 0.0015, "0.015 0.04 0.07"),
      (0.5, 11), "returns"),
    P("calculator", "", "A calculator.", "", ("k7", "k7_joint"), push(0.01, 0.0015, "0.01 0.08 0.15"), (0.25, 4),
      "returns"),
    P("cord", "", "A lamp with a switch in its cord.", "", ("slide_toggle", "toggle"), lever(0.008, "0 0 1",
      "-0.25 0.25", "0.02 0.025 0.06"), (0.5, 15), "snaps"),
    P("sewing", "", "A sewing machine's foot control.", "", ("sewing_pedal", "pedal"),
      lid(0.08, 0.12, 0.03, 0.005, 0.2), (2, 90), "returns"),
    P("spray", "", "A spray bottle.", "", ("trigger", "trigger_joint"), lever(0.05, "0 0 1", "0 0.4",
      "0.06 0.06 0.25"), (5, 45), "returns"),
    P("lighter", "", "A lighter.", "", ("thumb_button", "press"), push(0.01, 0.003, "0.012 0.025 0.08"), (0.5, 20),
      "returns"),
)  # fmt: skip
"""Written after the remedies of what those show, and before they were run."""

UNSEEN = (
    P("bar_tap", "", "A bar sink with a swan-neck tap.", "", ("tap_lever_link", "tap_lever"),
      lever(0.08, "0 -1 0", "0 0.6", "0.4 0.4 0.2"), (1, 22.2), "stays", (0.3, 0.8)),
    P("milk", "bottle", "A milk bottle.", "", ("red_cap", "cap_joint"), cap(0.019, 0.24), (20, 150), "stays",
      (0.15, 0.35)),
    P("wall_oven", "Oven", "A double wall oven.", "lower_door", ("a", "j"), drop(0.56, 0.45, 0.55, 0.4), (8, 45),
      "latched", (1.05, 1.5), support="fixed"),
    P("spice", "", "A spice cabinet hung on the wall.", "", ("cabinet_door_left", "hinge_l"),
      leaf(0.3, 0.4, 0.15, 0.01), (0.3, 22.2), "swings", (0.35, 0.7), support="fixed"),
    P("heater", "", "A fan heater.", "", ("on_off_rocker", "rocker"), lever(0.015, "0 0 1", "-0.2 0.2",
      "0.15 0.2 0.25"), (0.8, 15), "snaps", (0.15, 0.5)),
    P("toaster_oven", "", "A toaster oven.", "", ("function_selector", "selector"), turn(0.018, "", "0.3 0.45 0.25"),
      (0.3, 15), "clicks", (0.3, 0.6)),
    P("radio", "", "A table radio.", "tuning_knob", ("a", "j"), turn(0.015, "", "0.12 0.25 0.14"), (0.1, 8), "stays",
      (0.15, 0.4)),
    P("pocket_knife", "Knife", "A pocket knife.", "", ("main_blade", "pivot"), lever(0.08, "1 0 0", "0 3.1",
      "0.012 0.02 0.1"), (1, 22.2), "stays", (0.07, 0.25)),
    P("hamper", "", "A laundry hamper.", "", ("top_lid", "h"),
      (shape("0.4 0.4 0.6", xyz="0 0 0.3"), shape("0.01 0.4 0.4", xyz="0 0 0.2"), "revolute", "0.2 0 0.606",
       "0 -1 0", "-0.4 1.57"), (0.3, 22.2), size_m=(0.4, 0.9), shut=1.57),
    P("treasure", "", "A treasure chest.", "", ("chest_lid", "c"),
      (shape("0.3 0.5 0.3", xyz="0 0 0.15"), shape("0.01 0.5 0.3", xyz="0 0 0.15"), "revolute", "0.15 0 0.306",
       "0 1 0", "-1.57 0.3"), (0.5, 22.2), shut=-1.57),
    P("nappy_bin", "", "A nappy bin.", "", ("step_pedal", "p"),
      (round_shape(0.1, 0.4, "0 0 0.2"), shape("0.05 0.08 0.003", xyz="-0.025 0 0"), "revolute", "-0.1 0 0.02",
       "0 -1 0", "0 0.2"), (8, 90), "returns"),
    P("sustain", "", "A piano's sustain pedal.", "", ("damper_pedal", "d"),
      (shape("0.1 0.06 0.03", xyz="0 0 0.015"), shape("0.1 0.04 0.005", xyz="-0.05 0 0.003"), "revolute",
       "0.05 0 0.045", "0 -1 0", "0 0.1"), (3, 90), "returns"),
)  # fmt: skip
"""Written before any remedy of what they show, and before they were run."""

SELDOM = (
    P("breaker_panel", "", "A breaker panel in a hall.", "", ("panel_cover", "cover_hinge"), leaf(0.35, 0.5, 0.1,
       0.01, 0.003),
      (0.3, 22.2), "swings", (0.3, 0.8), (0.5, 4), "fixed"),
    P("press", "", "A French press.", "", ("plunger", "plunger_slide"),
      (round_shape(0.05, 0.18, "0 0 0.09"), round_shape(0.015, 0.03, "0 0 0.1") + round_shape(0.003, 0.1,
       "0 0 0.05"), "prismatic",
       "0 0 0.181", "0 0 -1", "0 0.1"), (2, 40), "stays", (0.15, 0.32), (0.02, 0.3)),
    P("vise_jaw", "", "A bench vise.", "", ("moving_jaw", "jaw_slide"),
      (shape("0.2 0.12 0.15", xyz="0 0 0.075"), shape("0.05 0.12 0.06"), "prismatic", "-0.13 0 0.13", "-1 0 0",
       "0 0.1"),
      (2, 100), "stays", (0.2, 0.45), (0.5, 8), "fixed"),
    P("vise_screw", "", "A bench vise.", "", ("screw_handle", "screw"), turn(0.08, "", "0.25 0.12 0.15", True),
       (2, 60), "stays",
      (0.2, 0.45), (0.03, 0.8), "fixed"),
    P("bell", "", "A bicycle bell.", "", ("thumb_lever", "thumb_hinge"),
      (round_shape(0.03, 0.04, "0 0 0.02"), shape("0.012 0.03 0.004", xyz="0 0.015 0"), "revolute",
       "-0.025 0.01 0.01", "0 0 1", "0 0.6"),
      (0.5, 11), "returns", (0.04, 0.1), (0.0005, 0.02)),
    P("cutter_arm", "", "A paper cutter for A4.", "", ("blade_arm", "arm_hinge"),
      (shape("0.3 0.42 0.03", xyz="0 0 0.015"), shape("0.03 0.4 0.012", xyz="0 0.2 0"), "revolute",
       "0.166 -0.2 0.04", "1 0 0", "0 1.2"),
      (0.5, 22.2), "", (0.28, 0.6), (0.2, 1.6), "freestanding"),
    P("steps", "", "A folding step ladder of five steps.", "", ("rear_frame", "rear_hinge"),
      (shape("0.03 0.45 1.6", xyz="0 0 0.8"), shape("0.025 0.4 1.58", xyz="0 0 -0.79"), "revolute", "0.03 0 1.6",
       "0 -1 0", "0 0.6"),
      (0.5, 30), "", (1.3, 2.0), (0.8, 5)),
    P("jack_arm", "", "A trolley jack.", "", ("lifting_arm", "arm_pivot"),
      (shape("0.6 0.25 0.1", xyz="0 0 0.06"), shape("0.35 0.06 0.04", xyz="-0.175 0 0"), "revolute",
       "0.15 0 0.14", "0 1 0", "0 0.9"),
      (2, 100), "stays", (0.4, 0.8), (0.8, 8), "freestanding"),
    P("drawer_lock", "", "A chest of drawers with a lock.", "", ("lock_cylinder", "key_turn"), turn(0.01,
       "0 1.57", "0.45 0.8 0.8"),
      (0.3, 15), "stays", (0.5, 1.3), (0.005, 0.15), "freestanding"),
    P("revolving", "", "A revolving door.", "", ("wings", "center_shaft"),
      (shape("2.2 2.2 0.1", xyz="0 0 2.3"), shape("0.05 2 2.1") + shape("2 0.05 2.1"), "continuous", "0 0 1.06",
       "0 0 1", ""),
      (2, 80), "", (2.1, 2.8), (60, 400), "fixed"),
    P("pepper", "", "A pepper mill.", "", ("mill_top", "top_turn"), cap(0.022, 0.15), (2, 60), "stays", (0.1,
       0.3), (0.02, 0.25)),
    P("syringe", "", "A syringe.", "", ("plunger_link", "plunger"),
      (round_shape(0.01, 0.1, "0 0 0.05"), round_shape(0.004, 0.06, "0 0 0.03") + round_shape(0.01, 0.002,
       "0 0 0.06"), "prismatic", "0 0 0.101", "0 0 -1",
       "0 0.05"), (0.5, 22.2), "stays", (0.08, 0.28), (0.001, 0.03), "handheld"),
    P("barn", "", "A sliding barn door 2.1 m tall.", "", ("door_panel", "door_slide"),
      (shape("0.1 2 0.1", xyz="0 0 2.2"), shape("0.04 1 2.1"), "prismatic", "0 -0.5 1.07", "0 1 0", "0 0.9"), (2,
       50), "stays",
      (2.0, 2.4), (15, 60), "fixed"),
    P("floor_pump", "", "A bicycle floor pump.", "", ("pump_handle", "pump_slide"),
      (round_shape(0.02, 0.55, "0 0 0.275") + shape("0.1 0.22 0.02", xyz="0 0 0.01"), shape("0.03 0.25 0.03",
       xyz="0 0 0.015"), "prismatic", "0 0 0.56", "0 0 1",
       "0 0.45"), (2, 60), "stays", (0.5, 0.8), (0.1, 0.8), "freestanding"),
)  # fmt: skip
"""Things of which no row spoke: written before any remedy of what they show; 2 of 14 at first run."""


ABSENT = (
    P("toggle", "Switch", "A light switch on the wall, off.", "switch", ("link_1", "joint_1"),
      (shape("0.012 0.075 0.12", xyz="0 0 0.06"), shape("0.02 0.01 0.012", xyz="-0.01 0 0"), "revolute",
       "-0.006 0 0.06", "0 1 0", "-0.4 0.4"), (0.5, 12), "snaps", (0.07, 0.16), (0.0003, 0.01), "fixed"),
    P("usb_cap", "USB", "A USB stick with its cap on.", "lid", ("link_1", "joint_1"),
      (shape("0.035 0.018 0.009", xyz="0.01 0 0.005") + shape("0.012 0.012 0.0045", xyz="-0.0135 0 0.005"),
       shape("0.0015 0.018 0.009", xyz="-0.0065 0 0") + shape("0.014 0.0015 0.009", xyz="0 0.0083 0")
       + shape("0.014 0.0015 0.009", xyz="0 -0.0083 0"), "prismatic", "-0.015 0 0.005", "-1 0 0", "0 0.02"), (0.5, 15),
      "stays", (0.04, 0.09), (0.0005, 0.006), "handheld"),
    P("stand_screen", "Display", "A computer monitor.", "translation_screen", ("link_1", "joint_1"),
      (shape("0.2 0.26 0.016", xyz="0.02 0 0.008") + shape("0.03 0.06 0.41", xyz="0.06 0 0.22"),
       shape("0.03 0.55 0.33"), "prismatic", "0.02 0 0.36", "0 0 1", "0 0.1"), (4, 60), "stays", (0.45, 0.75),
      (0.5, 5), "freestanding"),
    P("fan_column", "", "A pedestal fan.", "fan_pole", ("link_1", "joint_1"),
      (round_shape(0.2, 0.03, "0 0 0.015") + round_shape(0.02, 0.6, "0 0 0.33"),
       round_shape(0.012, 0.3) + round_shape(0.2, 0.1, "-0.06 0 0.3", "0 1.5708 0"), "prismatic", "0 0 0.78", "0 0 1",
       "0 0.25"), (4, 150), "stays", (0.9, 1.6), (0.5, 4), "freestanding"),
    P("mouse_button", "Mouse", "A wired office mouse.", "button", ("link_1", "joint_1"),
      (shape("0.085 0.06 0.026", xyz="0.012 0 0.015") + shape("0.03 0.06 0.018", xyz="-0.045 0 0.011"),
       shape("0.03 0.027 0.003", xyz="-0.015 0 0"), "revolute", "-0.03 0.0165 0.0222", "0 -1 0", "0 0.06"), (0.3, 2.5),
      "returns", (0.08, 0.14), (0.0005, 0.01)),
    P("mini_oven", "Oven", "A mini oven for the counter.", "door", ("link_1", "joint_1"), drop(0.35, 0.2, 0.3, 0.04),
      (3, 35), "latched", (0.33, 0.55), (0.4, 3.5), "freestanding"),
    P("wall_dimmer", "Switch", "A wall dimmer.", "knob", ("link_1", "joint_1"), turn(0.02, "0 4.7", "0.02 0.08 0.12"),
      (0.25, 10), "stays", (0.07, 0.16), (0.001, 0.05), "fixed"),
    P("mini_pump", "", "A bicycle mini pump.", "", ("handle", "slide"),
      (round_shape(0.011, 0.2, "0 0 0.1"), round_shape(0.013, 0.06, "0 0 0.03"), "prismatic", "0 0 0.201", "0 0 1",
       "0 0.15"), (1, 60), "stays", (0.15, 0.4), (0.01, 0.2), "handheld"),
)  # fmt: skip
"""Of 62 objects of kinds that no test data had, eight of what was wrong at first."""


def made(item: Planted, folder: Path) -> AssetRef:
    """The asset's folder, written."""
    body, part, kind, xyz, axis, limit = item.shape
    link_name, joint_name = item.names
    text = robot(
        link("base_link", body),
        link(link_name, part),
        joint(joint_name, kind, "base_link", link_name, xyz=xyz, axis=axis, limit=limit or None),
    )
    motion = {"prismatic": "slider"}.get(kind, "hinge")
    files = {"semantics.txt": f"base_link free body\n{link_name} {motion} {item.label}\n"} if item.label else {}
    path = str(written(folder / item.name, text, files))
    return AssetRef(asset_id=item.name, path=path, category=item.category or None, prompt=item.words, up=UpAxis.Z)


LEFT: dict[str, Callable[[Felt], bool]] = {
    "": lambda found: True,
    "stays": lambda found: abs(found.from_more - 0.6) < 0.05 and abs(found.from_less - 0.4) < 0.05,
    "returns": lambda found: max(abs(found.from_more), abs(found.from_less)) < 0.1,
    "snaps": lambda found: found.from_more > 0.95 and found.from_less < 0.05,
    # Let go between two clicks it moves to the nearer, with 8 to 24 of them a turn.
    "clicks": lambda found: 0.002 < abs(found.from_more - 0.6) < 0.06 and 0.002 < abs(found.from_less - 0.4) < 0.06,
    "swings": lambda found: 20.0 <= found.swings_deg <= 60.0,
    "latched": lambda found: found.then_n < 0.6 * found.force_n,
}


def faults(item: Planted, found: Felt) -> list[str]:
    """Ways in which a part is not what a hand expects."""
    low, high = item.force_n
    wrong = [] if low <= found.force_n <= high else [f"{found.engine}: {found.force_n:.3g} N, not {low:g} to {high:g}"]
    if not LEFT[item.left](found):
        seen = f"left at 0.6: {found.from_more:.2f}, at 0.4: {found.from_less:.2f}, then {found.then_n:.3g} N"
        wrong.append(f"{found.engine}: not '{item.left}' ({seen}, swings {found.swings_deg:.0f}°)")
    return wrong


def placed(item: Planted, overlay: PhysicsOverlay, features: Features) -> list[str]:
    """Ways in which size, mass, support and shut end are not what is expected."""
    (part,) = (one for one in overlay.links if one.name == item.names[0])
    found = [
        ("longest edge, m", overlay.scale * max(features.closed_size), item.size_m),
        ("part, kg", part.mass_kg, item.part_kg),
    ]
    if item.shut is not None:
        found.append(("shut at", overlay.joints[0].closed, (item.shut - 0.2, item.shut + 0.2)))
    wrong = [
        f"{what}: {value:.3g}, not {low:g} to {high:g}"
        for what, value, (low, high) in found
        if not low <= value <= high
    ]
    held = overlay.support.kind.value
    return wrong if item.support in ("", held) else [*wrong, f"{held}, not {item.support}"]


def main(folder: Path, names: list[str]) -> None:
    known = (*PLANTED, *FRESH, *HELD, *AFTER, *UNSEEN, *SELDOM, *ABSENT)
    bad, every = 0, [item for item in known if not names or item.name in names]
    for item in every:
        record = refine_asset(made(item, folder / "in"), folder / "out", NO_VIEWS, prior)
        wrong = [] if record.status is Status.OK else [f"{record.failure_mode}: {record.reason}"]
        if record.overlay is not None and record.features is not None:
            wrong += placed(item, record.overlay, record.features)
        place = folder / "out" / "assets" / item.name
        if (place / "overlay.json").is_file():
            for engine in ("mujoco", "pybullet"):
                wrong += faults(item, felt(place, engine))
        bad += bool(wrong)
        print(f"{item.name}: {'; '.join(wrong) or 'as expected'}", flush=True)
    print(f"{len(every) - bad} of {len(every)} as expected")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
