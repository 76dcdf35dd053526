"""One episode of a policy in the DROID scene: what it sees, what it does, what becomes of the object, and the film."""

import time
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Protocol

import numpy as np

from asset2sim.gym.arm.franka import Arm
from asset2sim.gym.arm.planning import SETTLE_S, ToolPlan
from asset2sim.gym.arm.scene import TIMESTEP_S
from asset2sim.gym.arm.tasks import range_of
from asset2sim.physics.arrays import Array
from lab.probes.cameras import HEIGHT, WIDTH, Cameras
from lab.probes.controller import carried_out, closed_share, commands_of
from lab.probes.observation import CONTROL_HZ, JOINTS, Observation, Picture, Policy
from lab.probes.scene import FLANGE, DroidScene, build_scene, open_commands
from lab.probes.tasks import PAPER11, ProbeTask
from lab.schemas.settings import TrialSettings
from lab.trials.film import write_mp4
from lab.trials.physical_judge import judge
from lab.trials.record import RecordedRun, Track
from lab.trials.scene import TrialScene
from lab.trials.trial import FILM, TRACK, off_bowl_m, write_track
from schemas.errors import UnknownChoiceError
from schemas.table import Row

HORIZON = 600
"""Most actions of an episode, 1/15 s each: 40 s, as DROID's evaluation has them."""
DONE_AT_REST, IDLE_AT_REST = 30, 75
"""Actions without any motion after which an episode ends, where the task is done and where it is not: what the person
who watches a real one does. The final state is then the one at the horizon too."""
REST_RAD, REST_M = 0.01, 0.001
"""How much joints and object move at most in that time to be at rest."""
FILMED_EVERY = 3
"""Actions between two pictures of the film."""


class NamedTask(Protocol):
    """A task by its name in the paper's tables."""

    @property
    def name(self) -> str:
        """Its name, as 'cabinet close'."""


def probe_task(task: NamedTask) -> ProbeTask:
    """The task itself, or the paper's of this name. Raises UnknownChoiceError."""
    if isinstance(task, ProbeTask):
        return task
    if task.name not in PAPER11:
        raise UnknownChoiceError("task", task.name, PAPER11)
    return PAPER11[task.name]


class EpisodeRun(RecordedRun):
    """A scene while a policy acts in it, and what is recorded of it."""

    def __init__(self, scene: DroidScene) -> None:
        super().__init__(scene.stage)
        self.stage: TrialScene = scene.stage
        self.scene, self.phases = scene, list[tuple[float, str]]()

    def advance(self, until_s: float, phase: str) -> None:
        """Let time pass with the servos' commands as they are."""
        self.phases.append((until_s, phase))
        while self.finite and self.steps < round(until_s / TIMESTEP_S):
            self.step()

    def track(self) -> Track:
        """The recording."""
        times, phases = zip(*self.phases, strict=True)
        plan = ToolPlan(self.stage.base, np.array(times), np.zeros((len(times), self.stage.model.nu)), tuple(phases))
        return self.samples.track(plan, self.finite)

    def tool(self) -> Array:
        """(k,) positions of the joints of arm and gripper."""
        return np.asarray(self.stage.data.qpos[self.stage.tool_places]).copy()

    def state(self) -> Array:
        """Speeds that have to be still for everything to be at rest, in units of what counts as still."""
        places = np.concatenate([pose[:3, 3] for pose in self.samples.poses[-1]])
        joints = list(self.stage.positions().values())
        return np.concatenate([self.tool()[:JOINTS] / REST_RAD, places / REST_M, np.array(joints) / REST_RAD])


def run_episode(folder: Path, task: NamedTask, seed: int, policy: Policy, to: Path | None, drawn: bool = True) -> Row:
    """Let a policy do a task with the refined object in ``folder``: columns of the table of probe trials. Recording and
    film go into ``to``; without ``drawn`` pictures are black, for a policy that sees none. What the policy raises is
    passed on, once the film is written. Raises UsageError where nothing can be drawn or the object has not the task's
    joint; LoadError, ValueError where MuJoCo refuses the object."""
    began = time.monotonic()
    scene = build_scene(folder, probe_task(task), seed)
    run, film = EpisodeRun(scene), None if to is None else Film()
    steps = 0
    try:
        with Cameras(folder, scene.stage) if drawn else nullcontext() as cameras:
            run.advance(SETTLE_S, "settle")
            steps = act(run, policy, cameras, film)
    finally:
        if to is not None and film is not None and film.pictures:
            to.mkdir(parents=True, exist_ok=True)
            write_mp4(iter(film.pictures), to / FILM, CONTROL_HZ / FILMED_EVERY)
    track = run.track()
    if to is not None:
        write_track(track, to / TRACK)
    overlay = scene.overlay
    sliders = {item.name for item in overlay.joints if item.type == "prismatic"}
    free = {item.name for item in overlay.joints if not item.holds}
    settings, carried = TrialSettings(), scene.joint is None
    judged = asdict(judge(track, scene.stage.moving_kg, sliders, free, settings, carried=carried))
    return judged | outcome(run) | {
        "task": scene.task.name, "asset_id": overlay.asset_id, "seed": seed, "instruction": scene.task.instruction,
        "steps": steps, "gripper": scene.stage.gripper.name,
        "video": None if to is None else to / FILM, "seconds_simulated": float(track.times_s[-1]),
        "seconds": time.monotonic() - began,
    }  # fmt: skip


def act(run: EpisodeRun, policy: Policy, cameras: Cameras | None, film: "Film | None") -> int:
    """Ask the policy and carry out what it answers until the horizon, or until nothing moves; how many actions."""
    gripper, states, step = run.stage.gripper, [run.state()], 0
    arm, fingers = Arm(gripper), open_commands(gripper)[JOINTS:]
    while step < HORIZON and run.finite:
        seen = seen_of(run, cameras)
        if film is not None:
            film.seen(seen)
        chunk = policy(seen)
        for action in carried_out(chunk):
            if film is not None and step % FILMED_EVERY == 0:
                film.add(*pictures_of(cameras, "exterior_left"))
            told = commands_of(action, chunk.kind, run.tool()[:JOINTS], fingers, arm)
            run.stage.data.ctrl[:], fingers = told, told[JOINTS:]
            step += 1
            run.advance(SETTLE_S + step / CONTROL_HZ, "policy")
            states.append(run.state())
            if step == HORIZON or not run.finite or at_rest(states, run):
                return step
    return step


def at_rest(states: list[Array], run: EpisodeRun) -> bool:
    """Whether nothing has moved for so long that the episode ends."""
    if len(states) <= DONE_AT_REST or np.abs(states[-1] - states[-1 - DONE_AT_REST]).max() > 1.0:
        return False
    recent = np.array(states[-1 - IDLE_AT_REST :])
    if np.ptp(recent[-1 - DONE_AT_REST :], axis=0).max() > 1.0:
        return False
    idle = len(recent) > IDLE_AT_REST and np.ptp(recent, axis=0).max() <= 1.0
    return bool(idle or outcome(run)["success"])


def seen_of(run: EpisodeRun, cameras: Cameras | None) -> Observation:
    """Observation of the policy now; its last joint is told as DROID's are."""
    left, right, wrist = pictures_of(cameras, "exterior_left", "exterior_right", "wrist")
    tool = run.tool()
    return Observation(
        left, right, wrist, tool[:JOINTS] - FLANGE, closed_share(run.stage.gripper, tool[JOINTS:]),
        run.scene.task.instruction,
    )  # fmt: skip


def pictures_of(cameras: Cameras | None, *names: str) -> list[Picture]:
    """Pictures of these cameras as everything is now; black without any."""
    if cameras is None:
        return [np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8)] * len(names)
    cameras.follow()
    return [cameras.picture(name) for name in names]


def outcome(run: EpisodeRun) -> Row:
    """How far the state is from the target, and whether that is near enough."""
    scene, stage = run.scene, run.stage
    if scene.joint is not None:
        whole = range_of(scene.joint)
        begun, end, target = scene.joint.initial_position, stage.positions()[scene.joint.name], scene.joint.closed
        distance, tolerance = abs(end - target) / whole, scene.task.epsilon(scene.joint) / whole
        reason = f"{scene.joint.name} ended at {end:.3g}, not {target:.3g}"
        done = distance <= tolerance
    else:
        assert stage.bowl is not None
        target, tolerance = 0.0, scene.task.epsilon(None)
        begun, end = (off_bowl_m(stage, poses) for poses in (run.samples.poses[0], run.samples.poses[-1]))
        distance = end
        held = bool(run.samples.felt[-1][2])
        done = distance <= tolerance and not held
        where = f"{distance:.2f} m from the middle of the bowl"
        reason = f"it ended {where}" + (", still in the hand" if held else "")
    if not run.finite:
        done, reason = False, "it flew away"
    return {
        "start": begun, "end": end, "target": target, "distance": distance, "tolerance": tolerance, "success": done,
        "outcome": "done" if done else "not done", "reason": "" if done else reason,
    }  # fmt: skip


class Film:
    """Pictures of an episode: from the left all along, and what the policy last saw from the right and the wrist."""

    def __init__(self) -> None:
        self.beside = np.zeros((HEIGHT, 2 * WIDTH, 3), dtype=np.uint8)
        self.pictures: list[Picture] = []

    def seen(self, seen: Observation) -> None:
        """Show what the policy sees."""
        self.beside = np.concatenate([seen.exterior_right, seen.wrist], axis=1)

    def add(self, picture: Picture) -> None:
        """Add a picture from the left."""
        self.pictures.append(np.concatenate([picture, self.beside], axis=1))
