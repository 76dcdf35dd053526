"""The environment in MuJoCo: Gymnasium's own checks, the same push as in a recorded interaction, planted cheats."""

import json
import warnings
from collections.abc import Callable
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium", reason="gymnasium is not installed: it comes with the extra gym")
pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
import gymnasium
from gymnasium.utils.env_checker import check_env

from asset2sim.gym import ENVIRONMENT, ObjectEnv, make_env, planned_action, replay
from asset2sim.gym.arm.franka import franka_spec
from asset2sim.gym.arm.paths import vertices
from asset2sim.gym.arm.scene import base_at, build_stage
from asset2sim.gym.arm.tasks import Task, Verb
from asset2sim.gym.contacts import ToolContacts
from asset2sim.gym.environment import OBSERVATION
from asset2sim.gym.subject import learned_tasks
from asset2sim.load import LoadError
from lab.trials.record import powers, record
from schemas.errors import UsageError
from schemas.learning_settings import LearningSettings
from tests.assets import ROOT, shape
from tests.doc_blocks import blocks
from tests.refined_things import BODY, FRONT, OPEN_M, Solid, block, drawer, two

pytestmark = pytest.mark.system
BASE = base_at(0.0, 0.6)
SHORT = LearningSettings(episode_s=1.0)
PAPERS = {"ends_displaced": False}


@pytest.fixture(scope="module")
def thing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return drawer(tmp_path_factory.mktemp("gym") / "thing")


def opened(folder: Path, **options: Any) -> ObjectEnv:
    env = make_env(folder, **options).unwrapped
    assert isinstance(env, ObjectEnv)
    return env


def slider(folder: Path, *, upper: float = 0.1, axis: str = "1 0 0", fixed: bool = True, **terms: float | bool) -> Path:
    """The drawer with other terms: limits, direction, support, friction, spring."""
    known: dict[str, Any] = {"friction": 2.0, "damping": 5.0, "holds": True} | terms
    return two(folder, BODY, FRONT, "prismatic", "0.112 0 0.09", axis, upper, names=("front", "slide"), start=OPEN_M,
               fixed=fixed, **known)  # fmt: skip


@pytest.mark.parametrize("action", ["tool", "joints"])
def test_gymnasium_finds_no_fault_and_no_warning(thing: Path, action: Any) -> None:
    with warnings.catch_warnings(action="error"):
        check_env(opened(thing, action=action, settings=SHORT))


def test_many_environments_of_a_process_share_one_model_and_not_their_states(thing: Path) -> None:
    envs = gymnasium.make_vec(ENVIRONMENT, num_envs=3, folder=str(thing), settings=SHORT)
    first, second, _ = (env.unwrapped for env in envs.envs)  # type: ignore[attr-defined]
    assert first.stage.model is second.stage.model and first.stage.data is not second.stage.data
    envs.reset(seed=1)
    for _ in range(13):
        seen, reward, lost, ended, info = envs.step(envs.action_space.sample())
    assert seen.shape == (3, 38) and reward.shape == (3,) and ended.all() and not lost.any()
    assert info["S"].shape == info["is_success"].shape == info["reach"].shape == (3,)
    assert not np.allclose(first.stage.data.qpos, second.stage.data.qpos)


def test_a_seed_decides_everything(thing: Path) -> None:
    env = opened(thing, settings=SHORT)

    def episode(seed: int) -> tuple[int, np.ndarray[Any, Any]]:
        seen, info = env.reset(seed=seed)
        rng = np.random.default_rng(seed)
        rows = [seen]
        for _ in range(10):
            rows.append(env.step(rng.uniform(-1, 1, 7).astype(np.float32))[0])
        return info["start"], np.array(rows)

    (one, first), (again, second) = episode(3), episode(3)
    assert one == again and (first == second).all()
    assert len({episode(seed)[0] for seed in range(12)}) > 2


def test_the_observation_is_where_and_what_its_table_says(thing: Path) -> None:
    env = opened(thing, action="joints")
    seen, _ = env.reset(options={"start": 0})
    assert sorted(index for where, _ in OBSERVATION.values() for index in range(38)[where]) == list(range(38))
    part = {name: seen[where] for name, (where, _) in OBSERVATION.items()}
    assert part["x"] == pytest.approx([OPEN_M / 0.1]) and part["x_target"] == [0.0] and part["touching"] == [0.0]
    to_world = env.stage.base[:3, :3]
    tool = to_world @ part["tool_point"] + env.stage.base[:3, 3]
    # The front of the drawer of a fixed object, 1 cm over the floor: 0.02 x 0.18 x 0.1 m about (0.172, 0, 0.1).
    half, middle = np.array([0.01, 0.09, 0.05]), np.array([0.112 + OPEN_M, 0.0, 0.1])
    nearest = np.clip(tool, middle - half, middle + half)
    assert to_world @ part["to_part"] == pytest.approx(nearest - tool, abs=1e-3)
    assert part["tool_axis"] == pytest.approx([0.0, 0.0, -1.0], abs=0.02)


def test_an_action_moves_the_tool_as_it_says(thing: Path) -> None:
    env = opened(thing, base=base_at(0.0, 0.9))
    seen, _ = env.reset(options={"start": 0})
    where = OBSERVATION["tool_point"][0]
    for _ in range(5):
        after = env.step(np.array([0, 0.5, 0, 0, 0, 0, 1], dtype=np.float32))[0]
    for _ in range(5):
        after = env.step(np.array([0, 0, 0, 0, 0, 0, 1], dtype=np.float32))[0]
    assert after[where] - seen[where] == pytest.approx([0.0, 0.06, 0.0], abs=0.006)
    assert after[OBSERVATION["opening"][0]] == pytest.approx([1.0], abs=0.01)


def test_the_same_push_moves_the_drawer_as_in_a_recorded_interaction(thing: Path) -> None:
    env = opened(thing, action="joints")
    info = replay(env)
    assert info["S"] >= 0.9 and info["is_success"] and not info["degenerate"]
    plan = env.subject.plan
    assert plan is not None
    track = record(build_stage(thing, franka_spec(), plan.base), plan, env.stage.about.positions_at())
    count = min(len(track.positions), len(env.samples))
    apart = np.abs(track.positions[:count, 0] - env.rollout().positions[:count]).max()
    assert count > 1000 and apart < 0.05 * np.ptp(track.positions[:, 0])


def test_the_power_of_the_tool_is_that_of_a_recorded_interaction_and_a_push_on_another_part_no_touch(
    thing: Path,
) -> None:
    env = opened(thing, action="joints")
    plan, found = env.subject.plan, list[tuple[bool, float, float, float]]()
    assert plan is not None and planned_action(env, plan).shape == (8,)
    other = ToolContacts(env.stage, np.array([], dtype=np.int64))
    env.reset(options={"start": 0})
    ended = False
    while not ended:
        *_, ended, _ = env.step(planned_action(env, plan))
        data = env.stage.data
        found.append((env.touch.touches(data), env.touch.power(data), powers(env.stage)[0], other.power(data)))
        assert not other.touches(data)
    touched, ours, theirs, others = (np.array(column) for column in zip(*found, strict=True))
    assert touched.any() and not touched.all() and np.abs(theirs).max() > 0.01
    assert ours == pytest.approx(theirs, rel=1e-9, abs=1e-12) and np.abs(others).max() > 0.0


def test_a_blow_that_is_over_at_the_sample_is_a_touch_and_its_work_counts_where_a_spring_could_do_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, stiffness in (("sprung", 13.0), ("free", 0.0)):
        env = opened(slider(tmp_path / name, stiffness=stiffness), base=BASE)
        env.reset(options={"start": 0})
        felt, powers = cycle([True, False]), cycle([1.0, 0.0])
        monkeypatch.setattr(env.touch, "touches", lambda _, felt=felt: next(felt))
        monkeypatch.setattr(env.touch, "power", lambda _, powers=powers: next(powers))
        env.step(np.zeros(7, dtype=np.float32))
        assert [seen.touched for seen in env.samples[1::2]] == [True] * 10
        assert sum(seen.tool_work_j for seen in env.samples) == pytest.approx(20 * 0.002 if stiffness else 0.0)


def test_an_arm_that_moves_at_random_does_not_do_it(thing: Path) -> None:
    env = opened(thing)
    for seed in range(3):
        env.reset(seed=seed)
        env.action_space.seed(seed)
        info: dict[str, Any] = {}
        ended = False
        while not ended:
            *_, ended, info = env.step(env.action_space.sample())
        assert info["S"] < 0.9 and not info["is_success"]


def test_free_objects_start_shifted_and_tilted_and_have_come_to_rest(tmp_path: Path) -> None:
    env = opened(slider(tmp_path / "thing", fixed=False), base=BASE)
    place = env.subject.free_place
    assert place is not None and len(env.subject.starts) == 9
    plain = env.reset(options={"start": 0})[1]
    at = env.stage.data.qpos[place : place + 3].copy()
    for index in range(1, 9):
        info = env.reset(options={"start": index})[1]
        moved = env.stage.data.qpos[place : place + 3] - at
        assert np.abs(moved[:2]) == pytest.approx([0.02, 0.02], abs=0.006) and abs(moved[2]) < 2e-3
        assert np.abs(env.stage.data.qvel).max() < 0.01
        assert info["position"] == plain["position"] and not info["solved_at_start"]


def test_held_objects_start_with_their_joints_moved_both_ways(thing: Path) -> None:
    env = opened(thing)
    starts = [env.reset(options={"start": index})[1]["position"] for index in range(len(env.subject.starts))]
    assert min(starts) < OPEN_M - 0.004 and max(starts) > OPEN_M + 0.004
    with pytest.raises(ValueError, match="no start 99"):
        env.reset(options={"start": 99})


def hold(env: ObjectEnv) -> dict[str, Any]:
    """Do nothing for an episode."""
    env.reset(options={"start": 0})
    while True:
        *_, lost, ended, info = env.step(np.zeros(env.action_space.shape or (), dtype=np.float32))
        if lost or ended:
            return info


def test_limits_so_wide_that_the_start_is_the_goal_are_no_success(tmp_path: Path) -> None:
    env = opened(slider(tmp_path / "thing", upper=20.0), task=Task("close", Verb.CLOSE), action="joints")
    assert env.reset(options={"start": 0})[1]["solved_at_start"]
    info = replay(env)
    assert info["S"] > 0.0 and info["solved_at_start"] and not info["is_success"]


def test_a_part_that_drifts_to_the_target_by_itself_is_no_success_and_pays_nothing(tmp_path: Path) -> None:
    folder = slider(tmp_path / "thing", axis="0.8 0 0.6", friction=0.0)
    info = hold(opened(folder, base=BASE, settings=SHORT))
    assert info["S"] > 0.9 and info["gate"] == info["joint"] == 0.0
    assert info["drifted"] and info["moved_untouched"] and not info["is_success"]


def test_a_spring_that_does_the_work_is_no_success(tmp_path: Path) -> None:
    folder = slider(tmp_path / "thing", friction=5.0, stiffness=13.0, spring_reference=-0.3)
    env = opened(folder, action="joints")
    info = replay(env)
    assert info["S"] >= 0.9 and info["spring_did_it"] and not info["is_success"]


@pytest.mark.parametrize(
    ("force_n", "torque_nm", "measure", "least"),
    [((60.0, 0.0, 0.0), (0.0, 0.0, 0.0), "travelled_m", 0.1), ((0.0, 0.0, 0.0), (0.0, -4.0, 0.0), "tilted_rad", 0.26)],
    ids=["shoved from under its drawer", "tipped until its drawer slides shut"],
)
def test_an_object_that_is_shoved_or_tipped_is_not_used(
    tmp_path: Path, force_n: tuple[float, ...], torque_nm: tuple[float, ...], measure: str, least: float
) -> None:
    folder = slider(tmp_path / "thing", fixed=False, friction=0.0, damping=0.1, holds=False)
    env = opened(folder, base=BASE, settings=SHORT.model_copy(update=PAPERS))

    def pushed_over(data: Any, _: float) -> None:
        data.xfrc_applied[env.root] = (*force_n, *torque_nm) if data.time < 0.5 else (0.0,) * 6

    env.watched = pushed_over
    info = hold(env)
    assert info["S_best"] > 0.9 and info["displaced"] and info[measure] > least and not info["is_success"]
    assert env.step_number == env.steps
    env.settings = SHORT
    info = hold(env)
    assert info["displaced"] and not info["is_success"] and env.step_number < env.steps, "it is over at once"


def test_x_follows_the_limits_as_loaded(tmp_path: Path) -> None:
    """The overlay still says 0.1 m; the URDF, which MuJoCo reads, says 0.3 m."""
    folder = slider(tmp_path / "thing", upper=0.3)
    overlay = json.loads((folder / "overlay.json").read_text(encoding="utf-8"))
    overlay["joints"][0] |= {"upper": 0.1, "open": 0.1}
    (folder / "overlay.json").write_text(json.dumps(overlay), encoding="utf-8")
    env = opened(folder, base=BASE)
    seen, _ = env.reset(options={"start": 0})
    assert seen[OBSERVATION["x"][0]] == pytest.approx([OPEN_M / 0.3])


def broken(folder: Path, name: str) -> Path:
    """The drawer with a file cut off."""
    file = drawer(folder) / name
    file.write_text(file.read_text(encoding="utf-8")[:200], encoding="utf-8")
    return folder


@pytest.mark.parametrize(("make", "task", "says"), [
    (lambda to: to / "absent", None, "overlay.json is missing"),
    (lambda to: block(to / "thing", 0.05, 0.2), None, "has no joint with limits for the task 'open'"),
    (lambda to: broken(to / "thing", "overlay.json"), None, "overlay.json is not what a run writes"),
    (lambda to: broken(to / "thing", "mobility.urdf"), None, "mobility.urdf"),
    (lambda to: drawer(to / "thing"), "fold", "has no task 'fold' that moves a joint; it has: close"),
])  # fmt: skip
def test_what_cannot_be_learned_is_said(
    tmp_path: Path, make: Callable[[Path], Path], task: str | None, says: str
) -> None:
    with pytest.raises((UsageError, LoadError), match=says):
        make_env(make(tmp_path), task)


def test_another_kind_of_action_is_said(thing: Path) -> None:
    with pytest.raises(UsageError, match="wheels"):
        opened(thing, action="wheels")


def test_a_simulation_that_diverges_ends_the_episode_and_the_next_one_is_sound(
    thing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log where it runs
    env = opened(thing, settings=SHORT)
    first, _ = env.reset(options={"start": 0})
    env.stage.data.qvel[0] = np.nan
    seen, reward, lost, _, info = env.step(np.zeros(7, dtype=np.float32))
    assert lost and reward == 0.0 and np.isfinite(seen).all() and not info["is_success"]
    assert (env.reset(options={"start": 0})[0] == first).all()
    with pytest.raises(ValueError, match="must be finite"):
        env.step(np.full(7, np.nan, dtype=np.float32))


def test_an_object_that_the_planner_cannot_move_gets_the_stated_place_of_the_base(tmp_path: Path) -> None:
    """It would be pushed 6.7 m further open."""
    env = opened(slider(tmp_path / "thing", upper=20.0), action="joints")
    assert env.subject.plan is None
    assert env.stage.base[:3, 3] == pytest.approx([0.1 + 0.45, 0.0, 0.0], abs=0.2)
    assert env.stage.base[:3, 0] == pytest.approx([-1.0, 0.0, 0.0])
    with pytest.raises(UsageError, match="a base that was planned"):
        replay(env)


def test_a_plan_is_replayed_with_joint_actions_only(thing: Path) -> None:
    with pytest.raises(UsageError, match="action='joints'"):
        replay(opened(thing))


def test_the_three_lines_of_the_documentation_run(thing: Path) -> None:
    (code,) = (block.text for block in blocks(ROOT / "docs/learn.md") if "make_env" in block.text)
    named: dict[str, Any] = {}
    exec(code.replace("data/refined/assets/laptop_silver", str(thing)), named)
    assert named["seen"].shape == (38,) and set(named["info"]) >= {"S", "reach", "gate"}


def test_the_papers_nine_have_a_task_each_that_moves_a_joint() -> None:
    tasks = learned_tasks()
    assert len(tasks) == 9 and tasks["101673"].name == "bag handle sideways" and tasks["103275"].name == "stapler press"


def test_a_part_without_ends_is_turned_and_half_a_turn_is_half_its_way(tmp_path: Path) -> None:
    bar = Solid(shape("0.02 0.2 0.03"), 0.2, 0.1)
    folder = two(tmp_path / "crank", BODY, bar, "continuous", "0.12 0 0.1", "1 0 0", None, names=("bar", "crank"),
                 start=0.2, fixed=True, lower=None, closed=0.0, open=0.0, friction=0.05, holds=True)  # fmt: skip
    env = opened(folder, base=BASE, settings=SHORT)
    subject = env.subject
    assert subject.task.verb is Verb.TURN and subject.target == pytest.approx(0.2 + np.pi / 4.0)
    env.reset(options={"start": 0})
    assert env.x == pytest.approx(0.5) and subject.share(0.2 + np.pi) == pytest.approx(1.0)

    def turned(data: Any, _: float) -> None:
        data.qpos[subject.place] = min(0.2 + 2.0 * data.time, subject.target)

    env.watched = turned
    info = hold(env)
    assert info["S"] == pytest.approx(1.0, abs=0.02) and info["moved_untouched"] and not info["is_success"]


def test_joints_start_where_a_state_says_anew_at_each_reset(thing: Path) -> None:
    env = opened(thing, base=BASE, state="random", settings=SHORT)
    upper, at = env.subject.upper, [env.reset(seed=seed)[1]["position"] for seed in range(12)]
    assert max(at) > 0.8 * upper and 0.0 < min(at) < 0.25 * upper and len(set(at)) == 12
    assert env.reset(seed=5)[1]["position"] == at[5] and not env.reset()[1]["solved_at_start"]
    assert env.reset(options={"state": {"slide": 0.5}})[1]["position"] == pytest.approx(0.5 * upper)
    assert env.reset(options={"state": "closed"})[1]["solved_at_start"]
    with pytest.raises(LoadError, match='no state "ajar"'):
        env.reset(options={"state": "ajar"})
    assert env.stage.base[2, 3] == 0.0, "a base that is given stays"


def test_what_goes_below_its_object_lifts_it_in_the_state_where_it_does(tmp_path: Path) -> None:
    env = opened(slider(tmp_path / "thing", upper=0.2, axis="0 0 -1", fixed=False), base=BASE, settings=SHORT)
    heights = []
    for state in ("closed", {"slide": 0.5}, "open"):
        env.reset(options={"state": state})
        heights.append(float(env.stage.data.xpos[env.root, 2]))
        lowest = vertices(env.stage, frozenset({env.root, env.subject.body}))[:, 2].min()
        assert lowest == pytest.approx(0.0, abs=1e-6)
    # The front's lower edge is 4 cm above the body's, and goes 0, 10 and 20 cm down.
    assert np.array(heights) - heights[0] == pytest.approx([0.0, 0.06, 0.16], abs=1e-6)


def thrown(env: ObjectEnv, data: Any) -> None:
    """The whole object is thrown up, tumbling."""
    if data.time < 0.05:
        data.qvel[env.stage.model.body_dofadr[env.root] + np.arange(6)] = (0.0, 0.0, 1.5, 0.0, -4.0, 0.0)


def coasting(env: ObjectEnv, data: Any) -> None:
    """At the first touch the part goes off by itself towards its target."""
    if sum(seen.touched for seen in env.samples) == 1:
        data.qvel[env.subject.dof] = -0.6


def rebounding(env: ObjectEnv, data: Any) -> None:
    """Once the arm has pushed the part shut and left, it comes back from its stop by itself."""
    touched = [seen.touched for seen in env.samples]
    if any(touched) and not any(touched[-50:]) and data.qpos[env.subject.place] < 2e-3:
        data.qvel[env.subject.dof] = 0.5


@pytest.mark.parametrize(
    ("cheat", "fixed", "task", "guard"),
    [(thrown, False, Verb.CLOSE, "displaced"), (coasting, True, Verb.CLOSE, "moved_untouched"),
     (rebounding, True, Verb.OPEN, "moved_untouched")],
)  # fmt: skip
def test_a_part_that_gets_there_by_a_throw_a_coast_or_a_rebound_is_no_success(
    tmp_path: Path, cheat: Callable[[ObjectEnv, Any], None], fixed: bool, task: Verb, guard: str
) -> None:
    """The arm pushes the part shut as planned; the joint has next to no friction, so that the part goes on."""
    folder = slider(tmp_path / "thing", fixed=fixed, friction=0.0, damping=0.05, holds=False)
    plan = opened(folder, action="joints").subject.plan
    assert plan is not None
    settings = LearningSettings(**PAPERS)
    env = opened(folder, task=Task("it", task), action="joints", base=plan.base, settings=settings)
    env.watched = lambda data, _: cheat(env, data)
    env.reset(options={"start": 0})
    ended = False
    while not ended:
        *_, ended, info = env.step(planned_action(env, plan))
    assert info["S_best"] > 0.9 and info[guard] and not info["is_success"]
    assert guard == "displaced" or info["untouched_share"] > 0.5
