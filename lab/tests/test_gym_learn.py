"""``asset2sim learn``: rows, checkpoints, curves and films of trainings; killed ones go on; cheats are found out."""

import json
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed: it comes with the extra learn")
pytest.importorskip("torch", reason="torch is not installed: it comes with the extra learn")
import mlflow
import mujoco
import torch
from stable_baselines3 import PPO

from asset2sim.catalog.own_files import OwnFile, read_own_files
from asset2sim.catalog.query import connect
from asset2sim.catalog.read import query
from asset2sim.catalog.write import write_run
from asset2sim.experiments.isolation import accept_children, stop_children
from asset2sim.gym.arm.scene import base_at
from asset2sim.gym.arm.tasks import Task, Verb
from asset2sim.gym.environment import Action, ObjectEnv
from asset2sim.gym.guards import sample_of
from flows.command import refine, run_command, serve
from lab.learning import study
from lab.learning.critic import CriticEnv, Seen
from lab.learning.lesson import PROGRESS, Lesson, Point, TrainingProgress
from lab.learning.ppo import environments, load_policy, new_model, without_noise
from lab.learning.rollouts import roll
from lab.learning.study import (
    EXPERIMENT,
    IDENTITY,
    Training,
    TrainingChoice,
    check_libraries,
    learning_study,
    trainings_of,
)
from lab.learning.training import train
from lab.runner import do_job, latest_own
from lab.schemas.settings import PpoSettings
from lab.schemas.tables import LEARNING, LEARNING_CURVES
from schemas.errors import UsageError
from schemas.learning_settings import LearningSettings
from tests.factories import make_record
from tests.prefect_server import in_use
from tests.refined_things import block, drawer
from tests.test_catalog_history import night
from tests.test_gym_environment import slider

pytestmark = pytest.mark.system
SHORT = LearningSettings(episode_s=0.4)
TINY = PpoSettings(
    environments=2, rollout=32, minibatch=32, epochs=2, hidden=(16,), checkpoint_steps=64, checkpoint_rollouts=2,
    rollouts=2,
)  # fmt: skip
CLOSE = Task("close", Verb.CLOSE)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """An output with two drawers, a block, which has no joint, and an asset that failed."""
    place = tmp_path / "out"
    place.mkdir()
    write_run(place, night(1), [make_record(name) for name in ("drawer", "broken", "block", "gone")])
    for name in ("drawer", "broken"):
        drawer(place / "assets" / name)
    block(place / "assets" / "block", 0.2, 1.0)
    return place


def lesson(folder: Path, to: Path, budget: int = 64) -> Lesson:
    return Lesson(folder, CLOSE, 0, to, SHORT, TINY, budget, 5.0, False)


@pytest.fixture
def server_in_use(prefect_server: str) -> Iterator[None]:
    with in_use(prefect_server):
        yield


@pytest.mark.usefixtures("server_in_use")
def test_the_command_writes_rows_policies_curves_a_film_and_the_page_and_trains_nothing_twice(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    monkeypatch.setattr("lab.flows.learn.TrainingChoice", partial(TrainingChoice, learning=SHORT, ppo=TINY))
    page, to = tmp_path / "page.md", tmp_path / "learnt"
    page.write_text("<!-- learn: begin (make learn) -->\n<!-- learn: end -->\n", encoding="utf-8")
    words = ["learn", str(out), "--out", str(to), "--methods", "ours", "--assets", "drawer", "--budget", "1e2"]
    words += ["--seeds", "1", "--workers", "1", "--page", str(page)]
    assert run_command(words, refine=refine, nightly=serve) == 0
    (row,) = read_own_files(to, LEARNING).to_dict("records")
    assert (row["outcome"], row["asset_id"]) == ("not learnt", "drawer")
    assert (row["steps"], row["rollouts"], row["budget"]) == (128, 2, 100) and 0.0 <= row["s"] <= 1.0
    assert (to / row["video"]).stat().st_size > 1000
    folder = (to / row["video"]).parent
    act = load_policy(folder / f"step-{row['chosen_steps']:09d}")
    assert act(np.zeros((3, 38), dtype=np.float32)).shape == (3, 7) and (folder / PROGRESS).is_file()
    curve = read_own_files(to, LEARNING_CURVES)
    assert curve["steps"].tolist() == [64, 128]
    assert "drawer" not in page.read_text(encoding="utf-8") and "| close |" in page.read_text(encoding="utf-8")
    assert b"<svg" in (tmp_path / "learning_curves.svg").read_bytes()
    client = mlflow.MlflowClient(tracking_uri=f"sqlite:///{to / 'mlflow.db'}")
    experiment = client.get_experiment_by_name(EXPERIMENT)
    assert experiment is not None
    (run,) = [item for item in client.search_runs([experiment.experiment_id]) if "s" in item.data.metrics]
    assert run.info.status == "FINISHED" and run.data.tags["outcome"] == "not learnt"
    assert [point.step for point in client.get_metric_history(run.info.run_id, "reward")] == [64, 128]
    capsys.readouterr()
    assert run_command(words, refine=refine, nightly=serve) == 0
    assert "1 of 1 trainings have ended before" in capsys.readouterr().err
    assert len(read_own_files(to, LEARNING_CURVES)) == 2
    # One that broke down after its last checkpoint has its rollouts left, and nothing to train.
    lost = dict(row) | {"outcome": "failed", "success": None, "video": None, "recorded_at": datetime.now(UTC)}
    OwnFile(to, LEARNING).add([{str(name): value for name, value in lost.items()}])
    assert run_command(words, refine=refine, nightly=serve) == 0
    assert "ended before" not in capsys.readouterr().err
    assert latest_own([to], LEARNING)["outcome"].tolist() == ["not learnt"]
    asked = "SELECT asset_id, success, reached, tilted_rad FROM learning WHERE success IS NOT NULL"
    found = query(to, asked).iloc[0]
    assert found["asset_id"] == "drawer" and found["success"] <= found["reached"] and found["tilted_rad"] >= 0.0
    with connect(to) as connection:
        assert connection.execute("SELECT count(*) FROM assets").fetchone() == (0,)
    assert set(read_own_files(to, LEARNING_CURVES)["steps"]) == {64, 128}


def test_a_training_that_is_killed_goes_on_from_its_last_checkpoint_in_the_same_run(out: Path, tmp_path: Path) -> None:
    (item,) = trainings_of(out, tmp_path / "to", TrainingChoice(assets=["drawer"], seeds=1, filmed=False))
    item = replace(item, lesson=lesson(item.lesson.folder, item.lesson.to, 192))
    heard: list[int] = []

    def kill(_: Training, point: Point) -> None:
        heard.append(point.steps)
        if point.steps == 128:
            stop_children("killed")

    accept_children("killed")
    rows = do_job(learning_study(kill), item, "killed")
    assert heard == [64, 128] and rows["learning"][0]["outcome"] == "failed" and not rows["learning_curves"]
    run = (item.lesson.to / IDENTITY).read_text(encoding="utf-8")
    accept_children("killed")
    rows = do_job(learning_study(lambda _, point: heard.append(point.steps)), item, "killed")
    (row,), points = rows["learning"], rows["learning_curves"]
    assert (item.lesson.to / IDENTITY).read_text(encoding="utf-8") == run
    assert heard == [64, 128, 192] and row["outcome"] == "not learnt"
    assert [point["steps"] for point in points] == [64, 128, 192]
    assert float(str(points[2]["seconds"])) > float(str(points[1]["seconds"]))
    assert row["steps"] == 192


def test_a_study_of_which_every_training_broke_down_is_no_success(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lab.flows.learn.in_flow", lambda name, work: work())
    (out / "assets" / "broken" / "overlay.json").write_text("{", encoding="utf-8")
    words = ["learn", str(out), "--out", str(tmp_path / "to"), "--assets", "broken", "--seeds", "1"]
    assert run_command(words, refine=refine, nightly=serve) == 1
    assert "none of 1 trainings could be done, the last: " in capsys.readouterr().err


def test_another_asset_or_setting_begins_anew_and_what_is_finished_is_not_trained(tmp_path: Path) -> None:
    folder, to = drawer(tmp_path / "thing"), tmp_path / "to"
    heard: list[int] = []
    tell = lambda point: heard.append(point.steps)  # noqa: E731
    train(lesson(folder, to), tell=tell)
    train(lesson(folder, to), tell=tell)
    assert heard == [64]
    train(lesson(folder, to, 128), tell=tell)
    assert heard == [64, 128]
    text = (folder / "overlay.json").read_text(encoding="utf-8")
    (folder / "overlay.json").write_text(json.dumps(json.loads(text) | {"contact_friction": 0.5}), encoding="utf-8")
    train(lesson(folder, to), tell=tell)
    assert heard == [64, 128, 64]


def test_cheats_are_in_the_row_and_not_a_success(tmp_path: Path) -> None:
    drifting = slider(tmp_path / "drifting", axis="0.8 0 0.6", friction=0.0)
    row, _ = train(lesson(drifting, tmp_path / "to"), tell=lambda _: None)
    assert row["s"] == pytest.approx(1.0, abs=0.1) and row["success"] == 0.0
    assert row["drifted"] == row["moved_untouched"] == row["rollouts"] == 2
    wide = slider(tmp_path / "wide", upper=20.0)
    row, points = train(lesson(wide, tmp_path / "none"), tell=lambda _: None)
    assert row["outcome"] == "solved at start" and not points and not (tmp_path / "none").exists()


def test_a_rollout_that_is_over_since_the_object_was_shoved_is_displaced_and_has_not_diverged(tmp_path: Path) -> None:
    env = ObjectEnv(slider(tmp_path / "thing", fixed=False), CLOSE, settings=SHORT, base=base_at(0.0, 0.6))

    def shove(data: Any, _: float) -> None:
        data.xfrc_applied[env.root, 0] = 60.0

    env.watched = shove
    (found,) = roll([env], lambda seen: np.zeros((len(seen), 7), dtype=np.float32), [1])
    assert found.displaced and found.travelled_m > 0.05 and not (found.diverged or found.success)
    assert env.step_number < env.steps


def test_files_that_cannot_be_read_cost_their_own_training_alone(out: Path, tmp_path: Path) -> None:
    (out / "assets" / "broken" / "overlay.json").write_text("{", encoding="utf-8")
    found = trainings_of(out, tmp_path, TrainingChoice(seeds=2, learning=SHORT, ppo=TINY))
    assert [item.lesson.folder.name for item in found] == ["broken", "broken", "drawer", "drawer"]
    row, _ = train(found[0].lesson, tell=lambda _: None)
    assert row["outcome"] == "failed" and "overlay.json is not what a run writes" in str(row["reason"])
    (out / "assets" / "drawer" / "mobility.urdf").write_text("<robot", encoding="utf-8")
    row, _ = train(found[2].lesson, tell=lambda _: None)
    assert row["outcome"] == "failed" and "mobility.urdf" in str(row["reason"])


def test_a_missing_library_is_said_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "LIBRARIES", ("numpy", "no_such_library"))
    with pytest.raises(UsageError, match=r"needs no_such_library: pip install '\./lab\[learn\]'"):
        check_libraries()


def test_a_policy_gets_better_at_reaching_the_drawer(tmp_path: Path) -> None:
    """1,024 actions, which take seconds, teach it to come near; to shut it takes some twenty times as many."""
    folder = drawer(tmp_path / "thing")
    learning = LearningSettings(episode_s=2.0, perturbed=False)
    ppo = PpoSettings(environments=4, rollout=64, minibatch=64)
    envs = environments(lambda: ObjectEnv(folder, CLOSE, settings=learning), ppo, 0)
    model, judge = new_model(envs, ppo, 0), [ObjectEnv(folder, CLOSE, settings=learning)]
    (before,) = roll(judge, without_noise(model, envs), [1])
    model.learn(1024)
    (after,) = roll(judge, without_noise(model, envs), [1])
    assert after.reward > 2.0 * before.reward


def test_the_critic_alone_sees_what_becomes_of_the_object(tmp_path: Path) -> None:
    one = ObjectEnv(slider(tmp_path / "thing", fixed=False), CLOSE, settings=SHORT)
    env, ppo = CriticEnv(one), PpoSettings(environments=1, rollout=8, minibatch=8)
    model = new_model(environments(lambda: one, ppo, 0), ppo, 0)
    seen, _ = env.reset(seed=0)
    assert seen.shape == env.observation_space.shape == (47,) and np.allclose(seen[38:41], 0.0, atol=1e-3)
    data, place = one.stage.data, one.subject.free_place
    assert place is not None
    dof = int(one.stage.model.body_dofadr[one.root])
    data.qpos[place] += 0.05
    data.qvel[dof : dof + 3] = 0.3, 0.0, 0.0
    mujoco.mj_forward(one.stage.model, data)
    one.samples.append(sample_of(data, *one.sampled))
    moved = env.with_object(seen[:38])
    assert moved[38:41] == pytest.approx([0.0, 0.0, 1.0], abs=1e-3), "5 cm of the 5 cm that it may travel"
    assert moved[44] == pytest.approx(0.3, abs=0.02), "m/s along x"
    acts, values = zip(*(answers(model, part) for part in (seen, moved)), strict=True)
    assert np.array_equal(*acts) and values[0] != values[1]


def answers(model: PPO, seen: Seen) -> tuple[Action, float]:
    """The actor's action, without noise, and the critic's value."""
    value = model.policy.predict_values(torch.from_numpy(seen[None]))
    return model.predict(seen, deterministic=True)[0], float(value.detach())


def test_the_checkpoint_of_the_highest_s_is_chosen_and_only_what_holds_ends_early() -> None:
    def point(steps: int, s: float, success: float) -> Point:
        return Point(steps=steps, seconds=1.0, s=s, success=success, reward=0.0, fps=1.0)

    points = point(1, 0.5, 0.5), point(2, 0.99, 1.0), point(3, 0.98, 0.9), point(4, 0.99, 1.0)
    progress = TrainingProgress(key="", points=points)
    assert progress.best == points[1] and not progress.held(2)
    assert TrainingProgress(key="", points=(*points, point(5, 0.95, 1.0))).held(2)


def test_the_table_has_a_number_a_seed_beside_the_papers(tmp_path: Path) -> None:
    from lab.judged.published import published_learning
    from lab.learning.show_learning import learning_block

    (tmp_path / "learning_success.csv").write_text(
        "task,asset_id,method,success_percent\nlaptop close,9912,human,0.0\nlaptop close,9912,asset2sim,100.0\n"
    )
    row = dict.fromkeys(LEARNING.schema.names) | {"task": "laptop fold", "asset_id": "9912", "outcome": "learnt"}
    row |= {"seconds": 60.0, "steps": 20_000, "solved_at_start": 0, "moved_untouched": 0, "spring_did_it": 0}
    rows = pd.DataFrame(
        [
            row | {"method": "asset2sim", "seed": 0, "success": 1.0, "drifted": 0},
            row | {"method": "asset2sim", "seed": 1, "success": 0.5, "drifted": 9},
            row | {"method": "reference", "seed": 0, "success": 0.0, "drifted": 0},
            row | {"method": "asset2sim", "asset_id": "9913", "seed": 0, "success": 0.0, "drifted": 0},
        ]
    )
    lines = learning_block(rows, published_learning(tmp_path)).splitlines()
    assert lines[2] == "| laptop fold | 0 % (20k, 1 min) | 0 % | 100, 50 % (20k, 1 min; drifted 9) | 100 % |"
    assert lines[3] == "| laptop fold |  | – | 0 % (20k, 1 min) | – |", "another object with a task of that name"
    assert lines[4] == "| mean | 0.0 % | 0.0 % | 37.5 % | 100.0 % |"
