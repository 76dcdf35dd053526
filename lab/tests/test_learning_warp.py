"""Many environments in MuJoCo Warp are the one in MuJoCo: what they see, what they are paid, how they begin and end."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed: it comes with the extra gym")
pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
pytest.importorskip("mujoco_warp", reason="MuJoCo Warp is not installed: it comes with the extra warp")
import mujoco

from asset2sim.gym import planned_action
from asset2sim.gym.environment import OBSERVATION, ObjectEnv
from asset2sim.gym.guards import sample_of
from lab.learning import warp_worlds
from lab.learning.critic import CriticEnv
from lab.learning.warp_env import WarpEnv, make_warp_env
from lab.learning.warp_worlds import part_surfaces, surface
from lab.schemas.settings import PpoSettings, warp_settings
from schemas.errors import UsageError
from schemas.learning_settings import LearningSettings
from schemas.support import SupportKind
from tests.refined_things import drawer

pytestmark = pytest.mark.system
SHORT = LearningSettings(episode_s=0.4)


@pytest.fixture(scope="module")
def thing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return drawer(tmp_path_factory.mktemp("warp") / "thing")


def test_a_planned_push_moves_the_drawer_as_in_mujoco_and_is_paid_the_same(thing: Path) -> None:
    one = ObjectEnv(thing, action="joints")
    assert one.subject.plan is not None
    many = WarpEnv(one, 2, "cpu")
    other = ObjectEnv(thing, action="joints")
    seen, _ = many.reset(options={"start": 0})
    first, _ = other.reset(options={"start": 0})
    assert np.abs(seen - first).max() < 1e-3
    differed = []
    while True:
        action = planned_action(other, other.subject.plan)  # type: ignore[arg-type]
        # Only one of two acts: the other's drawer stays.
        wanted, paid, _, ended, info = other.step(action)
        still = np.concatenate([np.zeros(7), action[-1:]]).astype(np.float32)
        seen, rewards, lost, over, infos = many.step(np.stack([action, still]))
        if ended:
            break
        free = np.ones(38, dtype=bool)
        free[OBSERVATION["to_part"][0]] = False  # of a flat front and an edge that faces it many points are nearest
        differed.append(np.abs(seen[0] - wanted)[free].max())
        assert rewards[0] == pytest.approx(paid, abs=2e-3) and not lost.any() and not over.any()
    assert over.all() and info["S"] > 0.9
    # Single precision, and a contact that is felt some milliseconds earlier: speeds differ as it begins.
    assert np.median(differed) < 0.01
    assert infos["S"][0] == pytest.approx(info["S"], abs=0.02) and infos["S"][1] < 0.02
    assert infos["position"][0] == pytest.approx(info["position"], abs=0.02 * 0.06)


def test_contacts_without_room_are_said_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    file = drawer(tmp_path / "thing") / "overlay.json"
    file.write_text(file.read_text().replace(SupportKind.FIXED, SupportKind.FREESTANDING))  # it stands on four corners
    hold = np.zeros((1, 7), dtype=np.float32)
    for rows, said in ((warp_worlds.ROWS, []), (4, ["WARNING"])):
        monkeypatch.setattr(warp_worlds, "ROWS", rows)
        many = make_warp_env(file.parent, 1, settings=SHORT, device="cpu")
        many.reset(options={"start": 0})
        for _ in range(3):
            many.step(hold)
        assert [record.levelname for record in caplog.records] == said
    assert "left out" in caplog.text


def test_an_object_that_was_shoved_ends_its_own_episode_alone(tmp_path: Path) -> None:
    file = drawer(tmp_path / "thing") / "overlay.json"
    file.write_text(file.read_text().replace(SupportKind.FIXED, SupportKind.FREESTANDING))
    many = make_warp_env(file.parent, 2, settings=SHORT, device="cpu")
    many.reset(options={"start": 0})
    many.stood[1, 0, 0] -= 0.06
    _, _, lost, ended, info = many.step(np.zeros((2, 7), dtype=np.float32))
    assert lost.tolist() == [False, True] and not ended.any()
    assert info["object"][:, 2] == pytest.approx([0.0, 1.2], abs=0.01), "6 cm of the 5 cm that it may travel"
    assert many.object_moved()[1, 2] == pytest.approx(0.0, abs=0.01), "the next episode's"


def test_the_critic_sees_of_the_object_what_it_sees_in_mujoco(tmp_path: Path) -> None:
    file = drawer(tmp_path / "thing") / "overlay.json"
    file.write_text(file.read_text().replace(SupportKind.FIXED, SupportKind.FREESTANDING))
    one = ObjectEnv(file.parent, settings=SHORT)
    env, many = CriticEnv(one), make_warp_env(file.parent, 2, settings=SHORT, device="cpu")
    env.reset(options={"start": 0})
    many.reset(options={"start": 0})
    place, data = one.subject.free_place, one.stage.data
    assert place is not None
    turned = np.array([0.98, 0.1, 0.1, 0.1]) / np.linalg.norm([0.98, 0.1, 0.1, 0.1])
    dof = int(one.stage.model.body_dofadr[one.root])
    for positions, speeds in ((data.qpos, data.qvel), (many.positions[1], many.speeds[1])):
        positions[place : place + 3] += 0.02, 0.0, 0.01
        positions[place + 3 : place + 7] = turned
        speeds[dof : dof + 6] = 0.3, 0.1, 0.2, 0.5, -0.2, 1.0
    mujoco.mj_forward(one.stage.model, data)
    one.samples.append(sample_of(data, *one.sampled))
    wanted = env.with_object(np.zeros(38, dtype=np.float32))[38:]
    assert np.abs(wanted).min() > 1e-3 and many.object_moved()[1] == pytest.approx(wanted, abs=1e-4)


def test_what_ends_begins_anew_in_the_same_step_and_what_it_last_saw_is_kept(thing: Path) -> None:
    many = make_warp_env(thing, 3, settings=SHORT, device="cpu")
    seen, _ = many.reset(seed=1)
    again, _ = many.reset(seed=1)
    assert np.array_equal(seen, again) and many.observation_space.contains(seen)
    assert np.abs(seen[0] - seen[1]).max() > 1e-3, "each draws its own start"
    action = np.tile(np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0], dtype=np.float32), (3, 1))
    for step in range(1, 6):
        seen, _, lost, ended, info = many.step(action)
        assert not lost.any() and ended.all() == ended.any() == (step == 5)
    tool = OBSERVATION["tool_point"][0]
    fallen = info["final_obs"][:, tool][:, 2] - seen[:, tool][:, 2]
    assert (fallen < -0.05).all() and info["_final_obs"].all(), "it went down, and waits again"
    with pytest.raises(ValueError, match="finite"):
        many.step(np.full_like(action, np.nan))


def test_surfaces_are_those_of_the_shapes(thing: Path) -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body pos="1 0 0"><geom type="box" size=".1 .2 .3" pos="0 0 .5" mass="1"/>'
        '<geom type="sphere" size=".1" mass="1"/><geom type="capsule" size=".1 .2" mass="1"/>'
        '<geom type="cylinder" size=".1 .2" mass="1"/><geom type="ellipsoid" size=".1 .1 .2" mass="1"/>'
        "</body></worldbody></mujoco>"
    )
    areas = [0.88, 0.1257, 0.3770, 0.3142]
    assert [surface(model, geom).area for geom in range(4)] == pytest.approx(areas, rel=0.03)
    (found,) = part_surfaces(model, np.array([0])).items()
    assert found[0] == 1 and found[1].bounds.tolist() == pytest.approx(np.array([[-0.1, -0.2, 0.2], [0.1, 0.2, 0.8]]))
    with pytest.raises(ValueError, match="ELLIPSOID"):
        surface(model, 4)


def test_a_folder_without_an_object_is_refused_as_ever(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"overlay\.json is missing"):
        make_warp_env(tmp_path, 2)


def test_ppo_learns_from_them_and_goes_on_from_a_checkpoint(thing: Path, tmp_path: Path) -> None:
    pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed: it comes with the extra learn")
    from lab.learning.ppo import environments, load_policy, new_model, restore, save

    ppo = PpoSettings(physics="warp", environments=2, rollout=8, minibatch=8, epochs=1)
    envs = environments(lambda: ObjectEnv(thing, settings=SHORT), ppo, seed=3)
    model = new_model(envs, ppo, seed=3)
    model.learn(16)
    assert model.num_timesteps == 16 and envs.obs_rms.count > 16, "episodes of five actions ended, and began anew"
    save(model, tmp_path / "step")
    again = restore(tmp_path / "step", lambda: ObjectEnv(thing, settings=SHORT), ppo, seed=4)
    again.learn(16, reset_num_timesteps=False)
    assert again.num_timesteps == 32
    seen, _ = ObjectEnv(thing, settings=SHORT).reset(seed=0)
    assert load_policy(tmp_path / "step")(seen[None]).shape == (1, 7)


def test_settings_for_many_worlds_keep_the_batch_at_least_as_large() -> None:
    for count in (4, 64, 4096):
        found = warp_settings(count)
        batch = found.rollout * count
        assert batch >= 2048 and batch % found.minibatch == 0 and found.environments == count
    assert warp_settings(4096).rollout == 32
