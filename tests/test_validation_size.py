"""A scale by which an object is larger or smaller than its kind can be, by the user's words, is moved to a bound."""

import math
import tempfile
from functools import cache
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.catalog.text import plus_or_minus
from asset2sim.guidance import tables
from asset2sim.guidance.category import identify
from asset2sim.guidance.edges import fitted_edges
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.read import read_guidance
from asset2sim.guidance.sizing import propose_scale
from asset2sim.models.object_facts import object_facts
from asset2sim.validation.sanity import corrected_proposal
from asset2sim.validation.size import HAND_M, with_sensible_size
from schemas.finding import Notes
from schemas.guidance import NOTHING_ASKED
from schemas.overlay import Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Correction, Severity
from tests.assets import cabinet, link, read, robot, shape, written
from tests.factories import guidance_of
from tests.prior_objects import ask, hinged, spinning, thing

MICROWAVE = tables.sizes()["Microwave"]


def sized(scale: float, guidance: str = "", category: str = "Microwave", size: float = 2.0) -> tuple[float, Notes]:
    """The final longest edge, m, of a cube of 2 m and what was said about it."""
    info = ObjectInfo.from_json(thing(category, hinged("door", "door"), size=size))
    notes = Notes()
    return with_sensible_size(info, read_guidance(guidance, info), Overlay(scale=scale), notes).scale * size, notes


def test_a_plausible_size_stands() -> None:
    final, notes = sized(MICROWAVE.typical_m / 2.0)
    assert final == pytest.approx(MICROWAVE.typical_m)
    assert not notes.findings


@pytest.mark.parametrize(("wanted", "bound"), [(3.0, MICROWAVE.max_m), (0.02, MICROWAVE.min_m)])
def test_what_is_beyond_the_household_range_goes_to_its_nearest_bound(wanted: float, bound: float) -> None:
    final, notes = sized(wanted / 2.0)
    assert final == pytest.approx(bound)
    (finding,) = notes.findings
    assert finding.code == "size_unlikely" and finding.severity is Severity.WARNING
    assert finding.value == pytest.approx(wanted) and finding.limit == pytest.approx(bound)
    assert f"{wanted:.3g} m" in finding.message and f"{bound:.3g} m" in finding.message


@pytest.mark.parametrize(
    "edges",
    [
        (0.65, 0.6, 0.88), (0.70, 0.76, 0.92), (0.70, 0.76, 1.17), (0.68, 0.76, 1.83), (0.61, 0.52, 1.46),
        (0.60, 0.76, 1.30), (0.56, 0.6, 0.6), (0.37, 0.47, 0.28),
    ],
)  # fmt: skip
def test_ovens_are_sized_by_their_three_edges(edges: tuple[float, ...]) -> None:
    """Real ones (makers' dimensions), drawn at any scale: a cooker, an American range without and with a backguard and
    under its hood, a cooker with a high grill, a double wall oven, a built-in and a toaster oven. As wide as a built-in
    one, the range was 0.73 m tall."""
    oven = thing("Oven", hinged("door", "door")) | {
        key: [2.3 * edge for edge in edges] for key in ("size_closed_m", "size_m")
    }
    info, overlay = ObjectInfo.from_json(oven), Overlay.model_validate(ask(oven))
    assert with_sensible_size(info, NOTHING_ASKED, overlay, Notes()).scale == overlay.scale
    assert 2.3 * edges[2] * overlay.scale == pytest.approx(edges[2], rel=0.08)


def test_words_of_size_move_the_bounds() -> None:
    """A toy may be as small as what a hand handles, and not as large as the real thing."""
    factor = tables.size_words()[("toy",)]
    assert sized(0.075, "A toy microwave.")[0] == pytest.approx(0.15)
    assert sized(0.5 * HAND_M / 2.0, "A toy microwave.")[0] == pytest.approx(HAND_M)
    assert sized(MICROWAVE.max_m / 2.0, "A toy microwave.")[0] == pytest.approx(factor * MICROWAVE.max_m)
    large = tables.size_words()[("large",)]
    assert sized(3.0, "A large microwave.")[0] == pytest.approx(large * MICROWAVE.max_m)


@pytest.mark.parametrize(
    ("words", "said"),
    [("A mini oven.", []), ("A mini convection oven.", ["mini"]), ("Two mini ovens.", []), ("A mini pump.", ["mini"])],
)
def test_a_word_of_size_in_the_name_of_another_kind_says_no_more_of_its_size(words: str, said: list[str]) -> None:
    """A mini oven is a kind with a size of its own, not six tenths of one; a mini pump is a pump, and smaller."""
    info = ObjectInfo.from_json(thing("Oven", hinged("door", "door")))
    assert [word.words for word in read_guidance(words, info).size.words] == said


@pytest.mark.parametrize("guidance", ["A microwave, 30 cm long.", "A microwave. Scale 0.15."])
def test_a_stated_number_is_kept_to(guidance: str) -> None:
    assert sized(0.15, guidance)[1].findings == []
    assert sized(0.155, guidance)[1].findings == []
    final, notes = sized(0.2, guidance)
    assert final == pytest.approx(0.30)
    assert "the user's number" in notes.findings[0].message


def test_of_an_unknown_object_only_what_no_home_holds_is_refused() -> None:
    anything = tables.sizes()["*"]
    assert sized(0.05, category="Gadget")[1].findings == []
    assert sized(1.0, category="Gadget")[1].findings == []
    assert sized(100.0, category="Gadget")[0] == pytest.approx(anything.max_m)
    assert sized(1e-4, category="Gadget")[0] == pytest.approx(anything.min_m)


def test_an_object_without_a_size_is_left_alone() -> None:
    assert sized(7.0, size=0.0)[1].findings == []


def test_the_offline_prior_keeps_to_its_own_table() -> None:
    """For every category and word of size its own proposal stands."""
    for category in tables.sizes():
        for word in ("", "small ", "very large ", "toy ", "real size "):
            for size in (0.3, 2.0):
                guidance = f"A {word}{category.lower()}." if category != "*" else f"A {word}thing."
                information = thing(category, hinged("door", "door"), size=size)
                proposal = Overlay(scale=ask(information, guidance)["scale"])
                notes = Notes()
                info = ObjectInfo.from_json(information)
                with_sensible_size(info, read_guidance(guidance, info), proposal, notes)
                assert not notes.findings, (category, word, size)


@cache
def drawn() -> Extraction:
    """A cabinet whose lid and drawer open."""
    with tempfile.TemporaryDirectory() as folder:
        return read(written(Path(folder) / "cabinet", cabinet()), "Box")


def test_a_second_time_nothing_changes() -> None:
    guidance = guidance_of("A small box.", drawn().features)
    first, findings = corrected_proposal(drawn(), Overlay(scale=1e3), guidance, PhysicsSettings())
    assert [finding.code for finding in findings] == ["size_unlikely"]
    assert corrected_proposal(drawn(), first, guidance, PhysicsSettings()) == (first, ())


@pytest.mark.parametrize("correction", [Correction.OFF, Correction.UNITS])
def test_only_semantic_correction_moves_a_scale_or_a_state(correction: Correction) -> None:
    """A size that no box has, and a lid that is shut where the words say open: a model may know better."""
    proposal = Overlay(scale=1e3, initial_joint_positions={"lid_hinge": 0.0}, asked=("lid_hinge",))
    words = guidance_of("A small box with its lid fully open.", drawn().features)
    assert corrected_proposal(drawn(), proposal, words, PhysicsSettings(), correction) == (proposal, ())
    moved, findings = corrected_proposal(drawn(), proposal, words, PhysicsSettings())
    assert moved.scale < 1.0 and moved.initial_joint_positions["lid_hinge"] != 0.0
    assert [item.code for item in findings] == ["size_unlikely", "state_at_wrong_end"]


def test_without_any_correction_degrees_stay() -> None:
    proposal = Overlay(scale=0.1, initial_joint_positions={"lid_hinge": 45.0}, asked=("lid_hinge",))
    assert corrected_proposal(drawn(), proposal, NOTHING_ASKED, PhysicsSettings(), Correction.OFF)[0] == proposal
    turned, (finding,) = corrected_proposal(drawn(), proposal, NOTHING_ASKED, PhysicsSettings(), Correction.UNITS)
    assert turned.initial_joint_positions["lid_hinge"] == pytest.approx(math.radians(45.0))
    assert finding.code == "position_in_degrees" and finding.value == 45.0
    assert finding.limit == pytest.approx(math.radians(45.0))


def test_without_semantics_size_is_not_looked_at() -> None:
    proposal = Overlay(scale=1e3)
    guidance = guidance_of("A small box.", drawn().features)
    assert corrected_proposal(drawn(), proposal, guidance, PhysicsSettings(), semantics=False) == (proposal, ())


@pytest.mark.parametrize(
    ("guidance", "is_the_users"),
    [
        ("Scale it to 1e9.", False),
        ("A box 5 km long.", False),
        ("A small microwave.", True),
        ("Scale it to 0.2.", True),
    ],
)
def test_a_scale_that_no_words_ask_for_is_not_the_users(guidance: str, is_the_users: bool) -> None:
    info = ObjectInfo.from_json(thing("Microwave", hinged("door", "door"), size=2.0))
    notes = Notes()
    moved = with_sensible_size(info, read_guidance(guidance, info), Overlay(scale=1e9, asked=("scale", "door")), notes)
    assert moved.scale < 10.0 and [item.code for item in notes.findings] == ["size_unlikely"]
    assert ("scale" in moved.asked) == is_the_users and "door" in moved.asked


@pytest.mark.parametrize("times", [0.5, 1.0, 3.0])
@pytest.mark.parametrize(
    ("edges", "kind", "tallest"),
    [
        ((0.58, 0.25, 0.87), "base unit", 0.87),  # a narrow one, deeper than it is wide
        ((0.58, 1.20, 0.87), "base unit", 0.87),
        ((0.58, 0.90, 0.40), "bridge unit", 0.40),  # over a refrigerator
        ((0.33, 0.60, 0.72), "wall unit", 0.72),
        ((0.40, 0.90, 1.80), "tall cupboard", 1.80),
        ((0.45, 1.60, 0.75), "sideboard", 0.75),
    ],
)
def test_a_cupboard_is_sized_by_its_three_edges(
    edges: tuple[float, float, float], kind: str, tallest: float, times: float
) -> None:
    """Real ones (makers' dimensions), drawn at any scale: by the longest edge alone they were 0.9 m."""
    depth, width, height = (times * edge for edge in edges)
    found = fitted_edges((depth, width, height), "StorageFurniture")
    assert found is not None and found.kind == kind
    assert found.scale * height == pytest.approx(tallest, rel=0.15) and 0.02 < found.sigma < 0.3


@pytest.mark.parametrize(
    ("category", "words", "edges"),
    [
        ("medicine cabinet", "", (0.13, 0.4, 0.62)),
        ("StorageFurniture", "A cabinet that hangs on the wall.", (0.34, 0.35, 0.9)),
        ("hamper", "", (0.32, 0.42, 0.6)),
        ("range", "A kitchen range.", (0.7, 0.76, 0.92)),
        ("", "A pedal bin.", (0.28, 0.28, 0.6)),
    ],
)
def test_things_of_other_names_are_as_large_as_such_things(category: str, words: str, edges: tuple[float, ...]) -> None:
    """Drawn without units: a medicine cabinet was a tall cupboard of 1.85 m, a hamper and a range had 0.3 m."""
    drawn = thing(category, hinged("door", "door")) | {
        key: [2.3 * edge for edge in edges] for key in ("size_closed_m", "size_m")
    }
    for item in drawn["links"]:
        item["box_m"] = [2.3 * edge for edge in edges]
    overlay = Overlay.model_validate(ask(drawn, words))
    assert 2.3 * edges[2] * overlay.scale == pytest.approx(edges[2], rel=0.15)


@pytest.mark.parametrize("times", [1.0, 2.0, 5.0])
@pytest.mark.parametrize(
    ("category", "edges"),
    [
        ("WashingMachine", (0.60, 0.60, 0.85)),
        ("WashingMachine", (0.68, 0.69, 1.10)),
        ("Suitcase", (0.20, 0.40, 0.55)),
        ("Suitcase", (0.10, 0.45, 0.33)),
        ("Safe", (0.37, 0.43, 0.20)),
        ("Clock", (0.15, 0.30, 0.70)),
        ("Fan", (0.16, 0.53, 0.54)),
        ("Fan", (1.32, 1.32, 0.45)),
        ("Fan", (0.43, 0.45, 1.30)),
        ("Globe", (0.45, 0.45, 0.90)),
        ("Lamp", (0.35, 0.30, 1.60)),
        ("Lighter", (0.013, 0.038, 0.057)),
        ("Lighter", (0.25, 0.024, 0.036)),
        ("StorageFurniture", (0.40, 1.80, 0.42)),
        ("StorageFurniture", (0.62, 2.00, 2.16)),
        ("Dishwasher", (0.52, 0.55, 0.44)),
        ("Safe", (0.50, 0.55, 1.45)),
        ("Switch", (0.012, 0.152, 0.081)),
        ("Keyboard", (0.106, 0.295, 0.033)),
        ("Table", (0.80, 1.60, 0.73)),
        ("KitchenPot", (0.30, 0.48, 0.10)),
        ("KitchenPot", (0.26, 0.34, 0.28)),
        ("Keyboard", (0.13, 0.09, 0.03)),
        ("Safe", (0.30, 0.35, 0.25)),
        ("Jar", (0.10, 0.10, 0.24)),
    ],
)
def test_what_is_drawn_without_units_is_as_large_as_its_kind(
    category: str, edges: tuple[float, ...], times: float
) -> None:
    """Makers' dimensions: by one edge of its category a ceiling fan had 0.58 m and a floor lamp 0.50."""
    drawn = thing(category) | {key: [times * edge for edge in edges] for key in ("size_closed_m", "size_m")}
    overlay = Overlay.model_validate(ask(drawn, ""))
    assert times * max(edges) * overlay.scale == pytest.approx(max(edges), rel=0.15)


@pytest.mark.parametrize(
    ("category", "parts", "edges", "kg"),
    [
        ("Refrigerator", ("door", "door"), (0.75, 0.91, 1.78), (90.0, 155.0)),
        ("Refrigerator", ("lid",), (0.66, 1.20, 0.86), (25.0, 75.0)),
        ("TrashCan", ("wheel", "wheel"), (0.55, 0.48, 0.94), (6.0, 18.0)),
        ("Table", ("wheel", "wheel"), (0.42, 0.66, 0.75), (3.0, 25.0)),
    ],
)
def test_parts_tell_a_kind_that_edges_alone_do_not(
    category: str, parts: tuple[str, ...], edges: tuple[float, ...], kg: tuple[float, float]
) -> None:
    """Makers' dimensions and weights, drawn twice as large: by its category alone a wheeled bin had 0.6 m and 2.3 kg,
    and a chest freezer 2 m. Without those parts they stay as their category is."""
    moving = [
        spinning(f"p{i}", name)
        if name == "wheel"
        else hinged(f"p{i}", name, axis=(0.0, 1.0, 0.0) if name == "lid" else (0.0, 0.0, 1.0))
        for i, name in enumerate(parts)
    ]
    drawn, bare = (
        thing(category, *joints) | {key: [2.0 * edge for edge in edges] for key in ("size_closed_m", "size_m")}
        for joints in (moving, ())
    )
    for item in drawn["links"]:
        item["center_m"] = [0.0, 0.0, -0.8 if item["label"] == "wheel" else 0.0]
    found, without = (Overlay.model_validate(ask(item, "")) for item in (drawn, bare))
    assert 2.0 * max(edges) * found.scale == pytest.approx(max(edges), rel=0.15)
    assert without.notes[0] == f"category {category}: as stated" and found.notes[0] != without.notes[0]
    size = tables.sizes()[found.notes[0].split()[1].rstrip(":")]
    assert kg[0] <= size.mass_min_kg and size.mass_max_kg <= kg[1]


@pytest.mark.parametrize(
    ("edges", "words", "mount"),
    [
        ((0.14, 0.80, 0.65), "", "wall"),
        ((0.35, 0.90, 0.70), "", None),
        ((0.40, 1.80, 0.42), "", None),
        ((0.28, 1.60, 1.30), "A cabinet 1.6 m wide.", None),  # as large as no mirror cabinet
    ],
)
def test_a_cabinet_as_flat_as_mirror_cabinets_are_hangs_without_words(
    edges: tuple[float, ...], words: str, mount: str | None
) -> None:
    drawn = thing("StorageFurniture", hinged("a", "rotation_door"), hinged("b", "rotation_door"))
    for item, width in zip(drawn["links"], (1.0, 0.5, 0.5), strict=True):
        item["box_m"] = [edges[0], width * edges[1], edges[2]]
    overlay = Overlay.model_validate(ask(drawn | {"size_closed_m": list(edges), "size_m": list(edges)}, words))
    assert overlay.support is not None and overlay.support.mount == mount


def test_no_cupboard_has_a_door_wider_than_doors_of_cupboards() -> None:
    """With the proportions of a tall cupboard a medicine cabinet of one door was one of 1.6 m, its door 1.1 m wide."""
    drawn = thing("StorageFurniture", hinged("a", "rotation_door"))
    for item in drawn["links"]:
        item["box_m"] = [0.05, 0.35, 0.5] if item["label"] == "rotation_door" else [0.13, 0.35, 0.5]
    edges = [3.0 * edge for edge in (0.17, 0.35, 0.5)]
    for item in drawn["links"]:
        item["box_m"] = [3.0 * edge for edge in item["box_m"]]
    overlay = Overlay.model_validate(ask(drawn | {"size_closed_m": edges, "size_m": edges}, ""))
    assert 3.0 * 0.5 * overlay.scale == pytest.approx(0.5, rel=0.15)
    assert overlay.support is not None and overlay.support.mount == "wall"


@pytest.mark.parametrize(
    ("category", "edges"),
    [("Toilet", (0.54, 0.36, 0.42)), ("Dispenser", (0.11, 0.10, 0.28)), ("Lamp", (0.55, 0.15, 0.20))],
)
def test_what_is_said_to_hang_on_a_wall_is_of_a_kind_that_does(category: str, edges: tuple[float, ...]) -> None:
    """Without those words it stands and is of the usual size: toilets of 0.7 m, lamps of 0.45."""
    drawn = thing(category) | {key: [2.5 * edge for edge in edges] for key in ("size_closed_m", "size_m")}
    hung, standing = (Overlay.model_validate(ask(drawn, words)) for words in ("It is fixed to the wall.", ""))
    assert 2.5 * max(edges) * hung.scale == pytest.approx(max(edges), rel=0.15)
    assert abs(hung.scale / standing.scale - 1.0) > 0.15


def test_a_window_on_a_level_hinge_is_no_sliding_one() -> None:
    drawn = thing("Window", hinged("w", "rotation_window", axis=(0.0, 1.0, 0.0))) | {
        key: [0.14, 1.8, 1.2] for key in ("size_closed_m", "size_m")
    }
    assert 1.8 * Overlay.model_validate(ask(drawn, "")).scale == pytest.approx(0.9, rel=0.15)


def test_edges_that_disagree_make_a_size_less_sure_and_other_categories_have_none() -> None:
    usual, odd = (fitted_edges(edges, "Window") for edges in ((0.08, 0.85, 1.3), (0.3, 2.6, 0.7)))
    assert usual is not None and odd is not None and odd.sigma > 1.5 * usual.sigma
    assert fitted_edges((0.9, 3.0, 0.7), "Window") is None, "like no window at all"
    assert fitted_edges((0.1, 0.1, 0.1), "Bottle") is None and fitted_edges((0.0, 1.0, 1.0), "Window") is None


@pytest.mark.parametrize(
    ("category", "edge", "kept"), [("Bottle", 0.081, True), ("Bottle", 0.05, False), ("Bottle", 1.6, False),
                                   ("Laptop", 0.33, True), ("Laptop", 0.1, False), ("Thing", 0.2, True)],
)  # fmt: skip
def test_what_is_smaller_than_normalised_and_usual_is_in_metres(category: str, edge: float, kept: bool) -> None:
    """Datasets normalise to a unit cube or sphere; a pill bottle of 8 cm is one of 8 cm."""
    info = ObjectInfo.from_json(thing(category, size=edge))
    size = tables.sizes()[identify(info, ())[0]]
    found = propose_scale(info, size, NOTHING_ASKED.size).value
    assert (found == 1.0) is kept, found
    if kept:
        assert with_sensible_size(info, read_guidance("", info), Overlay(scale=1.0), Notes()).scale == 1.0


@pytest.mark.parametrize(
    ("category", "edges", "kept"), [(None, "0.83 0.72 0.88", True), ("Dishwasher", "0.63 0.8 0.972", True),
                                    ("Laptop", "0.83 0.72 0.88", False), (None, "8.3 7.2 8.8", False),
                                    (None, "0.9 1 0.7", False), (None, "1.2 1.1 1.1", False)],
)  # fmt: skip
def test_a_size_to_which_no_dataset_brings_anything_stays_where_it_may_be_real(
    tmp_path: Path, category: str | None, edges: str, kept: bool
) -> None:
    """A kitchen range without a name is not shrunk to what fits on a table. Of unknown unit stay what is no laptop's
    size, what no home holds, and what was brought into a unit cube or a sphere of radius 1."""
    features = read(written(tmp_path, robot(link("a", shape(edges)))), category).features
    info = ObjectInfo.from_json(object_facts(features))
    size = tables.sizes()[identify(info, ())[0]]
    assert (propose_scale(info, size, NOTHING_ASKED.size).value == 1.0) is kept
    if category == "Laptop":
        real = read_guidance("A laptop at its real size.", info).size
        assert propose_scale(info, size, real).value == 1.0, "the user says that it is one"


def test_a_size_that_is_found_states_its_spread_and_one_that_is_stated_has_none() -> None:
    drawn = thing("Clock") | {key: [0.08, 0.6, 0.6] for key in ("size_closed_m", "size_m")}
    found = Overlay.model_validate(ask(drawn, ""))
    # Of the edges of a wall clock, that agree: (0.5⁻² + 2 · 0.15⁻²)^-½ = 10 %.
    assert found.uncertainty["scale"] == pytest.approx(0.104, abs=0.002)
    assert plus_or_minus(found.uncertainty["scale"]) == " ± 10 %" and not plus_or_minus(None)
    assert "scale" not in Overlay.model_validate(ask(drawn, "A clock 40 cm across.")).uncertainty
