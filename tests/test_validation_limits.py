"""Joint limits and positions: inverted ones swapped, locked ones dropped, whole turns taken out, lengths scaled."""

import math
from dataclasses import replace

import pytest

from asset2sim.validation.limits import Range, joint_range
from asset2sim.validation.positions import initial_positions
from schemas.features import JointFeatures
from schemas.finding import Notes
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Severity, Source
from tests.assets import near

PHYSICS = PhysicsSettings()


def authored(
    kind: str, lower: float | None, upper: float | None, *, closed: float = 0.0, opened: float = 0.0, sure: float = 1.0
) -> JointFeatures:
    return JointFeatures(
        name="part", type=kind, parent="a", child="b", origin_xyz=(0, 0, 0), origin_rpy=(0, 0, 0), axis=(0, 0, 1),
        axis_in_root=(0, 0, 1), lower=lower, upper=upper, effort=None, velocity=None, damping=None, friction=None,
        mimic=None, closed=None if kind == "fixed" else closed, open=None if kind == "fixed" else opened,
        openness_confidence=sure,
    )  # fmt: skip


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
