"""What carries an object: who says so first, and what the shape says where nobody does."""

import math
from pathlib import Path

import numpy as np
import pytest

from asset2sim.physics.felt import effort_limit
from asset2sim.physics.support_polygon import standing_on
from asset2sim.validation.support import by_shape, has_flat_back
from asset2sim.validation.validate import validate
from schemas.overlay import LinkProposal, Overlay, PhysicsOverlay
from schemas.support import Mount, Support, SupportKind, SupportProposal
from schemas.thresholds import Thresholds
from schemas.vocabulary import Source
from tests.assets import NO_VIEWS, joint, link, read, robot, shape, written
from tests.builders import corners
from tests.factories import guidance_of

LEAF = robot(
    link("frame", shape("0.05 0.06 2", xyz="0 0 1")),
    link("leaf", shape("0.04 0.9 1.98", xyz="0 0.45 1")),
    joint("swing", "revolute", "frame", "leaf", xyz="0 0.03 0", axis="0 0 1", limit="0 1.5"),
)
"""A door leaf on its post, 1 m wide and as thin as one: nothing stands on it."""
CHEST = robot(
    link("body", shape("0.5 0.8 0.5", xyz="0 0 0.25")),
    link("drawer", shape("0.4 0.6 0.2")),
    joint("pull", "prismatic", "body", "drawer", xyz="0 0 0.3", axis="1 0 0", limit="0 0.3"),
)


def support(folder: Path, urdf: str, guidance: str = "", category: str = "", said: SupportProposal | None = None,
            forced: Support | None = None) -> Support:  # fmt: skip
    """What validation says carries an object of which a model says no more than ``said``."""
    item, proposal = read(written(folder, urdf), category), Overlay(scale=1.0, support=said)
    overlay, _ = validate(
        item, proposal, Source.MODEL, 0.5, NO_VIEWS.physics, forced, guidance=guidance_of(guidance, item.features)
    )
    return overlay.support


def test_the_first_that_says_so_counts(tmp_path: Path) -> None:
    hand = SupportProposal(kind=SupportKind.HANDHELD, confidence=0.8, reason="small")
    forced = Support(kind=SupportKind.FREESTANDING, source=Source.USER, confidence=1.0)
    assert support(tmp_path, LEAF, "A wall-mounted door.", "Door", hand, forced) == forced
    words = support(tmp_path, LEAF, "A wall-mounted door.", "Door", hand)
    assert (words.kind, words.mount, words.source) == (SupportKind.FIXED, Mount.WALL, Source.USER)
    model = support(tmp_path, LEAF, "A door.", "Door", hand)
    assert (model.kind, model.source, model.confidence) == (SupportKind.HANDHELD, Source.MODEL, 0.8)
    table = support(tmp_path, LEAF, "A thing.", "Door")
    assert (table.kind, table.mount, table.source) == (SupportKind.FIXED, Mount.BUILT_IN, Source.PRIOR)
    shaped = support(tmp_path, LEAF, "A thing.")
    assert (shaped.kind, shaped.source) == (SupportKind.FIXED, Source.RULE)


def test_words_without_a_place_take_it_from_what_such_things_are(tmp_path: Path) -> None:
    found = support(tmp_path, LEAF, "A valve, screwed to something.", "Valve")
    assert (found.kind, found.mount) == (SupportKind.FIXED, Mount.BUILT_IN)


def test_a_root_called_world_is_the_world(tmp_path: Path) -> None:
    hung = CHEST.replace("</robot>", link("world") + joint("to_world", "fixed", "world", "body") + "</robot>")
    found = support(tmp_path, hung)
    assert (found.kind, found.source) == (SupportKind.FIXED, Source.AUTHORED)


def test_what_stands_firm_is_no_door_although_a_model_thinks_so(tmp_path: Path) -> None:
    unsure = SupportProposal(kind=SupportKind.FIXED, mount=Mount.BUILT_IN, confidence=0.6, reason="it has a door")
    sure = unsure.model_copy(update={"confidence": 0.9})
    assert support(tmp_path, CHEST, said=unsure).kind is SupportKind.FREESTANDING
    assert support(tmp_path, CHEST, said=sure).kind is SupportKind.FIXED


def test_the_shape_of_a_chest_of_a_pen_and_of_a_clock() -> None:
    def shaped(x: float, y: float, z: float) -> Support:
        points = corners((-x / 2, -y / 2, 0.0), (x / 2, y / 2, z))
        return by_shape(standing_on(points, np.array([0.0, 0.0, z / 2]), 1.0, np.array([0.0, 0.0, 1.0])), points)

    chest, pen, plate = shaped(0.5, 0.8, 0.5), shaped(0.004, 0.004, 0.14), shaped(0.01, 0.4, 0.4)
    assert chest.kind is SupportKind.FREESTANDING
    # Its margin is atan(0.25 / 0.25) = 45°, said in the reason.
    assert "45°" in chest.reason and chest.confidence == pytest.approx(0.4 + math.pi / 4 if math.pi / 4 < 0.6 else 1.0)
    assert pen.kind is SupportKind.HANDHELD
    assert (plate.kind, plate.mount) == (SupportKind.FIXED, Mount.WALL)
    # A start of the reset check tilts by 2° about two axes, 2.8° in all; these tip at 2.5° and at 3.4°.
    tipping, standing = shaped(0.035, 0.8, 0.8), shaped(0.048, 0.8, 0.8)
    assert (tipping.kind, standing.kind) == (SupportKind.FIXED, SupportKind.FREESTANDING)


def test_what_leans_on_its_third_foot_stands(tmp_path: Path) -> None:
    """A cart whose wheels are drawn 4 cm lower than the box behind them, 1.2 m away: it leans by 2°."""
    cart = robot(
        link("body", shape("1.6 1 0.5", xyz="0 0 0.31")),
        link("wheels", shape("0.4 1 0.4")),
        joint("steer", "revolute", "body", "wheels", xyz="0.6 0 0.22", axis="0 0 1", limit="-0.5 0.5"),
    )
    assert support(tmp_path, cart).kind is SupportKind.FREESTANDING


def test_a_flat_back_is_most_of_a_side_in_one_plane() -> None:
    assert has_flat_back(corners((0.0, 0.0, 0.0), (0.1, 0.4, 0.4)))
    angles = np.linspace(0.0, 2.0 * math.pi, 64)
    post = np.array([(math.cos(a), math.sin(a), z) for a in angles for z in (0.0, 2.0)])
    assert not has_flat_back(post), "a round post touches a wall along a line"


def test_a_fixed_door_is_heavy_to_no_hand_and_tips_nothing(tmp_path: Path) -> None:
    def of(kind: SupportKind) -> PhysicsOverlay:
        forced = Support(kind=kind, source=Source.USER, confidence=1.0)
        item = read(written(tmp_path, LEAF), "Door")
        proposal = Overlay(scale=1.0, initial_joint_positions={"swing": 0.8}, asked=("swing",))
        return validate(item, proposal, Source.MODEL, 0.5, NO_VIEWS.physics, forced)[0]

    fixed, free = of(SupportKind.FIXED).joints[0], of(SupportKind.FREESTANDING).joints[0]
    # On a held post the leaf's whole inertia about its hinge resists; a free post gives way.
    assert fixed.effective_inertia > 1.5 * free.effective_inertia
    assert fixed.least_inertia == pytest.approx(fixed.effective_inertia), "and bounds its damping"
    assert fixed.effort_range is not None and fixed.effort_range.most_n < 100.0


def test_parts_that_hang_on_a_frame_are_held_unless_such_things_stand(tmp_path: Path) -> None:
    hung = robot(
        link("frame"),
        link("bar", shape("0.5 0.8 0.5", xyz="0 0 0.25")),
        joint("swing", "revolute", "frame", "bar", axis="1 0 0", limit="0 1"),
    )
    found = support(tmp_path, hung)
    assert (found.kind, found.source) == (SupportKind.FIXED, Source.RULE)
    standing = SupportProposal(kind=SupportKind.FREESTANDING, confidence=0.8, reason="a chest")
    assert support(tmp_path, hung, said=standing).kind is SupportKind.FREESTANDING
    marked = hung.replace('<link name="frame">', '<link name="frame">' + shape("0.005 0.005 0.005"))
    assert marked != hung and support(tmp_path, marked).reason == found.reason, "a mark on a frame bears nothing"
    item = read(written(tmp_path / "door", hung), "Microwave")
    tables = Overlay(scale=1.0, support=standing)
    alone, _ = validate(item, tables, Source.PRIOR, 0.5, NO_VIEWS.physics)
    assert alone.support.kind is SupportKind.FIXED, "of a door alone tables say how its microwave stands"


def test_no_hand_is_asked_to_lift_a_stage(tmp_path: Path) -> None:
    def lift(name: str, kg: float) -> float:
        weight = f'<inertial><mass value="{kg}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        text = robot(
            link("post", shape("0.3 0.3 0.05", xyz="0 0 0.025")),
            link(name, shape("0.12 0.13 0.1", xyz="0 0 0.3") + weight),
            joint("up", "prismatic", "post", name, axis="0 0 1", limit="0 0.3"),
        )
        item = read(written(tmp_path / f"{name}{kg}", text))
        made, _ = validate(item, Overlay(scale=1.0), Source.PRIOR, 0.5, NO_VIEWS.physics)
        (found,) = made.joints
        assert found.effort_range is not None
        return found.effort_range.most_n

    assert lift("stage", 10.0) > 100.0 > lift("stage", 1.0)
    assert lift("drawer", 10.0) < 100.0, "what a hand operates is for a hand, whatever it weighs"


def test_no_hand_is_asked_to_swing_a_heavy_arm_of_nothing_known(tmp_path: Path) -> None:
    def arm(kg: float, category: str, axis: str) -> float:
        weight = f'<inertial><origin xyz="0.3 0 0"/><mass value="{kg}"/>' \
                 '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.3" iyz="0" izz="0.3"/></inertial>'  # fmt: skip
        text = robot(
            link("post", shape("0.8 0.8 0.4", xyz="0 0 0.2")),
            link("beam", shape("0.6 0.1 0.1", xyz="0.3 0 0") + weight),
            joint("pin", "revolute", "post", "beam", axis=axis, xyz="0 0 0.6", limit="-0.5 0.5"),
        )
        item = read(written(tmp_path / f"{kg}{category}{axis[0]}", text), category)
        made, _ = validate(item, Overlay(scale=1.0), Source.PRIOR, 0.5, NO_VIEWS.physics)
        assert made.joints[0].effort_range is not None
        return made.joints[0].effort_range.most_n

    # By hand: half its weight at the end of the beam, whose middle hangs at half its length: 98 N and 10 N.
    assert arm(20.0, "", "0 1 0") > 98.0 > arm(2.0, "", "0 1 0")
    assert arm(20.0, "", "0 0 1") < 98.0, "a vertical hinge bears no weight"
    assert arm(20.0, "Microwave", "0 1 0") < 98.0, "what is for a hand is for a hand, whatever it weighs"


def test_a_pendulum_on_a_frame_keeps_the_damping_of_its_file_and_a_motor_that_moves_it(tmp_path: Path) -> None:
    weight = '<inertial><origin xyz="0 0 -0.5"/><mass value="1"/>' \
             '<inertia ixx="0.084" iyy="0.084" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>'  # fmt: skip
    more = '<dynamics damping="0.1"/><limit effort="0.001" velocity="1"/>'
    text = robot(
        link("world"),
        link("pole", shape("0.05 0.05 1", xyz="0 0 -0.5") + weight),
        joint("pin", "continuous", "world", "pole", axis="0 1 0", more=more),
    )
    item = read(written(tmp_path, text))
    made, told = validate(item, Overlay(scale=1.0), Source.PRIOR, 0.5, NO_VIEWS.physics)
    (pin,) = made.joints
    assert (pin.damping, pin.damping_source) == (0.1, Source.AUTHORED), "the frame that holds it is no body"
    raised = next(finding for finding in told if finding.code == "effort_raised")
    assert raised.value == 0.001 and raised.limit == pytest.approx(effort_limit(0.001, pin, NO_VIEWS.physics))
    assert effort_limit(1.0, pin, NO_VIEWS.physics) == 1.0 > pin.friction


@pytest.mark.parametrize("hung", [True, False])
def test_a_seesaw_on_a_light_stand_that_is_held_keeps_the_damping_of_its_file(tmp_path: Path, hung: bool) -> None:
    def weight(kg: float, iyy: float) -> str:
        return f'<inertial><mass value="{kg}"/><inertia ixx="{iyy}" iyy="{iyy}" izz="{iyy}" ixy="0" ixz="0" iyz="0"/></inertial>'  # fmt: skip  # noqa: E501

    board = 6.0 * (1.5**2 + 0.03**2) / 12.0
    text = robot(
        link("stand", shape("0.1 0.3 0.36", xyz="0 0 0.18") + weight(0.1, 1e-3)),
        link("board", shape("1.5 0.25 0.03") + weight(6.0, board)),
        joint("pivot", "revolute", "stand", "board", xyz="0 0 0.4", axis="0 1 0", limit="-0.35 0.35",
              more='<dynamics damping="2.5"/>'),
        *((link("world"), joint("bolt", "fixed", "world", "stand")) if hung else ()),
    )  # fmt: skip
    forced = None if hung else Support(kind=SupportKind.FIXED, source=Source.USER)
    item = read(written(tmp_path, text))
    made, told = validate(item, Overlay(scale=1.0), Source.PRIOR, 0.5, NO_VIEWS.physics, forced)
    (pivot,) = made.joints
    assert pivot.damping == 2.5 and pivot.damping_source is Source.AUTHORED
    assert not {"damping_bounded", "damping_coupled"} & {finding.code for finding in told}


@pytest.mark.parametrize(
    ("lid_kg", "words_at", "limits", "tips"),
    [
        # Laid back, the lid's middle is 0.2 m behind the hinge, the base's 0.2 m before it: it tips from 1 kg on.
        (0.9, 0.0, Thresholds(), False),
        (1.2, 0.0, Thresholds(), True),
        # Asked to be open there, it is the state that the stands check judges.
        (1.2, math.pi, Thresholds(), False),
        # By a margin of 10 degrees and what a push has, 0.9 kg is too much.
        (0.9, 0.0, Thresholds(stands_margin_rad=0.17, touch_j=0.2), True),
    ],
)
def test_a_lid_that_outweighs_its_box_behind_the_hinge_pulls_it_over(
    tmp_path: Path, lid_kg: float, words_at: float, limits: Thresholds, tips: bool
) -> None:
    urdf = robot(
        link("base", shape("0.4 0.4 0.3", xyz="0 0 0.15")),
        link("lid", shape("0.4 0.4 0.02", xyz="-0.2 0 0.01")),
        joint("hinge", "revolute", "base", "lid", xyz="0.2 0 0.301", axis="0 1 0", limit="0 3.1416"),
    )
    proposal = Overlay(
        scale=1.0,
        links=(LinkProposal(name="base", mass_kg=1.0), LinkProposal(name="lid", mass_kg=lid_kg)),
        initial_joint_positions={"hinge": words_at},
        asked=("links.base.mass_kg", "links.lid.mass_kg", "initial_joint_positions.hinge"),
    )
    box, physics = read(written(tmp_path, urdf), "Box"), NO_VIEWS.physics
    _, findings = validate(box, proposal, Source.MODEL, 0.5, physics, limits=limits)
    assert [finding.joint for finding in findings if finding.code == "tips_when_open"] == (["hinge"] if tips else [])
