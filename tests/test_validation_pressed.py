"""How far keys go: no finger presses what is narrower than itself below what is around it."""

import math
from pathlib import Path

import pytest

from asset2sim.intake.origin import extract
from asset2sim.validation.validate import validate
from schemas.asset import AssetRef
from schemas.finding import Finding
from schemas.overlay import JointPhysics, JointProposal, Overlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import Source
from tests.assets import joint, link, robot, shape, written

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
