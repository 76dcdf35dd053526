"""Joint limits and positions: inverted ones swapped, locked ones dropped, whole turns taken out, lengths scaled."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from asset2sim.intake.origin import extract
from asset2sim.validation.limits import Range, joint_range
from asset2sim.validation.positions import initial_positions
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef
from schemas.features import JointFeatures
from schemas.finding import Finding, Notes
from schemas.overlay import JointPhysics, JointProposal, Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Severity, Source
from tests.assets import joint, link, near, robot, shape, written
from tests.builders import joint_features

PHYSICS = PhysicsSettings()


def authored(
    kind: str, lower: float | None, upper: float | None, *, closed: float = 0.0, opened: float = 0.0, sure: float = 1.0
) -> JointFeatures:
    ends = {"closed": None, "open": None} if kind == "fixed" else {"closed": closed, "open": opened}
    stated = {"lower": lower, "upper": upper, "openness_confidence": sure, **ends}
    return joint_features("part", kind, "a", "b").model_copy(update=stated)


def ranged(joint: JointFeatures, scale: float = 1.0) -> tuple[Range | None, Notes]:
    notes = Notes()
    return joint_range(joint, scale, notes), notes


def some_range(joint: JointFeatures, scale: float = 1.0) -> Range:
    found, _ = ranged(joint, scale)
    assert found is not None
    return found


def started(
    span: Range, wanted: float | None, *, asked: bool = True, scale: float = 1.0, rest: float | None = None
) -> tuple[float, Range, Notes, Source]:
    notes = Notes()
    proposed = {} if wanted is None else {"part": wanted}
    starts = initial_positions(
        {"part": span},
        proposed,
        {} if rest is None else {"part": rest},
        {"part"} if asked else set(),
        scale,
        Source.MODEL,
        PHYSICS,
        notes,
    )
    start = starts["part"]
    assert start.requested == (asked and wanted is not None)
    return start.position, start.range, notes, start.source


def codes(notes: Notes) -> list[str]:
    return [finding.code for finding in notes.findings]


def test_a_sound_range_stays_as_authored() -> None:
    found, notes = ranged(authored("revolute", -0.5, 1.5, closed=-0.5, opened=1.5))
    assert found is not None and (found.lower, found.upper, found.closed, found.open) == (-0.5, 1.5, -0.5, 1.5)
    assert found.source is Source.AUTHORED and found.span == 2.0 and not notes.findings


@pytest.mark.parametrize("scale", [0.25, 4.0])
def test_a_slider_scales_and_a_hinge_does_not(scale: float) -> None:
    slider = some_range(authored("prismatic", -0.1, 0.7, closed=-0.1, opened=0.7), scale)
    assert (slider.lower, slider.upper) == (-0.1 * scale, 0.7 * scale)
    assert (slider.closed, slider.open) == (-0.1 * scale, 0.7 * scale)
    hinge = some_range(authored("revolute", -0.1, 0.7, closed=-0.1, opened=0.7), scale)
    assert (hinge.lower, hinge.upper, hinge.closed, hinge.open) == (-0.1, 0.7, -0.1, 0.7)


def test_inverted_limits_are_swapped() -> None:
    found, notes = ranged(authored("prismatic", 0.8, -0.2, closed=-0.2, opened=0.8), 0.5)
    assert found is not None and (found.lower, found.upper, found.source) == (-0.1, 0.4, Source.RULE)
    (finding,) = notes.findings
    assert (finding.code, finding.severity, finding.joint) == ("limits_inverted", Severity.WARNING, "part")
    assert (finding.value, finding.limit) == (0.4, -0.1)


@pytest.mark.parametrize(
    ("kind", "at", "said"), [("revolute", 0.3, ["part"]), ("prismatic", 0.3, ["part"]), ("fixed", None, [])]
)
def test_a_joint_without_a_range_is_locked(kind: str, at: float | None, said: list[str]) -> None:
    found, notes = ranged(authored(kind, at, at))
    assert found is None and codes(notes) == ["joint_locked"] * len(said)
    assert [item.joint for item in notes.findings] == said


def test_a_continuous_joint_has_a_full_turn() -> None:
    found = some_range(authored("continuous", None, None))
    assert found.lower is None and found.upper is None and found.span == 2.0 * math.pi
    assert found.clamp(100.0) == 100.0


@pytest.mark.parametrize("turns", [-1, 1, 2])
def test_limits_a_whole_turn_away_are_turned_back(turns: int) -> None:
    away = 2.0 * math.pi * turns
    lower, upper = away, away + 3.26
    found, notes = ranged(authored("revolute", lower, upper, closed=lower, opened=upper))
    assert found is not None and near((found.lower, found.upper), (0.0, 3.26), 1e-6)
    assert near((found.closed, found.open), (0.0, 3.26), 1e-6) and found.source is Source.RULE
    assert codes(notes) == ["limits_turned"] and near(notes.findings[0].value, -away)


def test_zero_outside_is_said_where_no_turn_helps() -> None:
    found, notes = ranged(authored("revolute", 0.5, 1.0))
    assert found is not None and (found.lower, found.upper) == (0.5, 1.0)
    assert codes(notes) == ["zero_outside_limits"]
    slider, notes = ranged(authored("prismatic", 6.0, 7.0))
    assert slider is not None and (slider.lower, slider.upper) == (6.0, 7.0), "lengths have no turns"
    assert codes(notes) == ["zero_outside_limits"]


def test_a_slider_position_is_at_the_authored_scale() -> None:
    span = some_range(authored("prismatic", 0.0, 0.8), 0.25)
    assert started(span, 0.4, scale=0.25)[0] == 0.1


@pytest.mark.parametrize(
    ("wanted", "asked", "position", "limits", "code"),
    [
        (0.625, True, 0.625, (0.0, 1.0), None),
        (1.0625, True, 1.0625, (0.0, 1.0625), "limits_widened"),
        (-0.0625, True, -0.0625, (-0.0625, 1.0), "limits_widened"),
        (1.25, True, 1.0, (0.0, 1.0), "position_clamped"),
        (-0.25, True, 0.0, (0.0, 1.0), "position_clamped"),
        (1.0625, False, 1.0, (0.0, 1.0), "position_clamped"),
    ],
    ids=["inside", "slightly over", "slightly under", "far over", "far under", "not the user's"],
)
def test_a_position_slightly_outside_widens_for_the_user_and_any_other_is_clamped(
    wanted: float, asked: bool, position: float, limits: tuple[float, float], code: str | None
) -> None:
    found, span, notes, source = started(some_range(authored("revolute", 0.0, 1.0)), wanted, asked=asked)
    assert (found, (span.lower, span.upper), source) == (position, limits, Source.USER if asked else Source.MODEL)
    assert [(item.code, item.joint) for item in notes.findings] == [(code, "part")] * bool(code)
    if code == "limits_widened":
        assert span.source is Source.USER
    if code == "position_clamped":
        assert notes.findings[0].value == wanted


def test_whole_turns_are_taken_out_of_a_requested_angle() -> None:
    span = some_range(authored("revolute", -6.283185307179586, -3.022212132753381))
    position, widened, notes, _ = started(span, -4.0)
    assert near(position, 2.0 * math.pi - 4.0) and widened == span and not notes.findings


@pytest.mark.parametrize(
    ("closed", "sure", "expected"), [(0.75, 0.9, 0.75), (0.75, PHYSICS.sure_of_closed - 0.01, 0.0), (0.0, 1.0, 0.0)]
)
def test_nobody_asked(closed: float, sure: float, expected: float) -> None:
    span = replace(some_range(authored("revolute", -1.0, 0.75, closed=closed, opened=-1.0, sure=sure)))
    position, _, notes, source = started(span, None)
    assert (position, source) == (expected, Source.RULE) and not notes.findings
    outside = some_range(authored("revolute", 0.5, 1.0, sure=0.0))
    assert started(outside, None)[0] == 0.5, "the authored zero, where it lies outside, is clamped"


def test_a_part_on_a_spring_starts_where_that_brings_it_unless_a_state_is_asked() -> None:
    span = some_range(authored("revolute", -1.0, 1.0, closed=-1.0, opened=1.0))
    assert started(span, None, rest=0.2)[0] == 0.2
    assert started(span, None, rest=3.0)[0] == 1.0, "within its limits"
    assert started(span, 0.5, rest=0.2)[0] == 0.5


KEYS = {"narrow": (5, 2.0), "wide": (20, 2.0), "proud": (5, 6.0), "flush": (5, 0.0), "sunk": (5, -2.0),
        "middling": (12, 0.0), "broad": (15, 0.0), "in_hole": (20, 2.0)}  # fmt: skip
"""Key → its width and how far it stands out of the board, mm. Each goes down by 4 mm."""
STRIPS = ((-0.2, 0.094), (0.106, 0.1425), (0.1575, 0.19), (0.21, 0.25))
"""Solid stretches of the board along x, m: the last three keys go down between them, the others are drawn in it."""


def pressed(
    folder: Path, keep: str = "nothing", scale: float = 1.0, **asked_m: float
) -> tuple[dict[str, JointPhysics], list[Finding]]:
    """The keys of a board as validated, and what is said of how far they go. The board's top, at z = 0, is a part
    of its own, fixed on with its axes turned; each key is a box 1 cm deep."""
    strips = (shape(f"0.2 {high - low} 0.01", xyz=f"0 {-(low + high) / 2.0} 0") for low, high in STRIPS)
    parts = [link("base", shape("0.4 0.2 0.01")), link("cover", "".join(strips))]
    on_top = '<parent link="base"/><child link="cover"/><origin xyz="0 0 0.01" rpy="0 0 1.5707963"/>'
    parts += [f'<joint name="on_top" type="fixed">{on_top}</joint>']
    for number, (name, (wide, out)) in enumerate(KEYS.items()):
        parts += [link(f"{name}_key", shape(f"{1e-3 * wide} {1e-3 * wide} 0.01", xyz=f"0 0 {1e-3 * out - 0.005}"))]
        place = f"{0.05 * number - 0.15} 0 0.015"
        parts += [joint(name, "prismatic", "base", f"{name}_key", xyz=place, axis="0 0 -1", limit="0 0.004")]
    item = extract(AssetRef(asset_id="board", path=str(written(folder, robot(*parts))), keep=(keep,)))
    springs = tuple(JointProposal(name=name, press_start=0.6, press_end=0.9, spring_rest=0.0) for name in KEYS)
    overlay = Overlay(scale=scale, joints=springs, initial_joint_positions=asked_m, asked=tuple(asked_m))
    done, findings = validate(item, overlay, Source.MODEL, 0.5, PhysicsSettings())
    assert len(done.joints) == len(KEYS) and all(own.stiffness > 0.0 for own in done.joints)
    return {own.name: own for own in done.joints}, [one for one in findings if one.code.startswith("press_d")]


def test_a_key_narrower_than_a_finger_goes_no_deeper_than_it_stands_out(tmp_path: Path) -> None:
    keys, told = pressed(tmp_path)
    # 2 mm less 0.1, however wide what is drawn on the board itself; at least half a millimetre.
    assert keys["narrow"].upper == keys["wide"].upper == pytest.approx(0.0019)
    assert keys["flush"].upper == pytest.approx(0.0005)
    # Into a gap of 12 mm a tip of 16 mm dips by 2.7 mm, which is looked for in rings of half a millimetre.
    dips = [8.0 - math.sqrt(64.0 - half**2) - 0.1 for half in (6.0, 6.5)]
    assert dips[0] <= 1e3 * (keys["middling"].upper or 0.0) <= dips[1] + 1e-9
    # Into one of 15 mm it dips by 5.2 mm, it goes into one of 20 mm, and does not get to what is sunk.
    assert all(keys[name].upper == 0.004 for name in ("proud", "broad", "in_hole", "sunk"))
    drawn_in = ("narrow", "wide", "flush", "middling")
    assert [(one.code, one.joint) for one in told] == [("press_drawn_in", name) for name in drawn_in]
    assert "goes 4 mm" in told[0].message and "after 2 mm: drawn in to 1.9 mm" in told[0].message
    narrow, wide = keys["narrow"], keys["in_hole"]
    assert (narrow.limits_source, wide.limits_source) == (Source.RULE, Source.AUTHORED)
    # It is open where it ends, and there its spring has what it was asked to have, 0.9 N, beside the key's weight.
    assert narrow.open == narrow.upper and narrow.closed == 0.0
    rises = [own.stiffness * ((own.upper or 0.0) - own.spring_reference) for own in (narrow, wide)]
    assert rises[0] == pytest.approx(0.9, abs=0.1) and rises[1] == pytest.approx(0.9, abs=0.1)


def test_a_finger_does_not_grow_with_the_object(tmp_path: Path) -> None:
    keys, _ = pressed(tmp_path, scale=2.0)
    assert keys["narrow"].upper == pytest.approx(0.0039) and keys["middling"].upper == 0.008


def test_a_range_that_is_kept_or_asked_for_is_told_and_stays(tmp_path: Path) -> None:
    keys, told = pressed(tmp_path / "kept", keep="limits")
    assert {own.upper for own in keys.values()} == {0.004}
    assert [one.code for one in told] == ["press_deep"] * 4 and "kept as its file has it" in told[0].message
    keys, told = pressed(tmp_path / "asked", narrow=0.003, flush=0.0)
    assert keys["narrow"].upper == keys["narrow"].initial_position == 0.003
    assert keys["flush"].upper == pytest.approx(0.0005)
