"""A press neither tips nor slides what it is on: a box of 2 kg with a pedal in front and a button on its face."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from asset2sim.physics.arrays import Array
from asset2sim.physics.dynamics import joint_terms
from asset2sim.physics.kinematics import TreeJoint
from asset2sim.physics.mass_matrix import Body, PosedObject, Pull
from asset2sim.physics.terms import JointLoad, JointTerms
from asset2sim.validation.handling import Handling, as_asked, bounded_press, felt_press, handlings
from schemas.finding import Notes
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings
from schemas.support import SupportKind
from schemas.vocabulary import Source
from tests.builders import corners, tree_joint
from tests.factories import make_features

SETTINGS = PhysicsSettings()
G = 9.81
BOX = corners((-0.1, -0.1, 0.0), (0.1, 0.1, 0.4))
PRESSED = JointProposal(name="part", press_start=15.0, press_end=25.0)


def handled(points: Array, joint: TreeJoint, mass: float = 2.0, proposal: JointProposal = PRESSED) -> Handling:
    """How the box's one part is handled, its centre of mass at half its height, friction 0.5."""
    base = make_features("1")
    (kind,) = (item for item in base.joints if item.type == joint.type)
    own = kind.model_copy(update={"name": "part", "parent": "box", "child": "part", "closed": 0.0, "open": 1.0})
    links = tuple(base.links[1].model_copy(update={"name": name, "label": ""}) for name in ("box", "part"))
    features = base.model_copy(update={"root": "box", "links": links, "joints": (own,)})
    bodies = {"box": Body(mass, np.array([0.0, 0.0, 0.2]), np.eye(3)), "part": Body(0.0, np.zeros(3), np.eye(3))}
    clouds: Mapping[str, Array] = {"box": BOX, "part": points}
    item = PosedObject((joint,), "box", bodies, clouds, {"part": 0.0})
    return handlings(features, item, {"part": proposal}, 0.5, SETTINGS)["part"]


PEDAL = tree_joint("part", "revolute", "box", "part", axis=(0.0, 1.0, 0.0))
"""About y through the origin: its edge at x = 0.15 goes down as the angle grows."""
PEDAL_POINTS = corners((0.0, -0.02, 0.03), (0.15, 0.02, 0.03))
BUTTON = tree_joint("part", "prismatic", "box", "part", axis=(-1.0, 0.0, 0.0))
BUTTON_POINTS = corners((0.1, -0.01, 0.29), (0.11, 0.01, 0.31))


def test_a_foot_on_the_pedal_does_not_tip_the_bin() -> None:
    lever, length = (0.15, 0.03), math.hypot(0.15, 0.03)
    # About the front edge at x = 0.1: the press goes down 5 cm before it and back 3 cm above the floor.
    turning = lever[0] / length * (0.15 - 0.1) + lever[1] / length * 0.03
    found = handled(PEDAL_POINTS, PEDAL)
    assert found.lever == pytest.approx(length)
    assert found.tips_upward == pytest.approx(2.0 * G * 0.1 / turning)
    light = handled(PEDAL_POINTS, PEDAL, mass=0.4)
    assert light.tips_upward == pytest.approx(found.tips_upward / 5.0), "no hand holds a light bin down"


def test_a_finger_on_the_face_neither_slides_nor_tips_the_box() -> None:
    assert handled(BUTTON_POINTS, BUTTON).tips_upward == pytest.approx(min(0.5 * 2.0 * G, 2.0 * G * 0.1 / 0.3))


def test_what_a_hand_holds_is_pressed_at_will() -> None:
    assert handled(BUTTON_POINTS, BUTTON, mass=0.2).tips_upward == math.inf
    lying = tree_joint("part", "prismatic", "box", "part", axis=(0.0, 0.0, -1.0))
    assert handled(BUTTON_POINTS - [0.1, 0.0, 0.0], lying).tips_upward == math.inf, "the table bears it"


def test_a_press_that_is_too_strong_is_lowered_in_proportion_with_a_finding() -> None:
    kind, notes = handled(BUTTON_POINTS, BUTTON), Notes()
    most = SETTINGS.press_margin * kind.tips_upward
    weak = PRESSED.model_copy(update={"press_start": 1.0, "press_end": 2.0})
    assert bounded_press(weak, kind, 1.0, SETTINGS, notes) == weak and not notes.findings
    lowered = bounded_press(PRESSED, kind, 1.0, SETTINGS, notes)
    assert lowered.press_start == pytest.approx(0.6 * most) and lowered.press_end == pytest.approx(most)
    (finding,) = notes.findings
    assert (finding.code, finding.joint, finding.value) == ("press_bounded", "part", 25.0)


@pytest.mark.parametrize(
    "spring", [{"returns_s": 0.25}, {"spring_hz": 2.0}, {"press_start": 0.3, "press_end": 0.5}, {"press_end": 0.6}]
)
def test_a_spring_stated_by_its_time_or_by_too_light_a_press_is_made_to_be_felt(spring: dict[str, float]) -> None:
    kind, notes = handled(BUTTON_POINTS, BUTTON), Notes()
    kind = replace(kind, range=kind.range.model_copy(update={"least_n": 0.5}))
    moved = button_load()
    proposal = JointProposal(name="part", spring_rest=0.0, **spring)
    made = felt_press(proposal, kind, terms_of(proposal, moved), moved, notes)
    assert made is not None and made.press_start == pytest.approx(0.625)
    felt = terms_of(made, moved)
    assert felt.stiffness.value * abs(moved.rest - felt.spring_reference) == pytest.approx(0.625)
    (finding,) = notes.findings
    assert (finding.code, finding.joint) == ("press_assumed", "part") and finding.limit == pytest.approx(0.625)
    assert felt_press(made, kind, felt, moved, notes) is None, "what a press states stays"


def test_a_press_that_no_hand_has_is_one_of_its_kind() -> None:
    kind, notes, moved = handled(BUTTON_POINTS, BUTTON), Notes(), button_load()
    proposal = JointProposal(name="part", press_start=60.0, press_end=90.0)
    made = felt_press(proposal, kind, terms_of(proposal, moved), moved, notes)
    assert made is not None and made.press_start == pytest.approx(0.9 * kind.range.most_n) and notes.findings
    assert felt_press(made, kind, terms_of(made, moved), moved, notes) is None


def test_a_wheel_rolls_by_what_it_bears_and_not_by_its_own_weight() -> None:
    turns = np.arange(0.0, 2.0 * math.pi, math.pi / 12.0)
    rims = [np.stack([0.1 * np.cos(turns) + 0.2, np.full(24, y), 0.1 * np.sin(turns)], axis=1) for y in (-0.01, 0.01)]
    axle = tree_joint("part", "continuous", "box", "part", axis=(0.0, 1.0, 0.0), xyz=(0.2, 0.0, 0.0))
    body = np.vstack([BOX, corners((-0.21, -0.1, -0.1), (-0.2, 0.1, 0.4))])
    bodies = {"box": Body(2.0, np.array([0.0, 0.0, 0.2]), np.eye(3)), "part": Body(0.0, np.zeros(3), np.eye(3))}
    base = make_features("1")
    own = base.joints[1].model_copy(
        update={"name": "part", "type": "continuous", "parent": "box", "child": "part", "closed": 0.0, "open": 1.0}
    )
    links = tuple(base.links[1].model_copy(update={"name": n, "label": n}) for n in ("box", "wheel"))
    links = (links[0], links[1].model_copy(update={"name": "part"}))
    features = base.model_copy(update={"root": "box", "links": links, "joints": (own,)})
    clouds = {"box": body, "part": np.vstack(rims) - [0.2, 0.0, 0.0]}
    free = {"part": JointProposal(name="part", holds=False)}
    item = PosedObject((axle,), "box", bodies, clouds, {"part": 0.0})
    made = handlings(features, item, free, 0.5, SETTINGS)["part"]
    # Feet at x = -0.205 and the wheel at 0.2 share 2 kg almost evenly.
    assert made.range.kind == "wheel"
    assert made.range.least_n == pytest.approx(0.02 * 2.0 * G * 0.205 / 0.405, rel=1e-6)
    assert made.least_effort == pytest.approx(1.25 * 0.1 * made.range.least_n)
    held = handlings(features, item, free, 0.5, SETTINGS, carried=SupportKind.HANDHELD)["part"]
    assert held.range.least_n == 0.0, "in a hand it bears nothing"
    limited = own.model_copy(update={"type": "revolute", "lower": 0.0, "upper": 1.0})
    door = features.model_copy(update={"joints": (limited,)})
    hung = handlings(door, item, free, 0.5, SETTINGS)["part"]
    assert hung.range.least_n == 0.0, "what touches the floor, and does not roll, is not borne by it"
    heavy = bodies | {"box": Body(2000.0, np.array([0.0, 0.0, 0.2]), np.eye(3))}
    car = handlings(features, replace(item, bodies=heavy), free, 0.5, SETTINGS)["part"]
    assert car.range.least_n == pytest.approx(1000.0 * made.range.least_n)
    assert car.least_effort == pytest.approx(car.most_upward), "no hand turns the wheel of a car that stands on it"


def test_a_part_takes_what_its_user_says() -> None:
    said, notes = JointProposal(name="part", holds=True, effort_nm=0.3), Notes()
    kind = handled(PEDAL_POINTS, PEDAL, proposal=said)
    assert kind.asked_n == pytest.approx(0.3 / kind.lever)
    made = as_asked("part", kind, 0.0, notes)
    assert made.least_effort == pytest.approx(0.3) and made.most_upward == pytest.approx(0.3) and not notes.findings
    assert made.judged is not None and made.judged.most_n == kind.range.most_n, "it is judged as any of its kind"


def test_a_part_takes_no_less_than_it_weighs_nor_more_than_tips_its_object() -> None:
    said, notes = JointProposal(name="part", holds=True, effort_n=1e3), Notes()
    strong = as_asked("part", handled(PEDAL_POINTS, PEDAL, proposal=said), 0.0, notes)
    assert strong.most_downward == pytest.approx(0.9 * strong.lever * min(strong.tips_upward, strong.tips_downward))
    light = handled(PEDAL_POINTS, PEDAL, proposal=said.model_copy(update={"effort_n": 2.0}))
    assert as_asked("part", light, 5.0 * light.lever, notes).range == light.range
    assert [item.code for item in notes.findings] == ["effort_unmet", "effort_unmet"]


def test_a_catch_lets_go_at_what_is_asked_and_the_open_door_is_as_light_as_ever() -> None:
    said = JointProposal(name="part", holds=True, effort_n=5.0, mechanism="latch")
    kind = handled(PEDAL_POINTS, PEDAL, mass=20.0, proposal=said)
    made = as_asked("part", kind, 0.0, Notes())
    assert made.lets_go_n == 5.0 and made.range.least_n == kind.range.least_n


def test_what_is_hard_to_move_takes_half_of_the_most_of_its_kind() -> None:
    plain, stiff = (
        handled(BUTTON_POINTS, BUTTON, 200.0, JointProposal(name="part", holds=True, stiff=said))
        for said in (False, True)
    )
    assert stiff.range.least_n == pytest.approx(0.5 * plain.range.most_n) and plain.range.least_n < 1.0


def test_no_spring_and_a_spring_that_is_felt_stay_as_they_are() -> None:
    kind, notes, moved = handled(BUTTON_POINTS, BUTTON), Notes(), button_load()
    none = JointProposal(name="part", coast_s=0.1)
    assert felt_press(none, kind, terms_of(none, moved), moved, notes) is None
    kind = replace(kind, range=kind.range.model_copy(update={"least_n": 0.0}))
    soft = JointProposal(name="part", spring_rest=0.0, spring_hz=2.0)
    assert felt_press(soft, kind, terms_of(soft, moved), moved, notes) is None and not notes.findings


def button_load() -> JointLoad:
    """A button of 10 g with 5 mm of travel on a level slide."""
    level = Pull(0.0, 0.0, prismatic=True)
    return JointLoad(
        prismatic=True, inertia=0.01, least=0.01, held=0.01, pull=level, lower=0.0, upper=0.005, closed=0.0,
        open=0.005, rest=0.0,
    )  # fmt: skip


def terms_of(proposal: JointProposal, moved: JointLoad) -> JointTerms:
    return joint_terms(proposal, moved, holds=False, source=Source.MODEL, authored_damping=None, settings=SETTINGS)
