"""The guidance's words: which part, which state, which feel. Expected positions are worked out by hand."""

import pytest

from asset2sim.guidance.lexicon import segments, tokenize
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.models.prior.answer import prior_overlay
from tests import prior_objects as known
from tests.prior_objects import Json, ask, felt

SLIGHTLY = 0.2
"""The upper end of the 10 to 20 % that the paper's prompt calls slightly open, of the travel that is used."""
SLIGHT_LID = SLIGHTLY * 1.9199
"""Lids and doors are used up to 110°, a laptop's screen to 130° and a stapler's cover to 90°."""
LEVEL = (0.0, 1.0, 0.0)
LIDS = known.thing(
    "Toilet", known.hinged("lid", "lid", axis=LEVEL), known.hinged("seat", "seat", axis=LEVEL, upper=1.5)
)
"""A toilet whose hinges lie level, so that gravity moves what hangs on them."""

SIDE_TABLE = 0.3166
"""Scale of the drawers, a cube of 1.6 m: by its edges and drawers a side table of 0.51 m."""
FRIDGE = known.thing("Refrigerator", known.hinged("door", "door", upper=3.14))

PAPER_AND_MANIFEST: list[tuple[Json, str, dict[str, float]]] = [
    (
        known.BOX,
        "A small box with slightly open rotational lid. Low damping for a smooth hinge behavior.",
        {"lid": -1.0 + SLIGHT_LID},
    ),
    (
        known.BOX,
        (
            "A very small jewelry box or treasure chest with a slightly open rotational lid. Low damping for smooth "
            "hinge behavior."
        ),
        {"lid": -1.0 + SLIGHT_LID},
    ),
    (
        known.BUCKET,
        "A small plastic bucket with its handle swung halfway over. The handle swings freely.",
        {"handle": 0.0},
    ),
    (
        known.LAPTOP,
        "I want a slightly open laptop. Low damping for smooth operation.",
        {"screen": -1.8 + SLIGHTLY * 2.2689},
    ),
    (
        known.MICROWAVE,
        "I want a microwave opening its door halfway. Low damping for hinge-like behavior.",
        {"door": 0.8},
    ),
    (
        known.MICROWAVE,
        "I want a microwave with its door halfway open. Low damping for hinge-like behavior.",
        {"door": 0.8},
    ),
    (known.SAFE, "A small steel safe with its door wide open. The door is heavy and moves slowly.", {"door": 3.0}),
    (known.STAPLER, "I want a slightly open stapler.", {"lid": -0.3 + SLIGHTLY * 1.5708}),
    (
        known.STAPLER,
        "I want a slightly open stapler, with spring behavior in its joint for pressing/stapling.",
        {"lid": -0.3 + SLIGHTLY * 1.5708},
    ),
    (
        known.SUITCASE,
        "A small suitcase with its lid open all the way and its handle folded down.",
        {"lid": 3.14, "handle": 1.57},
    ),
    (
        known.SUITCASE,
        "I want a small purse or handbag with the handle moving freely, resting sideways.",
        {"handle": 1.57},
    ),
    (
        known.SUITCASE,
        "I want a small business suitcase with its lid slightly open and a low damping hinge.",
        {"lid": SLIGHT_LID},
    ),
    (
        known.DRAWERS,
        (
            "I want a very small two-drawer under-desk office cabinet, with the first drawer closed and the second "
            "slightly open, with low damping sliding joints."
        ),
        {"d0": 0.0, "d1": 0.1},
    ),
    (
        known.DRAWERS,
        (
            "I want a small office drawer cabinet with its top drawer slightly open and all the other drawers "
            "closed, low friction slides."
        ),
        {"d0": 0.1, "d1": 0.0, "d2": 0.0},
    ),
    (
        known.TOASTER,
        "A countertop toaster with its lever up. The lever springs back when it is released.",
        {"lever": 0.0},
    ),
    (
        known.TOILET,
        "I want a very small toilet for a baby, with its lid open all the way. Low damping for hinge-like behavior.",
        {"lid": 1.6},
    ),
    (
        known.TRASHCAN,
        "A very small personal trash can with its lid slightly open. The hinge has low damping and holds its position.",
        {"lid": SLIGHT_LID},
    ),
    (known.BOTTLE, "A plastic bottle with its cap in place.", {"cap": 0.0}),
    (
        known.GLASSES,
        "A pair of eyeglasses, both temples open all the way, medium damping hinges.",
        {"left": 0.0, "right": 0.0},
    ),
    (
        known.SCISSORS,
        (
            "A wide open pair of scissors with two intersecting blades connected through a rotational hinge joint, "
            "low damping for easy opening and closing motion."
        ),
        {"halves": 0.0},
    ),
    (
        known.CABINET,
        (
            "A kitchen cabinet with its first door halfway open and everything else closed. Doors stay where they "
            "are placed."
        ),
        {"door_left": 0.8, "door_right": 0.0, "drawer_left": 0.0, "drawer_right": 0.0},
    ),
    (known.KEYBOARD, "A standard plastic computer keyboard with light, spring-like keys for easy pressing.", {}),
    (
        known.thing("FoldingChair", known.hinged("seat", "seat", closed=1.6)),
        (
            "I want a very small folding chair for a baby "
            "that is easy to fold and unfold, with its seat open all the way in normal position."
        ),
        {"seat": 0.0},
    ),
    (known.thing("FoldingChair", known.hinged("legs", "leg")), "wooden director's chair, unfolded", {"legs": 0.0}),
    (known.thing("FoldingChair", known.hinged("legs", "leg")), "a folding chair, closed", {"legs": 1.6}),
    (
        known.thing("Door", known.hinged("leaf", "rotation_door")),
        "An interior door, slightly open, with high damping so that it does not slam.",
        {"leaf": SLIGHTLY * 1.6},
    ),
    (
        known.thing("Knife", known.hinged("blade", "rotation_blade")),
        "I want a regular size folding knife that fits in hand. Low damping for hinge-like behavior.",
        {},
    ),
    (known.thing("Cart", known.spinning("w", "wheel")), "A utility cart with wheels that roll freely.", {}),
    (known.thing("Kettle", known.sliding("lid", "lid")), "An electric kettle with its lid closed.", {"lid": 0.0}),
    (
        known.thing("CoffeeMachine", known.hinged("lid", "lid"), known.sliding("b", "button", upper=0.01)),
        "A household coffee machine, everything closed, with stiff buttons.",
        {"lid": 0.0},
    ),
    (
        known.thing("Furniture", known.hinged("DOOR1", ""), known.sliding("DRAWER-LOWER", "")),
        "A piece of office or kitchen furniture at its real size, everything closed.",
        {"DOOR1": 0.0, "DRAWER-LOWER": 0.0},
    ),
]

OWN_PHRASINGS: list[tuple[Json, str, dict[str, float]]] = [
    (known.TOILET, "A toilet with lid and seat open.", {"lid": 1.6, "seat": 1.6}),
    (known.TOILET, "toilet; the lid is up, the seat is down", {"lid": 1.6, "seat": 0.0}),
    (known.TOILET, "Its lid half closed, its seat closed", {"lid": 0.8, "seat": 0.0}),
    (known.TOILET, "lid open seat closed", {"lid": 1.6, "seat": 0.0}),
    (known.MICROWAVE, "A microwave whose door is not open", {"door": 0.0}),
    (known.MICROWAVE, "The door isn't closed.", {"door": SLIGHTLY * 1.6}),
    (known.MICROWAVE, "the door is not fully open", {"door": 1.2}),
    (known.MICROWAVE, "The door can be opened easily and stays open.", {}),
    (known.MICROWAVE, "It beeps when the door is open.", {}),
    (known.MICROWAVE, "easy to open", {}),
    (known.MICROWAVE, "door open at 30 degrees", {"door": 0.5236}),
    (known.MICROWAVE, "door ajar", {"door": SLIGHTLY * 1.6}),
    (known.MICROWAVE, "door open by 0.4 rad", {"door": 0.4}),
    (known.MICROWAVE, "the door is a third open", {"door": 1.6 / 3}),
    (known.MICROWAVE, "Door 75 % open.", {"door": 1.2}),
    (known.MICROWAVE, "The door's nearly closed", {"door": 0.24}),
    (known.MICROWAVE, "Close the door.", {"door": 0.0}),
    (known.MICROWAVE, "the door left open", {"door": 1.6}),
    (known.MICROWAVE, "a half-open microwave", {"door": 0.8}),
    (
        known.CABINET,
        "both doors wide open, drawers shut",
        {"door_left": 1.6, "door_right": 1.6, "drawer_left": 0.0, "drawer_right": 0.0},
    ),
    (known.CABINET, "the right door open, the left one closed", {"door_right": 1.6, "door_left": 0.0}),
    (known.CABINET, "second drawer halfway open", {"drawer_right": 0.25}),
    (known.CABINET, "left and right door ajar", {"door_left": SLIGHTLY * 1.6, "door_right": SLIGHTLY * 1.6}),
    (known.CABINET, "one drawer fully open", {"drawer_left": 0.5}),
    (known.DRAWERS, "the bottom drawer is pulled out, the rest are closed", {"d2": 0.5, "d0": 0.0, "d1": 0.0}),
    (known.DRAWERS, "first and third drawers half open", {"d0": 0.25, "d2": 0.25}),
    (known.DRAWERS, "last drawer open, middle drawer slightly open", {"d2": 0.5, "d1": 0.1}),
    (known.DRAWERS, "all drawers open", {"d0": 0.5, "d1": 0.5, "d2": 0.5}),
    (known.GLASSES, "glasses with folded temples", {"left": 1.6, "right": 1.6}),
    (known.SCISSORS, "closed scissors", {"halves": -0.6}),
    (known.LAPTOP, "a laptop opened to 90°", {"screen": -1.8 + 1.5708}),
    # A door of 180° is used up to 110°, and open there; fully open is the end of its travel, and a handle swings over
    # all of its own.
    (FRIDGE, "its door open halfway", {"door": 0.96}),
    (FRIDGE, "its door wide open", {"door": 3.14}),
    (FRIDGE, "its door open", {"door": 1.9199}),
    (FRIDGE, "an open refrigerator", {"door": 1.9199}),
    (FRIDGE, "its door slightly closed", {"door": (1.0 - SLIGHTLY) * 1.9199}),
    (known.TRASHCAN, "with its lid half open", {"lid": 0.96}),
    (known.LAPTOP, "a half open laptop", {"screen": -1.8 + 1.13446}),
    (known.TOASTER, "toaster with the lever pressed down", {"lever": 0.4}),
    (known.SUITCASE, "suitcase, handle upright", {"handle": -1.57}),
    (known.TOASTER, "a toaster with a strong spring that is hard to press", {}),
    (known.BUCKET, "a bucket, handle upright", {"handle": 0.0}),  # from -2.0 to 2.0
    (known.MICROWAVE, "with its drawer open", {}),
    (known.SUITCASE, "the handle glides up and down without effort", {}),
    (known.SCISSORS, "pruning scissors that open by themselves", {}),
    (known.TOILET, "a toilet with its lid up and seat down", {"lid": 1.6, "seat": 0.0}),
]


D, C, T = known.DRAWERS, known.CABINET, known.TOILET
NAMED_BEFORE: list[tuple[Json, str, dict[str, float]]] = [
    (D, "a desk with three drawers, the upper one half open", {"d0": 0.25}),
    (D, "a chest of drawers with three drawers and the bottom one open", {"d2": 0.5}),
    (D, "a chest of three drawers, second drawer from the top a third open", {"d1": 0.5 / 3.0}),
    (D, "the third drawer from the bottom half open", {"d0": 0.25}),
    (D, "a nightstand with drawers, one of them open", {"d0": 0.5}),
    (D, "a dresser having three drawers, of which the middle one is half open", {"d1": 0.25}),
    (D, "a dresser with drawers, the top two open", {"d0": 0.5, "d1": 0.5}),
    (D, "the two upper drawers are open and the lowest is closed", {"d0": 0.5, "d1": 0.5, "d2": 0.0}),
    (D, "three drawers, all of them closed", {"d0": 0.0, "d1": 0.0, "d2": 0.0}),
    (D, "first two drawers ajar", {"d0": 0.1, "d1": 0.1}),
    (C, "a cabinet with two doors and two drawers, the left door open", {"door_left": 1.6}),
    (C, "a sideboard with two doors, both half open", {"door_left": 0.8, "door_right": 0.8}),
    (C, "a cupboard with two doors, one open, the other closed", {"door_left": 1.6, "door_right": 0.0}),
    (C, "the doors and the left drawer open", {"door_left": 1.6, "door_right": 1.6, "drawer_left": 0.5}),
    (T, "a toilet with a lid and a seat, the lid open", {"lid": 1.6}),
    (T, "a toilet with lid and seat, both open", {"lid": 1.6, "seat": 1.6}),
]
"""States of parts that are counted, or named before: what is described is not all opened."""


TAP = known.thing(
    "Faucet", known.hinged("left", "switch", (0.0, 0.4, 0.2), upper=1.5),
    known.hinged("right", "switch", (0.0, -0.4, 0.2), upper=1.5), known.hinged("spout", "spout", lower=-1.0, upper=1.0),
)  # fmt: skip
SWITCHES = known.thing(
    "Switch", known.hinged("left", "switch", (0.0, 0.4, 0.0), upper=0.3),
    known.hinged("right", "toggle_button", (0.0, -0.4, 0.0), upper=0.3), known.hinged("dimmer", "knob", upper=4.0),
)  # fmt: skip
RACKS = known.thing(
    "Dishwasher", known.hinged("door", "rotation_door", upper=1.5), known.sliding("low", "shelf", (0.0, 0.0, -0.4)),
    known.sliding("high", "shelf", (0.0, 0.0, 0.4)),
)  # fmt: skip
SASHES = known.thing(
    "Window", known.sliding("low", "translation_window", (0.0, 0.0, -0.4)),
    known.sliding("high", "translation_window", (0.0, 0.0, 0.4)),
)  # fmt: skip
READING_LAMP = known.thing(
    "Lamp", known.hinged("arm", "rotation_bar", upper=1.0), known.hinged("head", "head", upper=1.0),
    known.hinged("rocker", "switch", upper=0.2),
)  # fmt: skip
TAPS_AND_SWITCHES: list[tuple[Json, str, dict[str, float]]] = [
    (TAP, "A kitchen tap with its left handle open halfway.", {"left": 0.75}),
    (TAP, "A faucet, both levers turned by 30 degrees.", {"left": 0.5236, "right": 0.5236}),
    (TAP, "A faucet, its right handle turned off.", {"right": 0.0}),
    (SWITCHES, "A light switch with the left switch on.", {"left": 0.3}),
    (SWITCHES, "A light switch that is on.", {"left": 0.3, "right": 0.3}),
    (SWITCHES, "A light switch, switched off.", {"left": 0.0, "right": 0.0}),
    (SWITCHES, "A light switch with its toggle on and its dimmer turned halfway.", {"left": 0.3, "dimmer": 2.0}),
    (RACKS, "A dishwasher, its door open and the upper rack pulled out.", {"door": 1.5, "high": 0.5}),
    (RACKS, "A dishwasher, its lower basket pulled out halfway.", {"low": 0.25}),
    (SASHES, "A window with its lower sash open halfway.", {"low": 0.25}),
    (READING_LAMP, "A lamp with its head tilted by 20 degrees.", {"head": 0.3491}),
    (READING_LAMP, "A desk lamp that is on.", {"rocker": 0.2}),
    (READING_LAMP, "A desk lamp that is on a table.", {}),
    (known.MICROWAVE, "A microwave that is turned on.", {}),
    (known.BOTTLE, "A bottle, its cap on.", {"cap": 0.0}),
]
"""Sentences about newly drawn taps, switches and racks: 23 of 52 were unread, or read of another part."""


@pytest.mark.parametrize(
    ("information", "guidance", "expected"), PAPER_AND_MANIFEST + OWN_PHRASINGS + NAMED_BEFORE + TAPS_AND_SWITCHES
)
def test_asked_states(information: Json, guidance: str, expected: dict[str, float]) -> None:
    overlay = ask(information, guidance)
    assert overlay["initial_joint_positions"] == pytest.approx(expected, abs=2e-3)
    assert [name for name in overlay["asked"] if name != "scale"] == list(overlay["initial_joint_positions"])


@pytest.mark.parametrize(
    ("guidance", "longest_m"),
    [
        ("jewelry box roughly 20 by 15 by 10 cm with its lid half open", 0.2),
        ("gift box (12 in x 8 in x 4 in)", 0.3048),
        ("a box 80cm x 70cm x 35cm", 0.8),
        ("wooden box 300 mm × 0.2 m", 0.3),
        ("a box that is 3 by 5 inches", 0.127),
        ("a crate about a meter long", 1.0),
        ("a box half a metre wide", 0.5),
        ("a bin two feet tall", 0.6096),
        ("a tub 25 cm in diameter", 0.25),
        ("a carry-on box, 55 cm, 3 kg, closed", 0.55),
        ("a box with a handle of metal, 12 cm from its edge", 0.4),
        ("a box 4x4 plywood", 0.4),
        ("a box on a foot", 0.4),
        ("Scale it to 10 cm.", 0.1),
        ("an 8-inch box, opened at 60°", 0.2032),
        ("a box of 30 cm whose lid moves freely", 0.3),
    ],
)
def test_a_size_in_edges_or_in_words(guidance: str, longest_m: float) -> None:
    assert ask(known.BOX, guidance)["scale"] * 1.6 == pytest.approx(longest_m, abs=1e-3)


def test_the_one_length_of_a_kitchen_appliance_is_its_width() -> None:
    found = ask(FRIDGE, "a 24-inch fridge, its door 20 cm open")
    assert found["scale"] * max(FRIDGE["size_closed_m"][:2]) == pytest.approx(0.6096, abs=1e-3)


def test_half_a_kilo_is_a_weight() -> None:
    assert ask(known.BOX, "a box of half a kilo")["mass_change"]["to_kg"] == pytest.approx(0.5)


def test_what_a_whole_object_opens_by_and_other_names_of_parts() -> None:
    suitcase = ask(known.SUITCASE, "a suitcase, opened like a book")["initial_joint_positions"]
    assert suitcase == pytest.approx({"lid": 3.14}, abs=1e-3)
    assert list(ask(known.LAPTOP, "a laptop, lid barely open")["initial_joint_positions"]) == ["screen"]
    assert ask(known.BOTTLE, "a bottle, its cap screwed on tight")["initial_joint_positions"] == {"cap": 0.0}


def test_what_springs_back_does_not_open_an_object() -> None:
    for thing in (known.KEYBOARD, known.TOASTER):
        for words in ("an open {}", "a closed {}"):
            asked = ask(thing, words.format(thing["category"].lower())).get("initial_joint_positions", {})
            assert set(asked) <= {"knob"}, "a key pressed would not stay"
    assert ask(known.TOASTER, "a toaster with its lever down")["initial_joint_positions"], "named, it is asked"


def test_a_length_opens_a_slide_at_the_final_scale() -> None:
    overlay = ask(known.DRAWERS, "a small office cabinet with its first drawer pulled out 5 cm")
    assert overlay["initial_joint_positions"]["d0"] * overlay["scale"] == pytest.approx(0.05, rel=1e-3)


@pytest.mark.parametrize(
    ("information", "guidance", "name", "expected"),
    [
        (known.BOX, "Low damping for a smooth hinge.", "lid", {"coast_s": 0.5}),
        (known.BOX, "super low damping", "lid", {"coast_s": 1.0}),
        (known.BOX, "lid with very high damping", "lid", {"coast_s": 0.05}),
        (known.BOX, "The damping of the hinge is high.", "lid", {"coast_s": 0.1}),
        (known.BOX, "no damping in the lid", "lid", {"coast_s": 1.0}),
        (known.SAFE, "The door is heavy and moves slowly.", "door", {"coast_s": 0.05}),
        (
            known.BUCKET,
            "its handle halfway over. The handle swings freely.",
            "handle",
            {"coast_s": 1.0, "holds": False},
        ),
        (
            known.TRASHCAN,
            "The lid hinge has low damping and holds its position.",
            "lid",
            {"coast_s": 0.5, "holds": True},
        ),
        (known.CABINET, "Doors stay where they are placed.", "door_right", {"holds": True}),
        (known.BOX, "The lid does not stay open.", "lid", {"holds": False}),
        (known.DRAWERS, "low friction slides", "d1", {"coast_s": 0.5, "holds": False}),
        (known.DRAWERS, "high friction slides", "d1", {"coast_s": 0.1, "holds": True}),
        (
            known.STAPLER,
            "slightly open stapler, with spring behavior in its joint",
            "lid",
            {"spring_hz": 3.0, "spring_rest": -0.3 + SLIGHTLY * 1.5708, "holds": False},
        ),
        (known.KEYBOARD, "light, springy keys", "k1", {"press_start": 0.315, "press_end": 0.455, "spring_rest": 0.0}),
        (known.MICROWAVE, "stiff buttons", "button", {"press_start": 3.0, "press_end": 5.25}),
        (known.TOASTER, "The lever springs back.", "lever", {"spring_hz": 4.0, "spring_rest": 0.0}),
        (LIDS, "A toilet with a soft-close lid.", "lid", {"closes_s": 2.0, "holds": False}),
        (LIDS, "The lid closes slowly.", "lid", {"closes_s": 2.0, "holds": False}),
        (LIDS, "The lid closes in 3 seconds.", "lid", {"closes_s": 3.0, "holds": False}),
        (LIDS, "The seat slams shut when it is let go.", "seat", {"closes_s": 0.3, "holds": False}),
        (LIDS, "The lid must not slam.", "lid", {"closes_s": 2.0, "holds": False}),
        (LIDS, "The lid swings freely and slowly.", "lid", {"closes_s": 2.5, "holds": False}),
        (known.DRAWERS, "The drawers glide.", "d1", {"stops_within": 0.25, "holds": True}),
        (known.DRAWERS, "Its drawers slide smoothly.", "d0", {"stops_within": 0.12}),
        (known.DRAWERS, "stiff drawers", "d0", {"stops_within": 0.015, "coast_s": 0.1}),
        (known.DRAWERS, "Every drawer stops within 10 cm.", "d2", {"stops_within": 0.1}),
        (known.MICROWAVE, "The door stops within 20 degrees when it is let go.", "door", {"stops_within": 0.34907}),
        (known.TOASTER, "The lever snaps back.", "lever", {"returns_s": 0.15, "spring_rest": 0.0}),
        (known.TOASTER, "The lever returns slowly.", "lever", {"returns_s": 1.5}),
        (known.TOASTER, "The lever springs back in 0.4 s.", "lever", {"returns_s": 0.4}),
        (known.SAFE, "The door is heavy and moves slowly.", "door", {"damping_level": "super high"}),
        (known.SAFE, "Its door takes 40 N to get moving.", "door", {"effort_n": 40.0}),
        (known.BOX, "The lid is stiff and needs about 15 N to lift.", "lid", {"effort_n": 15.0, "stiff": True}),
        (known.BOX, "a box, 0.6 N·m to turn its lid", "lid", {"effort_nm": 0.6}),
        (known.KEYBOARD, "each key needs 60 gf", "k1", {"effort_n": 0.588}),
        (known.DRAWERS, "The drawers are hard to slide.", "d1", {"stiff": True}),
        (known.SAFE, "door closed by a catch that pops open at 30 N", "door", {"effort_n": 30.0, "mechanism": "latch"}),
        (known.MICROWAVE, "Its door snaps shut and lets go at 30 N.", "door", {"effort_n": 30.0, "mechanism": "latch"}),
    ],
)
def test_feel(information: Json, guidance: str, name: str, expected: Json) -> None:
    found = felt(ask(information, guidance), name)
    for key, value in expected.items():
        assert found[key] == (value if isinstance(value, str) else pytest.approx(value, abs=1e-3)), key


@pytest.mark.parametrize(
    ("information", "guidance", "expected"),
    [
        (known.DRAWERS, "upper drawer pulled out 8 cm, lower one shut", {"d0": 0.08 / SIDE_TABLE, "d2": 0.0}),
        (
            known.DRAWERS,
            "top drawer out by 12 cm, everything else shut",
            {"d0": 0.12 / SIDE_TABLE, "d1": 0.0, "d2": 0.0},
        ),
        (known.SAFE, "door shut and sticky, 20 N to pull open", {"door": 0.0}),
        (known.BOX, "a box at 45% of its travel", {"lid": -0.136}),
        (known.BOX, "its lid thrown all the way back", {"lid": 2.0}),
        (known.MICROWAVE, "its buttons are pressed with 2 N", {}),
        (known.DRAWERS, "upper drawer sticks out 8 cm, lower one shut", {"d0": 0.08 / SIDE_TABLE, "d2": 0.0}),
        (known.BOX, "a box with its lid on", {"lid": -1.0}),
        (known.BOX, "a box with its lid on top of it", {}),
        (known.BOX, "its lid neither open nor ajar", {"lid": -1.0}),
        (known.BOX, "its lid 1/2 open", {"lid": -0.04}),
        (known.DRAWERS, "upper drawer shut and the lower one out", {"d0": 0.0, "d2": 0.5}),
        (known.DRAWERS, "the drawers slide out", {}),
    ],
)
def test_states_as_users_write_them(information: Json, guidance: str, expected: dict[str, float]) -> None:
    found = ask(information, guidance)
    assert (
        found["initial_joint_positions"] == pytest.approx(expected, abs=1e-3)
        and found["scale"] == ask(information)["scale"]
    )


def test_inches_before_a_screen_are_its_diagonal() -> None:
    for words in ('a 15.6" gaming laptop', "a 15.6 inch laptop", "a 15.6-inch notebook"):
        assert max(known.LAPTOP["size_closed_m"]) * ask(known.LAPTOP, words)["scale"] == pytest.approx(
            0.357, abs=0.003
        ), words


def test_what_a_part_bears_is_not_what_moving_it_takes() -> None:
    assert felt(ask(known.DRAWERS, "Each drawer holds a load of 200 N."), "d1").get("effort_n") is None


def test_feel_reaches_only_the_parts_that_are_named() -> None:
    plain, worded = (ask(known.CABINET), ask(known.CABINET, "drawers with super high damping"))
    assert felt(worded, "door_left") == felt(plain, "door_left")
    assert felt(worded, "drawer_left")["coast_s"] == 0.05


def test_a_lid_that_is_asked_to_stand_open_is_not_let_fall() -> None:
    found = felt(ask(LIDS, "A toilet with its lid open. The lid closes slowly."), "lid")
    assert found["holds"] is True and "closes_s" not in found


def test_a_door_that_gravity_does_not_move_is_damped_instead() -> None:
    upright = known.thing("Door", known.hinged("leaf", "rotation_door", axis=(0.0, 0.0, 1.0)))
    found = felt(ask(upright, "A soft-close door."), "leaf")
    assert "closes_s" not in found and (found["coast_s"], found["holds"]) == (0.05, True)


def test_a_stated_level_counts_before_a_word_and_wishes_leave_scale_and_state_alone() -> None:
    assert "stops_within" not in felt(ask(known.DRAWERS, "Drawers with low damping glide."), "d0")
    plain, worded = ask(known.DRAWERS), ask(known.DRAWERS, "Every drawer stops within 10 cm.")
    assert (worded["scale"], worded["initial_joint_positions"]) == (plain["scale"], {})


def test_a_spring_can_be_declined() -> None:
    assert "spring_hz" not in felt(ask(known.KEYBOARD, "keys without springs"), "k0")


def test_an_unmet_wish_is_noted() -> None:
    notes = ask(known.MICROWAVE, "with its drawer open")["notes"]
    assert any("no drawer" in note for note in notes)


def test_segments_end_at_separators_but_not_inside_numbers() -> None:
    assert tokenize("Lid at 0.5 rad, 3-drawer.") == ("lid", "at", "0.5", "rad", ",", ".")
    assert [segment.tokens for segment in segments(tokenize("a lid, open and closed"), "")] == [
        ("a", "lid"),
        ("open",),
        ("closed",),
    ]


@pytest.mark.parametrize(
    ("lower", "upper", "confidence", "asked"), [(-1.5, 1.5, 0.1, 0.0), (-1.5, 1.5, 0.6, -1.5), (-1.0, 1.5, 0.1, -1.0)]
)
def test_closed_is_the_authored_zero_of_what_turns_as_far_either_way(
    lower: float, upper: float, confidence: float, asked: float
) -> None:
    lever = {
        "name": "j", "type": "revolute", "parent": "base", "child": "door", "axis": [0, 0, 1], "lower": lower,
        "upper": upper, "closed": lower, "open": upper, "open_confidence": confidence,
    }  # fmt: skip
    links = [{"name": name, "label": "", "box_m": [0.1, 0.1, 0.1], "volume_m3": 1e-3} for name in ("base", "door")]
    edge = {"category": "Furniture", "size_m": [1, 1, 1], "links": links, "joints": [lever]}
    overlay = prior_overlay(ObjectInfo.from_json(edge), "A piece of furniture, everything closed.")
    assert overlay.initial_joint_positions["j"] == pytest.approx(asked, abs=1e-3)


@pytest.mark.parametrize(
    ("words", "asked"),
    [
        ("a monitor whose screen slides up and stays", {}),
        ("a monitor with its screen up", {"lift": 0.5}),
        ("a monitor on a swivel stand, screen upright", {}),
    ],
)
def test_what_a_part_can_do_is_no_state_and_what_turns_about_the_vertical_is_never_up(
    words: str, asked: dict[str, float]
) -> None:
    lift = known.sliding("lift", "translation_screen", axis=(0.0, 0.0, 1.0))
    swivel = known.hinged("swivel", "rotation_screen", lower=-0.7, upper=0.7)
    display = known.thing("Display", swivel if "swivel" in words else lift)
    assert ask(display, words).get("initial_joint_positions", {}) == pytest.approx(asked, rel=1e-3)


LAMP = known.thing("Lamp", known.hinged("head", "head", lower=-0.5, upper=0.6), known.hinged("arm", "rotation_bar"))
STAND = known.thing(
    "Display", known.sliding("lift", "translation_screen", axis=(0.0, 0.0, 1.0), upper=0.3),
    (known.link("panel", "rotation_screen"),
     known.joint("tilt", "panel", parent="lift_link", lower=-0.4, upper=0.5, axis=LEVEL)),
)  # fmt: skip
DOORS = known.thing(
    "Door",
    known.hinged("left", "rotation_door", (-0.1, 0.4, 0.0)),
    known.hinged("right", "rotation_door", (-0.1, -0.4, 0.0)),
)
PRINTER = known.thing("Printer", known.hinged("lid", "lid"), known.spinning("knob", "knob"))


@pytest.mark.parametrize(
    ("information", "guidance", "expected"),
    [
        (LAMP, "a lamp with its head tilted by 15 degrees", {"head": 0.2618}),
        (LAMP, "a lamp with its arm turned by 30 degrees", {"arm": 0.5236}),
        (PRINTER, "a printer, its knob turned by 90 degrees", {"knob": 1.5708}),
        (STAND, "a monitor tilted back by 10 degrees", {"tilt": 0.1745}),
        (DOORS, "double doors, left one open", {"left": 1.6}),
        (DOORS, "double doors, wide open", {"left": 1.6, "right": 1.6}),
        (known.DRAWERS, "a desk with its drawers slid out", {"d0": 0.5, "d1": 0.5, "d2": 0.5}),
    ],
)
def test_angles_of_what_is_set_count_from_where_it_is_drawn_and_one_is_one(
    information: Json, guidance: str, expected: dict[str, float]
) -> None:
    assert ask(information, guidance)["initial_joint_positions"] == pytest.approx(expected, abs=2e-3)


def test_the_lid_of_what_has_no_names_is_its_largest_part() -> None:
    handle = (known.link("a", size=0.1), known.joint("one", "a"))
    lid = (known.link("b", size=1.0), known.joint("other", "b"))
    found = ask(known.thing("Suitcase", handle, lid), "a suitcase with its lid slightly open")
    assert list(found["initial_joint_positions"]) == ["other"]


def test_a_noun_after_with_names_no_kind() -> None:
    said = " ".join(prior_overlay(ObjectInfo.from_json(PRINTER), "copier with the scanner cover up").notes)
    assert "copier" in said.lower() and "scanner" not in said.lower()
