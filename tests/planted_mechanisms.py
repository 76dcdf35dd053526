"""Objects as other datasets name their parts, with what a hand expects of each: written before any rule was fitted to
them. ``python -m tests.planted_mechanisms FOLDER`` refines all, pushes them through ``asset2sim.load`` and prints them.
"""

import math
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asset2sim.load import load
from asset2sim.load.description import Description, Joint
from asset2sim.load.in_mujoco import MuJoCoObject
from asset2sim.load.in_pybullet import PyBulletObject
from asset2sim.load.loaded import Loaded
from asset2sim.load.shapes import points_of, vector
from schemas.asset import AssetRef
from schemas.vocabulary import Status, UpAxis
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, joint, link, prior, robot, shape, written

VISIBLE = 0.01
"""Share of its range, or of a turn, after which a part has been moved."""


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
    part's edge the harder way from shut; and ``left``: what it does when left at half its way."""

    name: str
    category: str
    words: str
    label: str
    names: tuple[str, str]
    shape: tuple[str, ...]
    force_n: tuple[float, float]
    left: str = ""


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


@dataclass(frozen=True)
class Felt:
    """As a hand finds it in one engine: the largest of the forces (N) at its edge that move it from shut, 0.2 of the
    way on (``then_n``), how far (share of its way, of a turn) from the start it is 2 s after it is left at 0.6 and at
    0.4, and how far it swings on from 1 rad/s in the middle, degrees."""

    engine: str
    force_n: float
    then_n: float
    from_more: float
    from_less: float
    swings_deg: float


@dataclass(frozen=True)
class Hand:
    """A hand at one joint: where it finds the part, its signed way from there, and the reach of its edge (m; 1 for a
    slider)."""

    world: Loaded
    joint: Joint
    shut: float
    way: float
    arm: float

    def at(self, share: float) -> float:
        return self.shut + share * self.way

    def put(self, share: float) -> None:
        self.world.reset()
        self.world.set_positions({self.joint.name: self.at(share)})

    def position(self) -> float:
        return self.world.positions()[self.joint.name]

    def left(self, share: float) -> float:
        """Where it is 2 s after it was left at a share of its way."""
        self.put(share)
        for _ in range(480):
            self.world.step()
        return (self.position() - self.shut) / self.way

    def moves(self, effort: float, share: float) -> bool:
        """Whether an effort of 1 s moves it visibly."""
        self.put(share)
        self.world.apply_effort({self.joint.name: effort})
        for _ in range(240):
            self.world.step()
            if (self.position() - self.at(share)) * np.sign(effort) > VISIBLE * abs(self.way):
                return True
        return False

    def force(self, share: float) -> float:
        """The larger of the forces (N) at its edge that move it either way; from shut, the one that opens it."""
        return max(
            self.least(sign, share) for sign in ((1.0, -1.0) if share > 0.0 else (math.copysign(1.0, self.way),))
        )

    def least(self, sign: float, share: float) -> float:
        low = high = 0.0
        for high in (0.5, 1.5, 5.0, 15.0, 50.0, 150.0, 500.0):
            if self.moves(sign * high * self.arm, share):
                break
            low = high
        for _ in range(6):
            middle = (low + high) / 2.0
            low, high = (low, middle) if self.moves(sign * middle * self.arm, share) else (middle, high)
        return high

    def swings_deg(self) -> float:
        """How far it swings on from 1 rad/s at 0.3 of its way; NaN for a slider."""
        if self.joint.type == "prismatic":
            return math.nan
        self.put(0.3)
        kick(self.world, self.joint.name, math.copysign(1.0, self.way))
        for _ in range(960):
            self.world.step()
        return math.degrees(abs(self.position() - self.at(0.3)))


def felt(folder: Path, engine: str) -> Felt:
    """The one joint of a refined object, its root held, pushed and let go through ``asset2sim.load``."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        world = load(folder, engine, fixed=True, position=(0.0, 0.0, 5.0))
    (one,) = world.about.joints
    shut, way = one.initial_position, 2.0 * math.pi
    if one.lower is not None:
        # A button's pressed end may be called closed: a hand starts from the end where it finds the part.
        ends = (one.closed, one.open)
        first, last = ends if abs(shut - one.open) > 0.01 * abs(one.open - one.closed) else ends[::-1]
        shut, way = first, last - first
    hand = Hand(world, one, shut, way, edge(world.about, one))
    return Felt(engine, hand.force(0.0), hand.force(0.2), hand.left(0.6), hand.left(0.4), hand.swings_deg())


def kick(world: Loaded, name: str, speed: float) -> None:
    """Give one joint a speed, rad/s, in MuJoCo or PyBullet."""
    if isinstance(world, PyBulletObject):
        world.bullet.resetJointState(world.body, world.joints[name], world.positions()[name], speed, **world.at)
    elif isinstance(world, MuJoCoObject):
        world.data.joint(name).qvel[0] = speed


def edge(about: Description, one: Joint) -> float:
    """Furthest reach of the part from its axis, m; 1 for a slider."""
    if one.type == "prismatic":
        return 1.0
    part = next(item for item in about.urdf.findall("link") if item.get("name") == one.link)
    hinge = next(item for item in about.urdf.findall("joint") if item.get("name") == one.name)
    axis = vector(hinge.find("axis"), "xyz", "1 0 0")
    return float(np.linalg.norm(np.cross(points_of(part, "collision"), axis / np.linalg.norm(axis)), axis=1).max())


LEFT: dict[str, Callable[[Felt], bool]] = {
    "": lambda found: True,
    "stays": lambda found: abs(found.from_more - 0.6) < 0.05 and abs(found.from_less - 0.4) < 0.05,
    "returns": lambda found: max(abs(found.from_more), abs(found.from_less)) < 0.1,
    "snaps": lambda found: found.from_more > 0.95 and found.from_less < 0.05,
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


def main(folder: Path) -> None:
    bad, every = 0, (*PLANTED, *FRESH)
    for item in every:
        record = refine_asset(made(item, folder / "in"), folder / "out", NO_VIEWS, prior)
        wrong = [] if record.status is Status.OK else [f"{record.failure_mode}: {record.reason}"]
        place = folder / "out" / "assets" / item.name
        if (place / "overlay.json").is_file():
            for engine in ("mujoco", "pybullet"):
                wrong += faults(item, felt(place, engine))
        bad += bool(wrong)
        print(f"{item.name}: {'; '.join(wrong) or 'as expected'}", flush=True)
    print(f"{len(every) - bad} of {len(every)} as expected")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
