"""A closed end that is a guess is said."""

from dataclasses import replace
from pathlib import Path

import pytest

from asset2sim.catalog.rows import GUESSES
from asset2sim.guidance.object_info import ObjectInfo
from asset2sim.guidance.parts import parts_of
from asset2sim.guidance.placing import asked_position
from asset2sim.guidance.read import read_guidance
from asset2sim.validation.asked_state import mirrored_if_wrong_end, requested_state
from asset2sim.validation.validate import validate
from schemas.finding import Notes
from schemas.overlay import Overlay
from schemas.vocabulary import Severity, Source
from tests.assets import NO_VIEWS, joint, link, read, robot, shape, written
from tests.prior_objects import hinged, thing


def leaf(low: float, high: float, name: str = "door") -> str:
    """A thin leaf on an upright hinge in the middle of its frame, which at half a turn lies as at none."""
    frame = "".join(shape("0.1 0.05 2", xyz=f"0 {y} 1") for y in (-0.85, 0.85))
    return robot(
        link("frame", frame), link(name, shape("0.04 0.8 2", xyz="0 0.4 1")),
        joint("hinge", "revolute", "frame", name, xyz="0 0 0", axis="0 0 1", limit=f"{low} {high}"),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("urdf", "asked", "told"),
    [
        (leaf(0.0, 3.1416), (), True),
        (leaf(0.0, 3.1416), ("hinge", "initial_joint_positions.hinge"), False),
        (leaf(0.0, 1.57), (), False),
        (leaf(0.0, 3.1416, "knob"), (), False),
    ],
)
def test_a_door_whose_closed_end_its_shape_does_not_tell_is_doubtful(
    tmp_path: Path, urdf: str, asked: tuple[str, ...], told: bool
) -> None:
    item = read(written(tmp_path, urdf), "Door")
    proposal = Overlay(scale=1.0, initial_joint_positions={"hinge": 0.0}, asked=asked)
    _, findings = validate(item, proposal, Source.MODEL, 0.5, NO_VIEWS.physics)
    found = [finding for finding in findings if finding.code == "closed_end_guessed"]
    assert bool(found) is told
    assert not told or (found[0].severity is Severity.WARNING and "overrides.csv" in found[0].message)
    assert "closed_end_guessed" in GUESSES


@pytest.mark.parametrize(
    ("category", "label", "drawn"),
    [
        ("Faucet", "switch", True),
        ("Lamp", "head", True),
        ("FoldingChair", "seat", True),
        ("Box", "rotation_lid", False),
    ],
)
def test_what_one_sets_starts_as_drawn_and_what_opens_starts_shut(
    tmp_path: Path, category: str, label: str, drawn: bool
) -> None:
    """A leaf drawn upright that lies on its body at the end of its range, where it is most compact."""
    urdf = robot(
        link("body", shape("0.4 0.3 0.02", xyz="-0.2 0 0")),
        link("part", shape("0.02 0.3 0.4", xyz="0 0 0.2")),
        joint("hinge", "revolute", "body", "part", xyz="0 0 0.03", axis="0 -1 0", limit="0 1.5708"),
    )
    item = read(written(tmp_path, urdf), category)
    links = tuple(one.model_copy(update={"label": label if one.name == "part" else ""}) for one in item.features.links)
    item = replace(item, features=item.features.model_copy(update={"links": links}))
    overlay, _ = validate(item, Overlay(scale=1.0), Source.MODEL, 0.5, NO_VIEWS.physics)
    (hinge,) = overlay.joints
    assert hinge.closed == pytest.approx(1.5708, abs=1e-3)
    assert hinge.initial_position == pytest.approx(0.0 if drawn else 1.5708, abs=1e-3)


def test_a_folding_chair_that_is_asked_unfolded_is_not_turned_to_its_other_end() -> None:
    """Its drawn end looks closed, and was counted from the other: the chair lay folded, and fell."""
    info = ObjectInfo.from_json(thing("FoldingChair", hinged("legs", "leg")))
    (part,) = parts_of(info, "FoldingChair")
    wish = read_guidance("A folding chair, unfolded.", info).of_joints["legs"]
    assert mirrored_if_wrong_end(requested_state(part, wish, 1.0, True), 0.0, Notes()) == 0.0


@pytest.mark.parametrize(
    ("lower", "upper", "unfolded"), [(0.0, 1.0, 0.0), (-0.16, 0.81, 0.0), (-0.97, 0.03, 0.0), (-0.6, 0.4, 0.4)]
)
def test_a_folding_chair_is_unfolded_as_drawn_and_by_its_looks_where_it_is_drawn_at_no_end(
    lower: float, upper: float, unfolded: float
) -> None:
    legs = hinged("legs", "leg", lower=lower, upper=upper, closed=lower)
    info = ObjectInfo.from_json(thing("FoldingChair", legs))
    (part,) = parts_of(info, "FoldingChair")
    wish = read_guidance("A folding chair, unfolded.", info).of_joints["legs"]
    assert asked_position(part, wish, 1.0) == pytest.approx(unfolded, abs=1e-3)


@pytest.mark.parametrize(
    ("low", "high", "proud", "metric", "start"),
    [
        (-0.1, 0.25, 0.0, True, 0.0),
        (-0.1, 0.25, 0.0, False, -0.1),
        (0.0, 0.25, 0.0, True, 0.0),
        (-0.25, 0.0, 0.0, True, 0.0),
        (-0.3, 0.1, 0.3, True, -0.3),
    ],
    ids=["drawn on its way", "of unknown unit", "at its lower end", "at its upper end", "out of its case"],
)
def test_a_slide_that_is_drawn_on_its_way_starts_there_unless_its_closed_end_is_sure(
    low: float, high: float, proud: float, metric: bool, start: float, tmp_path: Path
) -> None:
    """A plate that slides along a block of 0.5 m, of which nothing says where it is closed, or a tray in its case."""
    of = 1.0 if metric else 2.0 / 0.5001234
    edges = [" ".join(f"{edge * of:.9g}" for edge in size) for size in ((0.5, 0.3, 0.1), (0.04, 0.28, 0.2))]
    block = shape(edges[0])
    if proud:
        walls = [shape("0.5 0.3 0.01", xyz=f"0 0 {z}") for z in (0.05, 0.272)]
        sides = [shape("0.5 0.01 0.21", xyz=f"0 {y} 0.161") for y in (-0.145, 0.145)]
        block, edges[1] = "".join((*walls, *sides)), "0.48 0.27 0.2"
    parts = link("base", block), link("plate", shape(edges[1]))
    slide = joint("push", "prismatic", "base", "plate", xyz=f"{proud} 0 {0.155 * of + 0.005 * bool(proud):.9g}",
                  axis="1 0 0", limit=f"{low * of} {high * of}")  # fmt: skip
    item = read(written(tmp_path, robot(*parts, slide)))
    assert bool(item.features.metric) is metric
    done, _ = validate(item, Overlay(scale=1.0), Source.MODEL, 0.5, NO_VIEWS.physics)
    assert done.joints[0].initial_position == pytest.approx(start * of)


@pytest.mark.parametrize(("on", "lifted"), [("0 0 0.02", True), ("0 0.5 0.02", False), ("0 0 -0.02", False)])
def test_what_lies_on_a_part_opens_with_it(on: str, lifted: bool, tmp_path: Path) -> None:
    """A seat that is asked up, and a lid on it, beside it, or below it."""
    seat, lid = (shape("0.4 0.4 0.018", xyz=f"{0.2} {at.split()[1]} {at.split()[2]}") for at in ("0 0 0", on))
    turn = {"xyz": "0 0 0.25", "axis": "0 -1 0", "limit": "0 1.6"}
    item = read(written(tmp_path, robot(
        link("bowl", shape("0.5 0.5 0.4", xyz="0.2 0 0")), link("seat", seat), link("lid", lid),
        joint("a", "revolute", "bowl", "seat", **turn), joint("b", "revolute", "bowl", "lid", **turn),
    )), "Toilet")  # fmt: skip
    asked = ("initial_joint_positions.a",)
    for name, at in (("a", 1.5), ("b", 0.0)):
        proposal = Overlay(scale=1.0, initial_joint_positions={name: at}, asked=(name, *asked))
        done, findings = validate(item, proposal, Source.MODEL, 0.5, NO_VIEWS.physics)
        starts = {joint.name: joint.initial_position for joint in done.joints}
        assert starts == pytest.approx({"a": 1.5, "b": 1.5 if lifted else 0.0} if name == "a" else {"a": 0.0, "b": 0.0})
        assert ("opened_along" in [finding.code for finding in findings]) is (lifted and name == "a")


@pytest.mark.parametrize(("lower", "turned"), [(-1.9, 0.785), (0.0, 0.785), (-1.5, 0.785), (-2.5, -0.785)])
def test_an_angle_of_a_spout_counts_from_where_it_is_drawn_to_its_further_end(lower: float, turned: float) -> None:
    info = ObjectInfo.from_json(thing("Faucet", hinged("spout", "spout", lower=lower, upper=1.9)))
    (part,) = parts_of(info, "Faucet")
    wish = read_guidance("a faucet whose spout is turned by 45 degrees", info).of_joints["spout"]
    assert asked_position(part, wish, 1.0) == pytest.approx(turned, abs=1e-3)
