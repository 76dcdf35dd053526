"""The check ``lifted``: what a hand lifts and sets down, and what it must not take for that, each planted."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.assets.authored import read_overlay
from asset2sim.gym.hand.gripper import open_world
from asset2sim.gym.hand.lifted import Lifted, lift
from asset2sim.gym.hand.surfaces import meets_first
from schemas.asset import AssetRef
from schemas.hand_settings import HandSettings, LiftSettings
from schemas.settings import Settings
from tasks.by_hand import measure_lifted
from tasks.progress import AssetJob
from tests.assets import link, prior, robot, shape
from tests.refined_things import Solid, block, inertial, refined, two

pytestmark = pytest.mark.system


def told(folder: Path, **terms: Any) -> Path:
    """The folder, its overlay changed."""
    file = folder / "overlay.json"
    overlay = json.loads(file.read_text(encoding="utf-8")) | terms
    file.write_text(json.dumps(overlay), encoding="utf-8")
    return folder


def lifted(folder: Path) -> Lifted:
    return lift(folder, read_overlay(folder), HandSettings(), LiftSettings())


def with_middle(folder: Path, inertia: str, xyz: str) -> Path:
    """The same object with the centre of the part of this inertial elsewhere."""
    urdf, moved = folder / "mobility.urdf", inertia.replace("<inertial>", f'<inertial><origin xyz="{xyz}"/>')
    urdf.write_text(urdf.read_text(encoding="utf-8").replace(inertia, moved), encoding="utf-8")
    return folder


def trap(folder: Path, friction: float) -> Path:
    """A block on a flap that hangs on a hinge at its lower edge, and falls open once nothing is below."""
    made = two(folder, Solid(shape("0.06 0.06 0.08", xyz="0 0 0.046"), 0.5, 0.07),
               Solid(shape("0.06 0.06 0.004", xyz="0.03 0 0"), 0.05, 0.05), "revolute", "-0.03 0 0.003", "0 1 0", 1.5,
               names=("flap", "hinge"), friction=friction, damping=0.001, holds=True)  # fmt: skip
    return with_middle(made, inertial(0.05, 0.05), "0.03 0 0")


def test_a_block_is_lifted_and_set_down_at_every_yaw_and_a_cupboard_is_no_load(tmp_path: Path) -> None:
    assert lifted(block(tmp_path / "block", 0.06, 0.5)) == Lifted(True, 1.0, "gripper")
    assert lifted(block(tmp_path / "heavy", 0.3, 20.0)) == Lifted(False)
    assert lifted(block(tmp_path / "large", 1.1, 2.0)) == Lifted(False)


def laptop(folder: Path) -> Path:
    """A base with a screen as wide that leans back."""
    made = two(folder, Solid(shape("0.24 0.34 0.02", xyz="0 0 0.01"), 2.4, 0.2),
               Solid(shape("0.008 0.34 0.22", xyz="0 0 0.115"), 0.4, 0.2), "revolute", "-0.115 0 0.022", "0 -1 0", 1.9,
               names=("screen", "hinge"), start=0.3, friction=0.6, damping=0.01, holds=True)  # fmt: skip
    return with_middle(made, inertial(0.4, 0.2), "0 0 0.12")


def test_both_hands_lift_what_one_does_not_get_about_or_hold(tmp_path: Path) -> None:
    assert lifted(block(tmp_path / "wide", 0.2, 1.0)) == Lifted(True, 1.0, "both hands")
    assert lifted(block(tmp_path / "heavy", 0.3, 5.0)) == Lifted(True, 1.0, "both hands")


def test_what_both_hands_hold_does_not_creep_out_of_them(tmp_path: Path) -> None:
    """Of 70 N each, at a friction of 0.4, both hold 56 N, of which a screen of 4.3 kg takes 42 N."""
    screen = robot(link("body", shape("0.06 0.5 0.35", xyz="0 0 0.175") + inertial(4.3, 0.3)))
    folder = refined(tmp_path / "screen", screen, [], {"body": 4.3}, fixed=False)
    assert lifted(told(folder, contact_friction=0.4)).share == 1.0


def test_what_closing_hands_meet_first_is_told(tmp_path: Path) -> None:
    world = open_world(laptop(tmp_path / "laptop"), HandSettings(), hands=2)
    world.reset()
    pose, screen = np.eye(4), frozenset({int(world.model.body(f"{world.prefix}screen").id)})
    pose[:3, :3] = [[0, 1, 0], [1, 0, 0], [0, 0, -1]]  # fingers down, one hand in front of it and one behind
    for tips_m, alone in ((0.01, False), (0.05, True)):  # the base is in front of the screen, which leans back over it
        pose[2, 3] = tips_m + world.tool.tip_m
        assert meets_first(world, pose, 0.25, screen) is alone
        assert not meets_first(world, pose, 0.25, frozenset({world.root}))


def test_a_board_that_lies_flat_is_lifted_from_an_edge_and_a_heavy_one_by_both_hands(tmp_path: Path) -> None:
    board = robot(link("body", shape("0.2 0.15 0.012", xyz="0 0 0.006") + inertial(0.3, 0.1)))
    flat = refined(tmp_path / "flat", board, [], {"body": 0.3}, fixed=False)
    assert lifted(flat) == Lifted(True, 1.0, "gripper at an edge")
    # Held by its edge it pulls with 2.9 kg · g · 0.2 m = 5.7 N·m; pads of 5 cm that press with 70 N bear a third of it.
    board = robot(link("body", shape("0.45 0.4 0.012", xyz="0 0 0.006") + inertial(2.9, 0.3)))
    heavy = refined(tmp_path / "heavy", board, [], {"body": 2.9}, fixed=False)
    assert lifted(heavy) == Lifted(True, 1.0, "both hands")
    # Of 70 N each, at a friction of 0.15, both hold 21 N.
    slippery = lifted(told(heavy, contact_friction=0.15))
    assert slippery.share == 0.0 and slippery.reason.startswith("hand:")


def test_what_is_too_heavy_too_slippery_or_too_wide_is_not_lifted(tmp_path: Path) -> None:
    in_hand = {"kind": "handheld"}
    heavy = lifted(told(block(tmp_path / "heavy", 0.06, 12.0), support=in_hand))
    assert (heavy.share, heavy.reason) == (0.0, "object: it weighs 118 N, and the hand lifts 45 N")
    assert lifted(told(block(tmp_path / "both", 0.06, 8.0), support=in_hand)).by == "both hands"  # 78 N of 90
    # Two fingers of 70 N at a friction of 0.1 hold 14 N, and it weighs 20 N.
    slippery = lifted(told(block(tmp_path / "slippery", 0.06, 2.0), contact_friction=0.1))
    assert slippery.share == 0.0 and "hand: it slips" in slippery.reason
    wide = lifted(block(tmp_path / "wide", 0.65, 1.0))
    assert wide.share == 0.0 and "hand: no grasp of at most" in wide.reason


def test_an_object_that_is_pressed_harder_than_a_hand_presses_is_not_lifted(tmp_path: Path) -> None:
    folder = block(tmp_path / "block", 0.06, 0.5)
    weak = HandSettings(most_n=0.01)  # of 70 N and this, and what they hold weighs 5 N
    miss = lift(folder, read_overlay(folder), weak, LiftSettings()).miss
    assert miss is not None and miss.fault == "hand" and "presses with" in miss.text


def test_a_part_that_opens_as_it_is_lifted_is_the_objects_fault(tmp_path: Path) -> None:
    assert lifted(trap(tmp_path / "held", 0.1)).share == 1.0
    loose = lifted(trap(tmp_path / "loose", 0.0))
    assert loose.share == 0.0 and "object: 'hinge' goes" in loose.reason


def test_it_warns_with_columns_and_decides_nothing(tmp_path: Path) -> None:
    job = AssetJob(AssetRef(asset_id="thing", path="thing"), Path("out"), Settings(checks=("lifted",)), prior)
    bad = measure_lifted(job, block(tmp_path / "wide", 0.65, 1.0))
    assert [item.code for item in bad.findings] == ["not_lifted"] and bad.further["lifted"] == 0.0
    none = measure_lifted(job, block(tmp_path / "heavy", 0.3, 20.0))
    assert none.findings == () and none.further["lifted"] is None
