"""Joints that follow others in every engine: bound as gears are, in accord with the work that either does."""

from pathlib import Path

import numpy as np
import pytest

from schemas.vocabulary import Engine
from tests.engine_worlds import every_engine, held
from tests.origins import bar, bar_joint

pytestmark = pytest.mark.system

PUSH, SECONDS, MOMENT = 0.05, 0.5, 0.01
"""Torque on the leader, N·m, for how long, s, and the inertia of every bar about its axle, kg·m²."""


def gear(more: str) -> str:
    return bar_joint("b", "base", "follower", more=more, xyz="0.3 0 0")


CASES = {
    # name → (joint of the follower, ratio, offset, inertia that the push on the leader moves)
    "side by side": (gear('<mimic joint="a" multiplier="-2" offset="0.1"/>'), -2.0, 0.1, MOMENT * (1.0 + 4.0)),
    "one on the other": (
        # It turns by 1 - 2 = -1 of what the leader does.
        bar_joint("b", "leader", "follower", more='<mimic joint="a" multiplier="-2" offset="0.1"/>'),
        -2.0, 0.1, MOMENT * (1.0 + 1.0),
    ),
    "rack": (
        bar_joint("b", "base", "follower", kind="prismatic", more='<mimic joint="a" multiplier="0.05"/>'),
        0.05, 0.0, MOMENT + 1.0 * 0.05**2,
    ),
}  # fmt: skip


@every_engine
@pytest.mark.parametrize("case", CASES)
def test_a_follower_takes_its_share_of_the_push(tmp_path: Path, engine: Engine, case: str) -> None:
    joint, ratio, offset, inertia = CASES[case]
    parts = bar("base") + bar("leader") + bar("follower") + bar_joint("a", "base", "leader") + joint
    urdf = tmp_path / "gear.urdf"
    urdf.write_text(f'<robot name="gear">{parts}</robot>', encoding="utf-8")
    with held(engine, urdf, gravity=0.0) as world:
        order = [world.joint_names.index(name) for name in ("a", "b")]
        world.place({"a": 0.1, "b": 3.0})
        assert world.positions()[order] == pytest.approx([0.1, ratio * 0.1 + offset], abs=1e-6)
        world.kick({"a": 0.2})
        assert world.velocities()[order] == pytest.approx([0.2, ratio * 0.2], abs=1e-6)
        world.place({"a": 0.1})
        world.push({"a": PUSH})
        world.step(round(SECONDS / world.timestep_s))
        leader, follower = world.positions()[order]
        assert world.velocities()[order[0]] == pytest.approx(PUSH / inertia * SECONDS, rel=0.01)
        assert follower == pytest.approx(ratio * leader + offset, abs=2e-3)


@every_engine
def test_a_chain_of_mimics_moves_as_one(tmp_path: Path, engine: Engine) -> None:
    """The leader stands on a link that is fixed to the base, and the last of the chain on the second's link."""
    links = "".join(bar(name) for name in ("base", "plate", "one", "two", "three"))
    joints = bar_joint("weld", "base", "plate", kind="fixed") + bar_joint("a", "plate", "one")
    joints += bar_joint("b", "base", "two", xyz="0.3 0 0", more='<mimic joint="a" multiplier="-1"/>')
    joints += bar_joint("c", "two", "three", more='<mimic joint="b" multiplier="-1" offset="0.2"/>')
    urdf = tmp_path / "chain.urdf"
    urdf.write_text(f'<robot name="chain">{links}{joints}</robot>', encoding="utf-8")
    with held(engine, urdf, gravity=0.0) as world:
        order = [world.joint_names.index(name) for name in ("a", "b", "c")]
        world.place({"a": 0.1})
        assert world.positions()[order] == pytest.approx([0.1, -0.1, 0.3], abs=1e-6)
        world.push({"a": PUSH})
        world.step(round(SECONDS / world.timestep_s))
        # The third bar does not turn: it goes back by what the second turns it.
        assert np.abs(world.velocities()[order]) == pytest.approx(PUSH / (2.0 * MOMENT) * SECONDS, rel=0.01)
