"""The check ``used``: what a hand opens and shuts, and what it must not take for that, each planted."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.assets.authored import read_overlay
from asset2sim.gym.contacts import pressures
from asset2sim.gym.guards import Guards
from asset2sim.gym.hand.gripper import HandWorld, open_world
from asset2sim.gym.hand.holds import CLEAR_M, HandHold, room_of, solid_of, way_of
from asset2sim.gym.hand.operate import Led, rate_of, share_by_hold
from asset2sim.gym.hand.poses import at_places, hand_rotations
from asset2sim.gym.hand.recorder import Recorder, bears
from asset2sim.gym.hand.surfaces import is_flush, share_between_pads, share_of_rubbing, surface_places
from asset2sim.gym.hand.used import HandWorlds, UsedJoint, fault_of, joints_to_try, no_task, use_joint, use_records
from asset2sim.gym.world import body_pose
from schemas.asset import AssetRef
from schemas.finding import Finding
from schemas.hand_settings import HandSettings
from schemas.mechanism import EffortRange
from schemas.overlay import JointPhysics
from schemas.settings import Settings
from schemas.support import Support, SupportKind
from tasks.by_hand import measure_used
from tasks.progress import AssetJob
from tests.assets import joint, link, prior, robot, shape
from tests.factories import make_joint, make_link
from tests.refined_things import BODY, Solid, drawer, inertial, refined, two

pytestmark = pytest.mark.system
CUBE = Solid(shape("0.3 0.3 0.3", xyz="0 0 0.15"), 20.0, 0.3)
KNOB = shape("0.02 0.03 0.03", xyz="0.04 0 0") + shape("0.04 0.012 0.012", xyz="0.02 0 0")


def chest(folder: Path, *, kg: float = 20.0, base: str = "0.3 0.3 0.3", fixed: bool = False, **terms: Any) -> Path:
    """A block with a front on a slide along x at its top, which has a knob; what is not said is sound."""
    depth, _, height = (float(size) for size in base.split())
    body = Solid(shape(base, xyz=f"0 0 {height / 2.0}"), kg, height)
    front, place = Solid(shape("0.02 0.16 0.1") + KNOB, 0.5, 0.1), f"{depth / 2.0 + 0.013} 0 {height - 0.06}"
    known = {"friction": 3.0, "damping": 5.0, "holds": True} | terms
    return two(folder, body, front, "prismatic", place, "1 0 0", 0.2, names=("front", "slide"), fixed=fixed, **known)


def used(folder: Path) -> UsedJoint:
    (found,) = use_records(folder, read_overlay(folder), HandSettings())
    return found


def opened(folder: Path) -> HandWorld:
    """The hand's world of an object, reset."""
    world = open_world(folder, HandSettings())
    world.reset()
    return world


def test_a_drawer_with_a_knob_is_pulled_and_pushed_and_stays(tmp_path: Path) -> None:
    found = used(chest(tmp_path / "chest"))
    assert found.done and found.by == "gripper" and found.reason == ""
    assert [led.kind for led in found.ways][-1] == "press" and len(found.ways) == 2
    assert all(led.reached > 0.9 and led.guards is not None and not led.guards.displaced for led in found.ways)


def test_poses_told_to_be_inside_the_object_are_those_at_which_its_engine_finds_no_room(tmp_path: Path) -> None:
    world = opened(chest(tmp_path / "chest"))
    way = way_of(world, "slide", 0.2)
    points, normals, _ = surface_places(world, way.bodies)
    turns = np.arange(len(points)) % 16
    poses, halves = at_places(world, "hook", points, normals, turns, np.zeros(len(points)))
    free = set(solid_of(world, way.bodies, points).free(world, poses, halves, CLEAR_M))
    room = {index for index in range(len(poses)) if room_of(world, way, poses[index], float(halves[index])) is not None}
    assert room and room <= free and len(free) < 0.5 * len(poses)


STRUT = {"kind": "strut", "slope": -60.0, "none_at": 0.1, "least": -12.0, "most": 12.0}
WEAK = {"stiffness": 30.0, "spring_reference": 0.12, "holds": False, "friction": 0.5}
PLANTED: dict[str, tuple[dict[str, Any], str | None, str]] = {
    "tips": ({"kg": 6.0, "base": "0.1 0.3 0.9", "friction": 40.0}, "object", "tips by"),
    "springs shut": ({"stiffness": 100.0, "spring_reference": -0.1, "holds": False}, None, ""),
    "weak spring": (WEAK, "object", "its spring"),
    "rebounds": ({"bias": STRUT}, "object", "left alone"),
    "rolls open again": ({"bias": STRUT, "holds": False}, "object", "left alone"),
    "rolls easily": ({"friction": 0.3, "damping": 0.5, "holds": False}, None, ""),
}


@pytest.mark.parametrize("name", PLANTED)
def test_what_is_planted_is_found_and_whose_fault_it_is(tmp_path: Path, name: str) -> None:
    terms, fault, said = PLANTED[name]
    found = used(chest(tmp_path / "chest", **terms))
    assert (found.done, found.fault or None) == (fault is None, fault), found
    assert said in found.reason


def plate(folder: Path, *, proud_m: float, friction: float = 2.0) -> Path:
    """A block with a plate without a knob on a slide along x, its front so far before the block's."""
    part = Solid(shape("0.02 0.16 0.1"), 0.5, 0.1)
    return two(folder, CUBE, part, "prismatic", f"{0.14 + proud_m} 0 0.15", "1 0 0", 0.2, names=("plate", "slide"),
               friction=friction, damping=5.0, holds=True)  # fmt: skip


def test_what_slides_away_has_no_hold_or_lies_inside_is_not_used(tmp_path: Path) -> None:
    folder = chest(tmp_path / "shoved", kg=5.0, friction=25.0)
    overlay = json.loads((folder / "overlay.json").read_text(encoding="utf-8"))
    overlay["contact_friction"] = 0.05
    (folder / "overlay.json").write_text(json.dumps(overlay), encoding="utf-8")
    assert "shoved by" in used(folder).reason
    flush, inside = used(plate(tmp_path / "flush", proud_m=0.0)), used(plate(tmp_path / "inside", proud_m=-0.05))
    assert (flush.done, flush.fault) == (False, "object") and "it is flush with" in flush.reason
    world = open_world(plate(tmp_path / "proud", proud_m=0.004), HandSettings(), 0.4)
    world.reset()
    way = way_of(world, "slide", 0.2)
    assert not is_flush(world, way.bodies, way.velocity)
    assert (inside.done, inside.fault) == (False, "object") and "lies inside" in inside.reason


def test_a_front_without_a_handle_is_rubbed_along_by_its_edge_and_the_force_is_known(tmp_path: Path) -> None:
    found = used(plate(tmp_path / "proud", proud_m=0.018))
    assert found.done and [led.kind for led in found.ways] == ["rub", "press"], found
    squeezed = HandSettings(grip_n=1.0, most_n=1.5)
    gentle = fault_of(found.ways[1], make_joint("slide"), True, squeezed)
    assert gentle == ("hand", f"a finger presses with {found.ways[1].contact_n:.0f} N")


def doors(folder: Path) -> Path:
    """A block and two doors without handles before it, which meet in its middle."""
    urdf = robot(
        link("body", shape("0.3 0.6 0.6", xyz="0 0 0.5") + inertial(20.0, 0.5)),
        link("left", shape("0.018 0.298 0.58", xyz="0.01 -0.149 0") + inertial(2.0, 0.3)),
        link("right", shape("0.018 0.298 0.58", xyz="0.01 0.149 0") + inertial(2.0, 0.3)),
        joint("one", "revolute", "body", "left", xyz="0.152 0.299 0.5", axis="0 0 1", limit="0 1.57"),
        joint("other", "revolute", "body", "right", xyz="0.152 -0.299 0.5", axis="0 0 -1", limit="0 1.57"),
    )
    known = {"upper": 1.57, "open": 1.57, "friction": 0.3, "damping": 0.3, "holds": True}
    hinges = [make_joint(name, "revolute", 0.0).model_copy(update=known) for name in ("one", "other")]
    return refined(folder, urdf, hinges, {"body": 20.0, "left": 2.0, "right": 2.0})


def test_a_finger_rubs_only_what_lies_beside_it_and_not_the_seam_of_two_doors(tmp_path: Path) -> None:
    folder = doors(tmp_path / "doors")
    for found in use_records(folder, read_overlay(folder), HandSettings()):
        assert found.done and found.by == "gripper", found
        assert (found.ways[0].kind, found.ways[0].holds) == ("rub", 1)
    world = opened(folder)
    bodies, pose = way_of(world, "one", 1.57).bodies, np.eye(4)
    pose[:3, :3] = hand_rotations(np.array([[-1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]))[0]
    # Beside the upper edge of the door, 18 mm deep: of places 9 and 2 mm before the pads' middle and 5 mm behind it.
    pose[:3, 3] = world.data.xpos[min(bodies)] + (0.013, -0.15, 0.29 + 0.009)
    for off, share in ((0.0, 1.0), (0.007, 2.0 / 3.0), (0.014, 1.0 / 3.0), (0.02, 0.0)):
        there = pose.copy()
        there[0, 3] += off
        assert share_of_rubbing(world, there, np.array([0.0, 0.0, -0.01]), bodies) == pytest.approx(share), off


def test_a_finger_that_rubs_presses_harder_and_pulls_more_where_a_drawer_sticks(tmp_path: Path) -> None:
    # Of 45 N, led 1 cm into an edge and half of it ahead, 20 N pull; led 0.8 of it ahead, 28 N do; no more than 32 N
    # (45 over the root of two) do with a friction of 1.
    for friction, done in ((25.0, True), (35.0, False)):
        found = used(plate(tmp_path / f"plate {friction:g}", proud_m=0.018, friction=friction))
        assert (found.ways[0].kind, found.done) == ("rub", done), found


def test_a_grasp_has_something_between_its_pads_or_is_missed(tmp_path: Path) -> None:
    world = opened(chest(tmp_path / "chest"))
    way = way_of(world, "slide", 0.2)
    knob, pose = world.data.xpos[min(way.bodies)] + (0.04, 0.0, 0.0), np.eye(4)
    pose[:3, :3], pose[:3, 3] = hand_rotations(np.array([[-1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]))[0], knob
    # The knob is 2 cm deep and 3 cm wide and high; a pad reaches 9 mm ahead of the middle, and 5 mm behind it.
    for off, share in ((0.0, 1.0), (0.007, 2.0 / 3.0), (0.018, 1.0 / 3.0), (0.03, 0.0)):
        pose[0, 3] = knob[0] + off
        assert share_between_pads(world, pose, 0.02, way.bodies) == pytest.approx(share), off
    joint_ = make_joint("slide", "prismatic", 0.0).model_copy(update={"upper": 0.2})
    local = np.linalg.inv(body_pose(world.data, min(way.bodies))) @ pose
    root = int(world.model.body(world.prefix + world.about.root).id)
    recorder = Recorder(world, joint_, way.bodies, root)
    recorder.sample()
    hold = HandHold("grasp", min(way.bodies), local, 0.02, 1.0, 1.0, np.zeros(3))
    share, takes, stopped = share_by_hold(recorder, way, hold, 0.2)
    assert recorder.missed == 1 and not stopped and share == pytest.approx(0.0, abs=1e-3)
    assert takes == pytest.approx(3.0, rel=0.02)  # its friction


def test_a_hand_accelerates_as_its_force_over_its_mass_and_rest_is_told_from_speed_and_acceleration(
    tmp_path: Path,
) -> None:
    world = opened(chest(tmp_path / "chest"))
    world.target[:3, 3] += [0.1, 0.0, 0.0]  # 400 N of its spring, of which it has 45, for 1 kg and two fingers of 0.1
    for _ in range(world.steps(0.04)):
        world.step()
    assert world.data.qvel[world.dof] == pytest.approx(45.0 / 1.2 * 0.04, rel=0.01)
    world.reset()
    dof = int(world.model.jnt_dofadr[world.joint("slide")])  # of 0.2 m: 0.4 mm are rest
    for speed, faster, stays in ((0.001, 0.0, True), (0.0015, 0.0, False), (0.0, 0.008, True), (0.0, 0.01, False)):
        world.data.qvel[:], world.data.qacc[:] = 0.0, 0.0
        world.data.qvel[dof], world.data.qacc[dof] = speed, faster
        assert world.stays(0.3) == stays


def test_a_blow_that_is_over_within_a_step_is_a_touch(tmp_path: Path) -> None:
    urdf = robot(
        link("body", shape("0.3 0.3 0.3", xyz="0 0 0.15") + inertial(20.0, 0.3)),
        link("front", shape("0.02 0.16 0.1") + inertial(0.02, 0.1)),
        joint("slide", "prismatic", "body", "front", xyz="0.163 0 0.24", axis="1 0 0", limit="0 0.2"),
    )
    slide = make_joint("slide", "prismatic", 0.0).model_copy(update={"upper": 0.2, "friction": 0.0, "damping": 0.0})
    world = open_world(refined(tmp_path / "light", urdf, [slide], {"body": 20.0, "front": 0.02}), HandSettings())
    way, pose = way_of(world, "slide", 0.0), np.eye(4)
    pose[:3, :3] = hand_rotations(np.array([[-1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]))[0]
    for off_m in np.linspace(0.0110, 0.0125, 16):  # of the pads' middle, whose tips are 1 cm ahead
        world.reset({"slide": 0.1})
        start, touched = world.position("slide"), False
        pose[:3, 3] = 0.163 + 0.1 + 0.01 + off_m, 0.0, 0.24
        world.put(world.data, pose, 0.0)
        world.target, world.data.qvel[world.dof] = pose.copy(), -0.4
        world.target[0, 3] -= 0.02
        while world.position("slide") == start:
            world.step()
            touched = touched or world.touches(way.bodies)
        assert touched, off_m


def test_a_joint_that_takes_less_than_a_hand_has_is_not_at_fault_where_a_finger_slips(tmp_path: Path) -> None:
    folder = plate(tmp_path / "plate", proud_m=0.018, friction=30.0)
    (found,) = use_records(folder, read_overlay(folder), HandSettings(pad_friction=0.1))
    assert (found.done, found.fault) == (False, "hand") and "slipped" in found.reason, found
    assert found.ways[0].takes == pytest.approx(30.0 / 45.0, abs=0.01)


def test_a_door_whose_seal_lets_go_is_not_thrown_but_led_on(tmp_path: Path) -> None:
    seal = {"kind": "seal", "slope": 300.0, "none_at": 0.04, "least": -9.0, "most": 0.0}
    door = Solid(shape("0.02 0.36 0.3", xyz="0.011 0.18 0.15"), 4.0, 0.3)
    found = used(two(tmp_path / "sealed", CUBE, door, "revolute", "0.15 -0.15 0", "0 0 -1", 1.57, fixed=True,
                     friction=0.03, damping=0.03, holds=True, bias=seal))  # fmt: skip
    assert found.done, found
    assert found.ways[0].guards is not None and found.ways[0].guards.untouched_share < 0.3


def test_a_wide_door_is_led_no_faster_at_its_edge_than_a_hand_goes_though_it_is_pushed_near_its_hinge(
    tmp_path: Path,
) -> None:
    door = Solid(shape("0.02 0.9 0.3", xyz="0.011 0.45 0.15"), 4.0, 0.3)
    world = opened(two(tmp_path / "wide", CUBE, door, "revolute", "0.15 -0.15 0", "0 0 -1", 1.57, fixed=True,
                       friction=0.03, damping=0.03, holds=True))  # fmt: skip
    way, edge_m = way_of(world, "joint", 1.57), 0.9
    # At 0.25 m/s and 1.5 rad/s 15 cm from the hinge its edge would go 1.35 m/s.
    assert rate_of(world, way, 0.15) * edge_m == pytest.approx(0.5, rel=0.02)
    assert rate_of(world, way, 0.9) * edge_m == pytest.approx(0.5, rel=0.02), "a way takes no longer than it must"
    assert rate_of(opened(chest(tmp_path / "chest")), way_of(opened(tmp_path / "chest"), "slide", 0.1), 1.0) == 0.25


def test_what_no_spring_moves_and_goes_most_of_its_way_untouched_was_not_used_though_it_does_not_hold() -> None:
    found = Guards(False, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, True, False, False, False, False)
    led, hinge = Led(1.0, 1.0, "press", 0.1, 1, found, 20.0, False), make_joint("hinge", "revolute", 0.0)
    swings = hinge.model_copy(update={"holds": False})
    assert fault_of(led, swings, False, HandSettings()) == ("hand", "it runs ahead for 80% of its way")
    sprung = swings.model_copy(update={"stiffness": 1.0})
    assert fault_of(led, sprung, False, HandSettings())[0] != "hand"
    struck = replace(led, guards=replace(found, untouched_share=0.0, moved_untouched=False, struck=True))
    assert "it is struck" in fault_of(struck, swings, False, HandSettings())[1]


def test_another_joint_that_moves_meanwhile_is_told(tmp_path: Path) -> None:
    urdf = robot(
        link("body", shape("0.3 0.3 0.3", xyz="0 0 0.15") + inertial(20.0, 0.3)),
        link("front", shape("0.02 0.16 0.1") + KNOB + inertial(0.5, 0.1)),
        link("weight", shape("0.05 0.05 0.05") + inertial(0.2, 0.05)),
        joint("slide", "prismatic", "body", "front", xyz="0.163 0 0.24", axis="1 0 0", limit="0 0.2"),
        joint("falls", "prismatic", "body", "weight", xyz="-0.2 0 0.1", axis="0 0 1", limit="0 0.1"),
    )
    slide = make_joint("slide", "prismatic", 0.0).model_copy(
        update={"upper": 0.2, "open": 0.2, "friction": 3.0, "damping": 5.0, "holds": True}
    )
    falls = make_joint("falls", "prismatic", 0.1).model_copy(update={"upper": 0.1, "open": 0.1})
    folder = refined(tmp_path / "two", urdf, [slide, falls], {"body": 20.0, "front": 0.5, "weight": 0.2}, fixed=True)
    found = use_joint(HandWorlds(folder, HandSettings()), slide, read_overlay(folder))
    assert found.done and found.reason == "meanwhile 'falls' goes 100% of its range", found


@pytest.mark.parametrize(("way_m", "done"), [(0.0015, True), (0.004, False)])
def test_a_key_is_pressed_as_far_as_a_finger_stays_with_it_not_as_a_blow_throws_it(
    tmp_path: Path, way_m: float, done: bool
) -> None:
    board = Solid(shape("0.3 0.3 0.1", xyz="0 0 0.05"), 5.0, 0.3)
    key = Solid(shape("0.012 0.012 0.01", xyz="0 0 -0.005"), 0.005, 0.01)
    found = used(two(tmp_path / "key", board, key, "prismatic", "0 0 0.102", "0 0 -1", way_m, friction=0.0,
                     damping=0.02, holds=False, stiffness=40.0, spring_reference=-0.008))  # fmt: skip
    assert found.done == done and ("it goes 2.0 mm deeper than it stands out" in found.reason) != done, found


def test_a_key_stands_out_only_as_far_as_a_finger_tip_has_room(tmp_path: Path) -> None:
    # A third of what is below the key is 3 mm deeper than the rest, as between convex pieces: no finger gets in there.
    base = shape("0.3 0.3 0.1", xyz="0 0 0.05") + shape("0.2 0.04 0.003", xyz="-0.1 0 0.1015")
    key = Solid(shape("0.006 0.006 0.004", xyz="0 0 0.002"), 0.002, 0.005)
    found = used(two(tmp_path / "key", Solid(base, 5.0, 0.3), key, "prismatic", "-0.001 0 0.0992", "0 0 -1", 0.0018,
                     friction=0.0, damping=0.02, holds=False, stiffness=200.0, spring_reference=-0.003))  # fmt: skip
    assert (found.done, found.fault) == (False, "object") and "deeper than it stands out" in found.reason, found


def test_a_key_too_deep_for_the_hand_is_tried_with_the_finger_tips_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, tools = chest(tmp_path / "chest"), list[str]()
    overlay = read_overlay(folder)
    deep = Led(0.75, 0.0, "press", 0.1, 1, None, 20.0, False, in_the_way=True, deeper_m=0.001)

    def pressed(world: HandWorld, joint: JointPhysics, by: str) -> UsedJoint:
        tools.append(by)
        return UsedJoint(joint.name, by == "fingertips", by, "object", "", (deep,))

    monkeypatch.setattr("asset2sim.gym.hand.used.both_ways", pressed)
    assert use_joint(HandWorlds(folder, HandSettings()), overlay.joints[0], overlay).done
    assert tools == ["gripper", "fingertips"]


def test_what_moved_along_once_is_held_from_then_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, tools = chest(tmp_path / "chest", kg=2.0), list[str]()
    overlay = read_overlay(folder)
    shoved = Guards(False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.06, False, False, False, False, displaced=True)

    def moved(world: HandWorld, joint: JointPhysics, by: str) -> UsedJoint:
        tools.append(by)
        return UsedJoint(
            joint.name, "other" in by, by, "object", "", (Led(0.2, 0.2, "press", 0.1, 1, shoved, 9, False),)
        )

    monkeypatch.setattr("asset2sim.gym.hand.used.both_ways", moved)
    worlds = HandWorlds(folder, HandSettings())
    assert all(use_joint(worlds, overlay.joints[0], overlay).done for _ in range(2))
    assert tools == ["gripper", "gripper and the other hand", "gripper and the other hand"]


def test_what_moved_along_is_held_and_tried_once_more_with_other_parts_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A carton is shoved by a hand at a flap that lies under others, further than the flap goes once it is held."""
    folder, tools = doors(tmp_path / "carton"), list[str]()
    fixed = read_overlay(folder)
    light = {"support": Support(kind=SupportKind.FREESTANDING), "links": (make_link("body", 0.5),)}
    overlay = fixed.model_copy(update=light)
    guards = Guards(False, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False, False, False, False, False)
    shoved = replace(guards, travelled_m=0.09, displaced=True)

    def pried(world: HandWorld, joint: JointPhysics, by: str) -> UsedJoint:
        tools.append(by)
        held = "other hand" in by
        led = Led(0.1 if held else 0.3, 0.0, "press", 0.1, 1, guards if held else shoved, 9, False)
        return UsedJoint(joint.name, "other parts open" in by, by, "hand" if held else "object", "", (led,))

    monkeypatch.setattr("asset2sim.gym.hand.used.both_ways", pried)
    assert use_joint(HandWorlds(folder, HandSettings()), overlay.joints[0], overlay).done
    assert tools[-1] == "gripper and the other hand, other parts open"


@pytest.mark.parametrize("counterbalance", [0.0, 0.1])
def test_what_lies_behind_a_door_is_used_once_that_is_open(tmp_path: Path, counterbalance: float) -> None:
    walls = "".join(
        shape(size, xyz=at)
        for size, at in (
            ("0.3 0.3 0.02", "0 0 0.01"), ("0.3 0.3 0.02", "0 0 0.29"), ("0.02 0.3 0.3", "-0.14 0 0.15"),
            ("0.3 0.02 0.3", "0 -0.14 0.15"), ("0.3 0.02 0.3", "0 0.14 0.15"),
        )
    )  # fmt: skip
    urdf = robot(
        link("body", walls + inertial(20.0, 0.3)),
        link("door", shape("0.02 0.3 0.3", xyz="0.01 0.15 0.15") + inertial(1.0, 0.3)),
        link("shelf", shape("0.2 0.2 0.02") + shape("0.02 0.2 0.06", xyz="0.1 0 0") + inertial(0.5, 0.1)),
        joint("hinge", "revolute", "body", "door", xyz="0.15 -0.15 0", axis="0 0 -1", limit="0 1.57"),
        joint("slide", "prismatic", "body", "shelf", xyz="0 0 0.15", axis="1 0 0", limit="0 0.15"),
    )
    known = {"friction": 0.3, "damping": 0.3, "holds": True}
    stays = {"upper": 1.57, "open": 1.57, "stiffness": counterbalance, **known}
    hinge = make_joint("hinge", "revolute", 0.0).model_copy(update=stays)
    slide = make_joint("slide", "prismatic", 0.0).model_copy(update={"upper": 0.15, "open": 0.15, **known})
    folder = refined(tmp_path / "cupboard", urdf, [hinge, slide], {"body": 20.0, "door": 1.0, "shelf": 0.5}, fixed=True)
    overlay = read_overlay(folder)
    found = use_joint(HandWorlds(folder, HandSettings()), overlay.joints[1], overlay)
    assert found.done and found.by.endswith("other parts open"), found


def stapler(folder: Path) -> Path:
    """A base, a cover that a spring holds half open, and a magazine under it that swings out where that is open."""
    base = shape("0.2 0.04 0.008", xyz="0 0 0.004") + shape("0.02 0.04 0.02", xyz="-0.09 0 0.01")
    urdf = robot(
        link("base", base + inertial(0.2, 0.1)),
        link("cover", shape("0.17 0.03 0.01", xyz="0.095 0 0.012") + inertial(0.06, 0.1)),
        link("magazine", shape("0.15 0.014 0.01", xyz="0.085 0 0") + inertial(0.05, 0.1)),
        joint("lid", "revolute", "base", "cover", xyz="-0.09 0 0.026", axis="0 -1 0", limit="0 2.3"),
        joint("body", "revolute", "cover", "magazine", axis="0 1 0", limit="0 2.6"),
    )  # fmt: skip
    lid = {"upper": 2.3, "open": 2.3, "stiffness": 0.3, "spring_reference": 0.46, "holds": False, "damping": 0.006}
    body = {"upper": 2.6, "open": 2.6, "friction": 0.1, "damping": 0.003, "holds": True}
    braced = EffortRange(kind="lid", least_n=0.0, most_n=22.2, source="a test", braced=True)
    joints = [
        make_joint("body", "revolute", 0.0).model_copy(update=body),
        make_joint("lid", "revolute", 0.16).model_copy(update=lid | {"friction": 0.0, "effort_range": braced}),
    ]
    return refined(folder, urdf, joints, {"base": 0.2, "cover": 0.06, "magazine": 0.05}, fixed=False)


def test_what_hangs_on_a_sprung_part_is_used_while_the_other_hand_keeps_that_open(tmp_path: Path) -> None:
    folder = stapler(tmp_path / "stapler")
    overlay = read_overlay(folder)
    body, lid = use_records(folder, overlay, HandSettings())
    assert lid.done and body.done and body.by.endswith("'lid' kept open"), (body, lid)
    assert not use_joint(HandWorlds(folder, HandSettings()), overlay.joints[0], overlay).done


def test_a_joint_is_kept_with_no_more_than_a_hand_has_until_the_world_is_reset(tmp_path: Path) -> None:
    world = open_world(stapler(tmp_path / "stapler"), HandSettings(), held=True)
    dof = int(world.model.jnt_dofadr[world.joint("lid")])
    for effort, stays in ((1.0, True), (0.01, False), (None, False)):  # its spring and weight close it with 0.46 N·m
        world.reset({"lid": 2.2})
        if effort is not None:
            world.keep("lid", effort)
        for _ in range(world.steps(0.5)):
            world.step()
        assert (abs(world.position("lid") - 2.2) < 0.02) == stays, effort
        assert world.model.dof_frictionloss[dof] == (effort or 0.0)


def test_a_shallow_dial_without_ends_is_turned_by_its_rim(tmp_path: Path) -> None:
    dial = '<origin xyz="0.006 0 0" rpy="0 1.5708 0"/><geometry><cylinder radius="0.02" length="0.012"/></geometry>'
    rim = Solid(f"<visual>{dial}</visual><collision>{dial}</collision>", 0.05, 0.03)
    found = used(two(tmp_path / "dial", CUBE, rim, "continuous", "0.151 0 0.2", "1 0 0", None, lower=None,
                     friction=0.05, damping=0.01, holds=True, label="knob"))  # fmt: skip
    assert found.done and {led.kind for led in found.ways} == {"grasp"}, found


def test_the_force_between_two_is_the_weight_that_one_bears(tmp_path: Path) -> None:
    world = opened(chest(tmp_path / "chest"))
    for _ in range(world.steps(0.5)):
        world.step()
    world.tool_geoms = world.model.geom_bodyid == 0
    found = list(pressures(world))
    assert sum(force for *_, force in found) == pytest.approx([0.0, 0.0, 20.5 * 9.81], abs=0.5)
    assert {tool for _, tool, _, _ in found} == {world.model.geom("floor").id}


def kind_of(kind: str, **ends: float | None) -> JointPhysics:
    effort = EffortRange(kind=kind, least_n=0.0, most_n=20.0, source="a test")
    return make_joint(kind).model_copy(update={"effort_range": effort, **ends})


def test_wheels_pedals_and_what_cannot_move_are_no_hands_task(tmp_path: Path) -> None:
    folder = drawer(tmp_path / "thing")
    loose = "part that swings or rolls freely"
    joints = (kind_of(loose, lower=None, upper=None), kind_of("foot pedal"), kind_of("lid", open=0.0), kind_of(loose))
    assert [no_task(item) for item in joints] == [
        "it rolls or swings freely", "no hand works a foot pedal", "it is open where it is closed", "",
    ]  # fmt: skip
    assert no_task(kind_of("wheel", lower=None, upper=None)) == "it rolls or swings freely"
    none = use_records(folder, read_overlay(folder).model_copy(update={"joints": joints[:3]}), HandSettings())
    assert [(item.done, item.fault) for item in none] == [(False, "task")] * 3
    many = [make_joint(f"key_{number}") for number in range(50)]
    assert [item.name for item in joints_to_try(many, 3)] == ["key_0", "key_24", "key_49"]


def test_it_warns_with_columns_and_decides_nothing(tmp_path: Path) -> None:
    job = AssetJob(AssetRef(asset_id="thing", path="thing"), Path("out"), Settings(checks=("used",)), prior)
    good = measure_used(job, chest(tmp_path / "good"))
    assert good.findings == () and (good.further["used"], good.further["used_joints"]) == (1.0, 1)
    bad = measure_used(job, chest(tmp_path / "bad", friction=400.0))
    (finding,) = bad.findings
    assert isinstance(finding, Finding) and (finding.code, finding.joint) == ("not_used", "slide")
    assert bad.further["used"] == 0.0
    assert "slide: object: not opened: it takes 8.9 times a hand's 45 N" in str(bad.further["used_reason"])
    assert measure_used(job, None).further == {}


def test_a_hose_is_bent_at_its_end_and_not_joint_by_joint(tmp_path: Path) -> None:
    """Nine rods of 10 cm one after the other, each on a stiff hinge of its own, held at one end."""
    rod, names = Solid(shape("0.09 0.03 0.03", xyz="0.05 0 0"), 0.1, 0.05), [f"rod{number}" for number in range(9)]
    links = [Solid(shape("0.1 0.1 0.4", xyz="-0.05 0 0.2"), 5.0, 0.2).link("body")] + [rod.link(name) for name in names]
    hinges = [
        joint(f"hinge{number}", "revolute", parent, child, xyz="0.1 0 0" if number else "0 0 0.3", axis="0 0 1",
              limit="-0.7 0.7")
        for number, (parent, child) in enumerate(zip(["body", *names], names, strict=False))
    ]  # fmt: skip
    terms = {"lower": -0.7, "upper": 0.7, "closed": 0.0, "open": 0.7, "friction": 0.3, "holds": True}
    joints = [make_joint(f"hinge{number}", "revolute").model_copy(update=terms) for number in range(9)]
    masses = {"body": 5.0} | dict.fromkeys(names, 0.1)
    found = use_records(folder := refined(tmp_path / "hose", robot(*links, *hinges), joints, masses),
                        read_overlay(folder), HandSettings())  # fmt: skip
    assert [(one.joint, one.done, one.fault) for one in found if one.fault != "task"] == [("hinge8", True, "")]
    assert {one.reason for one in found if one.fault == "task"} == {"it bends along with its chain, up to 'hinge8'"}


@pytest.mark.parametrize(("friction", "stays"), [(0.02, False), (0.3, True)])
def test_a_lid_that_leans_back_stays_there_and_falls_from_elsewhere(
    friction: float, stays: bool, tmp_path: Path
) -> None:
    # Of 0.1 kg, 0.1 m from its hinge: 0.1 N·m when level, none of it upright, where its friction holds it.
    lid = Solid(shape("0.2 0.2 0.01", xyz="0.1 0 0"), 0.1, 0.1)
    folder = two(tmp_path / "chest", BODY, lid, "revolute", "-0.1 0 0.17", "0 -1 0", 1.6,
                 names=("lid", "hinge"), start=1.55, friction=friction, damping=0.001, holds=True)  # fmt: skip
    urdf = folder / "mobility.urdf"
    middle = inertial(0.1, 0.1).replace("<inertial>", '<inertial><origin xyz="0.1 0 0"/>')
    urdf.write_text(urdf.read_text(encoding="utf-8").replace(inertial(0.1, 0.1), middle), encoding="utf-8")
    assert bears(open_world(folder, HandSettings()), "hinge", (0.0, 1.6)) is stays
    used = use_records(folder, read_overlay(folder), HandSettings())
    assert [one.done for one in used] == [True], used[0].reason
