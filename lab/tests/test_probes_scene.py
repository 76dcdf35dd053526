"""The DROID scene: where things stand, what the cameras see, and what becomes of a policy's episode."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from asset2sim.gym.arm.gripper import PANDA
from asset2sim.gym.arm.paths import vertices
from asset2sim.gym.arm.scene import place_joints
from asset2sim.gym.arm.tasks import Verb
from lab.probes import cameras as module
from lab.probes.cameras import CAMERAS, HEIGHT, WIDTH, Cameras
from lab.probes.episode import IDLE_AT_REST, EpisodeRun, outcome, run_episode
from lab.probes.experts import Noisy, NoWayError, scripted
from lab.probes.observation import OPEN_LOOP, Chunk, Observation, Picture
from lab.probes.policies import PolicySpec, make_probe
from lab.probes.scene import FLANGE, NEAREST_M, START, build_scene, open_commands
from lab.probes.tasks import SHIFT_M, TURN_RAD, ProbeTask
from lab.tests.probe_episodes import gl_works
from lab.trials.scene import BOWL_HIGH_M, Bowl
from lab.trials.trial import FILM, TRACK
from schemas.errors import UsageError
from tests.refined_things import block, drawer

pytestmark = pytest.mark.system
drawn = pytest.mark.skipif(not gl_works(), reason="neither EGL nor OSMesa works here")
CLOSE = ProbeTask("drawer close", "thing", Verb.CLOSE, "Close it.", "It is closed.", (0.5, 0.0), np.pi, "slide", 0.6)
BOWL = Bowl((0.5, -0.2), 0.1, BOWL_HIGH_M)
LIFT = ProbeTask("block grasp", "thing", Verb.GRASP, "Lift it.", "It is lifted.", (0.5, 0.1), 0.0, bowl=BOWL)
STILL = Chunk(np.zeros((OPEN_LOOP, 8)), "joint_velocity")


@pytest.fixture
def thing(tmp_path: Path) -> Path:
    return drawer(tmp_path / "thing")


def in_base(folder: Path, task: ProbeTask, seed: int) -> np.ndarray:
    """(n, 3) points of the object in the frame of the arm's base."""
    stage = build_scene(folder, task, seed).stage
    bodies = [index for index in range(stage.model.nbody) if stage.model.body(index).name.startswith(stage.prefix)]
    return (vertices(stage, frozenset(bodies)) - stage.base[:3, 3]) @ stage.base[:3, :3]


def test_an_object_stands_where_the_task_has_it_but_for_what_the_seed_moves(tmp_path: Path) -> None:
    folder = block(tmp_path / "thing", 0.06, 0.2)
    middles = []
    for seed in range(6):
        points = in_base(folder, LIFT, seed)
        middles.append(points.mean(axis=0))
        assert np.abs(middles[-1][:2] - LIFT.at).max() <= SHIFT_M + 1e-9
        assert points[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert np.ptp(middles, axis=0)[:2].min() > 0.01
    assert in_base(folder, LIFT, 3) == pytest.approx(in_base(folder, LIFT, 3))


def test_the_seed_moves_objects_of_every_method_alike(tmp_path: Path) -> None:
    small, large = (in_base(block(tmp_path / name, edge, 0.2), LIFT, 4) for name, edge in (("a", 0.05), ("b", 0.08)))
    assert small.mean(axis=0)[:2] == pytest.approx(large.mean(axis=0)[:2])


def test_what_is_large_stands_further_ahead(tmp_path: Path) -> None:
    points = in_base(block(tmp_path / "thing", 0.6, 5.0), LIFT, 0)
    slack = SHIFT_M + 0.6 * np.sin(TURN_RAD)
    assert NEAREST_M - slack < points[:, 0].min() < NEAREST_M + slack


def test_a_joint_starts_where_the_task_says_and_the_arm_as_droids(thing: Path) -> None:
    scene = build_scene(thing, CLOSE, 0)
    assert scene.stage.positions() == {"slide": pytest.approx(0.06)}
    assert (START - FLANGE)[[1, 3, 5, 6]] == pytest.approx(np.pi * np.array([-1 / 5, -4 / 5, 3 / 5, 0.0]))
    assert scene.stage.data.qpos[scene.stage.tool_places] == pytest.approx(open_commands(PANDA))
    assert in_base(thing, CLOSE, 0)[:, 2].min() == pytest.approx(0.0, abs=1e-6), "its foot is level with the arm's"


def test_an_object_without_the_tasks_joint_is_refused_with_those_it_has(thing: Path) -> None:
    with pytest.raises(UsageError, match=r"moves lid, which is no joint of it \(it has slide\)"):
        build_scene(thing, replace(CLOSE, joint="lid"), 0)


def pictures_of(folder: Path, task: ProbeTask, names: tuple[str, ...], positions: dict[str, float]) -> list[Picture]:
    scene = build_scene(folder, task, 0)
    with Cameras(folder, scene.stage) as cameras:
        place_joints(scene.stage, positions)
        cameras.follow()
        return [cameras.picture(name) for name in names]


def colored(folder: Path, texture: bool = False) -> Path:
    """A refined cube, red; or with a face towards the arm whose upper half is red and whose lower half is blue."""
    block(folder, 0.16, 1.0)
    tree = ET.parse(folder / "mobility.urdf")
    (visual,) = tree.getroot().iter("visual")
    if not texture:
        ET.SubElement(ET.SubElement(visual, "material", name="red"), "color", rgba="1 0 0 1")
    else:
        halves = np.zeros((64, 64, 3), dtype=np.uint8)
        halves[:32, :, 0], halves[32:, :, 2] = 255, 255
        Image.fromarray(halves).save(folder / "halves.png")
        (folder / "face.mtl").write_text("newmtl halves\nKd 1 1 1\nmap_Kd halves.png\n")
        (folder / "face.obj").write_text(
            "mtllib face.mtl\nv -0.08 -0.08 0\nv -0.08 0.08 0\nv -0.08 0.08 0.16\nv -0.08 -0.08 0.16\n"
            "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl halves\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
        )
        visual[:] = []
        ET.SubElement(ET.SubElement(visual, "geometry"), "mesh", filename="face.obj")
    tree.write(folder / "mobility.urdf")
    return folder


def reddish(picture: Picture) -> NDArray[np.bool_]:
    red, green, blue = picture.astype(int).transpose(2, 0, 1)
    return np.asarray((red > 60) & (red > 2 * green) & (red > 2 * blue))


@drawn
def test_every_camera_sees_the_object_where_its_pose_and_field_of_view_put_it(tmp_path: Path) -> None:
    folder = colored(tmp_path / "thing")
    points = in_base(folder, LIFT, 0)
    for camera in CAMERAS[:2]:
        (picture,) = pictures_of(folder, LIFT, (camera.name,), {})
        assert picture.shape == (HEIGHT, WIDTH, 3) and picture.dtype == np.uint8
        seen = (points - camera.at) @ module.looking(camera)
        focal = HEIGHT / 2.0 / np.tan(np.radians(camera.vertical_deg) / 2.0)
        across, down = seen[:, :2].T * [[1.0], [-1.0]] * focal / -seen[:, 2]
        rows, columns = np.nonzero(reddish(picture))
        assert [columns.min(), columns.max()] == pytest.approx(
            WIDTH / 2.0 + np.array([across.min(), across.max()]), abs=2
        )
        assert rows.max() == pytest.approx(HEIGHT / 2.0 + down.max(), abs=2)


@drawn
def test_pictures_have_the_objects_textures_the_right_way_up(tmp_path: Path) -> None:
    folder = colored(tmp_path / "thing", texture=True)
    (picture,) = pictures_of(folder, replace(LIFT, yaw=-np.pi / 4.0), ("exterior_left",), {})
    red, blue = reddish(picture), reddish(picture[..., ::-1])
    assert min(red.sum(), blue.sum()) > 100
    assert np.nonzero(red)[0].mean() < np.nonzero(blue)[0].mean() - 5


@drawn
def test_what_moves_in_the_physics_moves_in_the_pictures(thing: Path) -> None:
    names = ("exterior_left", "wrist")
    open_left, open_wrist = pictures_of(thing, CLOSE, names, {})
    shut_left, shut_wrist = pictures_of(thing, CLOSE, names, {"slide": 0.0})
    for before, after in ((open_left, shut_left), (open_wrist, shut_wrist)):
        assert 20 < (np.abs(before.astype(int) - after) > 25).any(axis=2).sum() < HEIGHT * WIDTH / 4


def test_without_opengl_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "import_module", lambda name: (_ for _ in ()).throw(ImportError(name)))
    assert not gl_works()
    with pytest.raises(UsageError, match="apt-get install libegl1"):
        module.open_gl(16, 16)


@drawn
def test_the_expert_closes_a_drawer_and_recording_row_and_film_are_there(thing: Path, tmp_path: Path) -> None:
    asked: list[Observation] = []
    expert = scripted(thing, CLOSE, 1)

    def policy(seen: Observation) -> Chunk:
        asked.append(seen)
        return expert(seen)

    row: dict[str, Any] = run_episode(thing, CLOSE, 1, policy, tmp_path / "to")
    assert (row["outcome"], row["reason"], row["success"]) == ("done", "", True)
    assert row["start"] == pytest.approx(0.06) and row["distance"] <= row["tolerance"] == pytest.approx(0.05)
    assert not row["moved_before_contact"] and row["first_contact_s"] > 1.0
    assert -(-row["steps"] // OPEN_LOOP) == len(asked)
    assert asked[0].joints == pytest.approx(START - FLANGE, abs=5e-3) and asked[0].prompt == "Close it."
    assert asked[0].gripper == pytest.approx(0.0, abs=0.02)
    assert row["video"] == tmp_path / "to" / FILM and (tmp_path / "to" / TRACK).is_file()
    av = pytest.importorskip("av", reason="av is not installed here")
    with av.open(str(row["video"])) as file:
        shown = [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]
    assert len(shown) == -(-row["steps"] // 3) and shown[0].shape == (HEIGHT, 3 * WIDTH, 3)


def test_the_expert_lifts_a_block_into_the_bowl(tmp_path: Path) -> None:
    folder = block(tmp_path / "thing", 0.05, 0.2)
    row: dict[str, Any] = run_episode(folder, LIFT, 2, scripted(folder, LIFT, 2), None, drawn=False)
    assert (row["outcome"], row["reason"], row["video"]) == ("done", "", None)
    assert row["start"] > 0.2 > row["tolerance"] >= row["distance"]


def test_who_does_nothing_does_not_do_the_task_and_is_not_waited_for(thing: Path) -> None:
    row: dict[str, Any] = run_episode(thing, CLOSE, 0, lambda _: STILL, None, drawn=False)
    assert (row["outcome"], row["success"], row["first_contact_s"]) == ("not done", False, None)
    assert "slide ended at 0.06, not 0" in row["reason"] and row["steps"] < IDLE_AT_REST + 2 * OPEN_LOOP


def test_what_a_policy_raises_is_passed_on_and_the_film_is_kept(thing: Path, tmp_path: Path) -> None:
    chunks = iter([STILL])
    with pytest.raises(StopIteration):
        run_episode(thing, CLOSE, 0, lambda _: next(chunks), tmp_path / "to", drawn=False)
    assert (tmp_path / "to" / FILM).stat().st_size > 1000
    with pytest.raises(ValueError, match="not finite"):
        run_episode(thing, CLOSE, 0, lambda _: Chunk(np.full((8, 8), np.nan), "joint_velocity"), None, drawn=False)


def test_an_object_in_the_hand_over_the_bowl_is_not_in_it_yet(tmp_path: Path) -> None:
    folder = block(tmp_path / "thing", 0.05, 0.2)
    scene = build_scene(folder, LIFT, 0)
    root = scene.stage.model.jnt_qposadr[0]
    assert scene.stage.bowl is not None
    scene.stage.data.qpos[root : root + 2] = scene.stage.bowl.at
    place_joints(scene.stage, {})
    run = EpisodeRun(scene)
    run.samples.felt[-1] = (5.0, 0.0, 1.0, 0.0, 0.0)
    assert not outcome(run)["success"] and "still in the hand" in str(outcome(run)["reason"])
    run.samples.felt[-1] = (0.0, 0.0, 0.0, 0.0, 0.0)
    assert outcome(run)["success"]


def test_noise_is_seeded_and_leaves_the_gripper_alone() -> None:
    black = np.zeros((2, 2, 3), dtype=np.uint8)
    seen = Observation(black, black, black, np.zeros(7), 0.0, "")
    first, again, other = (Noisy(lambda _: STILL, seed)(seen).actions for seed in (1, 1, 2))
    assert (first == again).all() and (first != other).any() and (first[:, 7] == 0.0).all()
    assert 0.15 < first[:, :7].std() < 0.45


def test_what_the_arm_cannot_reach_is_said_when_the_expert_is_made(tmp_path: Path) -> None:
    folder = block(tmp_path / "thing", 0.2, 1.0)
    with pytest.raises(NoWayError, match="block grasp with thing: the arm finds no way"):
        make_probe(PolicySpec("scripted"), folder, LIFT, 0)
