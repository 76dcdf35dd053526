"""Random sweeps with a closed gripper: they bring joints to their targets, as the object tips or travels, and count as
no success."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed: it comes with the extra learn")
pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.gym import ObjectEnv, make_env
from schemas.learning_settings import LearningSettings
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, prior, sample

pytestmark = pytest.mark.system
AROUND_M, NEAR_M, MOST_ACTIONS = 0.1, 0.04, 25
"""How far beside the object sweeps begin and end, m; from where one is done, m; and its longest."""


def swept(env: ObjectEnv, rng: np.random.Generator) -> dict[str, bool]:
    """How an episode ends in which the closed gripper goes in straight lines to random places in and about the
    object: whether the joint gets to its target, and whether that counts."""
    env.reset(seed=int(rng.integers(2**31)))
    model, data = env.stage.model, env.stage.data
    middles = data.geom_xpos[model.body_rootid[model.geom_bodyid] == env.root]
    low, high = middles.min(axis=0) - AROUND_M, middles.max(axis=0) + AROUND_M
    goal, left = rng.uniform(low, high), MOST_ACTIONS
    while True:
        off = goal - data.geom_xpos[env.subject.tool_geom]
        if np.linalg.norm(off) < NEAR_M or not left:
            goal, left = rng.uniform(low, high), MOST_ACTIONS
        shift = env.stage.base[:3, :3].T @ off / env.settings.tool_step_m
        action = [*shift / max(1.0, float(np.abs(shift).max())), 0.0, 0.0, 0.0, -1.0]
        *_, lost, ended, info = env.step(np.array(action, dtype=np.float32))
        left -= 1
        if lost or ended:
            return {"reached": bool(info.get("reached")), "counted": bool(info["is_success"])}


@pytest.mark.parametrize(
    ("asset_id", "seed", "seconds", "episodes", "least"),
    [("box_wooden", 1, 5.0, 40, 0.5), ("box_chest", 0, 10.0, 6, 0.5), ("bucket_yellow", 0, 10.0, 18, 0.1)],
)
def test_random_sweeps_reach_the_target_and_do_not_count(
    asset_id: str, seed: int, seconds: float, episodes: int, least: float, tmp_path: Path
) -> None:
    """Short ones end before the object lies elsewhere. Of the first 40, two are refused for the strike that shuts the
    lid alone, nine for the box that lies elsewhere alone, one for the lid that moves untouched alone."""
    refine_asset(sample(asset_id), tmp_path, NO_VIEWS, prior)
    settings, rng = LearningSettings(ends_displaced=False, episode_s=seconds), np.random.default_rng(seed)
    env = make_env(tmp_path / "assets" / asset_id, settings=settings).unwrapped
    assert isinstance(env, ObjectEnv)
    found = [swept(env, rng) for _ in range(episodes)]
    assert sum(one["reached"] for one in found) >= least * episodes, "the sweeps did nothing that could be counted"
    assert not any(one["counted"] for one in found), "one of these is over 1 %"
