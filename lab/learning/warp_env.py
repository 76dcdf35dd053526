"""Thousands of environments of one object at once, in MuJoCo Warp: model, starts and reward are ``ObjectEnv``'s."""

import logging
from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from asset2sim.gym.arm.franka import waiting
from asset2sim.gym.arm.scene import LOST_M
from asset2sim.gym.arm.tasks import Task
from asset2sim.gym.environment import DAMPED, OBSERVATION, SIZE, ObjectEnv
from asset2sim.gym.guards import displacement, is_displaced
from asset2sim.gym.reward import TERMS, reward_terms, success
from asset2sim.physics.arrays import Array
from lab.learning.critic import OBJECT, of_object
from lab.learning.warp_worlds import WarpWorlds
from schemas.learning_settings import LearningSettings

Arrays = NDArray[np.float32]

logger = logging.getLogger(__name__)


class WarpEnv(gymnasium.vector.VectorEnv[Arrays, Arrays, NDArray[Any]]):
    """``num_envs`` environments of one object, task and place of the arm, stepped together on ``device``, Warp's name
    of one (None: the first GPU, else the processor). Observations (n, 38), actions (n, 7 or 8), rewards (n,) are what
    ``ObjectEnv`` says of one. ``info`` has (n,) arrays: the terms, ``S``, ``S_best``, ``position``; and ``object``
    (n, 9), what ``CriticEnv`` shows of the object itself.

    An environment that ends begins anew in the same step: ``info["final_obs"]`` (n, 38) is what it last saw, where
    ``info["_final_obs"]`` (n,) says so. Episodes are not recorded, so no guard is asked and there is no ``is_success``:
    judge a policy with ``ObjectEnv``, whose physics are the same. Inside a part the nearest point is one of its
    surface, and not the tool's own."""

    def __init__(self, one: ObjectEnv, num_envs: int, device: str | None = None) -> None:
        """As many environments like ``one``. Raises ValueError for a shape that no refined object has."""
        self.one = one
        self.settings, self.subject, self.stage = self.one.settings, self.one.subject, self.one.stage
        self.num_envs, self.metadata = num_envs, {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}
        self.single_observation_space: spaces.Box = self.one.observation_space  # type: ignore[assignment]
        self.single_action_space = self.one.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.worlds = WarpWorlds(self.subject, num_envs, self.settings.samples_per_action, one.sample_steps, device)
        model = self.stage.model
        self.positions, self.speeds = np.zeros((num_envs, model.nq)), np.zeros((num_envs, model.nv))
        self.commands = np.tile(waiting(self.stage.gripper), (num_envs, 1))
        self.counts, self.first = np.zeros(num_envs, dtype=int), np.zeros(num_envs)
        self.best, self.crowded, self.stood = np.zeros(num_envs), False, np.zeros((num_envs, 2, 3))
        self.seen: Arrays = np.zeros((num_envs, SIZE), dtype=np.float32)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Arrays, dict[str, Any]]:
        """Begin all anew; ``options["start"]`` is the number of a start for all. One ``seed`` is of all together."""
        super().reset(seed=seed[0] if isinstance(seed, list) else seed)
        self.begin(np.ones(self.num_envs, dtype=bool), (options or {}).get("start"))
        return self.look().copy(), {"position": self.first.copy()}

    def begin(self, which: NDArray[np.bool_], start: int | None = None) -> None:
        """Put some of them (n,) at starts that are drawn, or at one, and place all as they are."""
        drawn, subject, most = self.settings.perturbed and start is None, self.subject, self.settings.arm_noise_rad
        for world in np.flatnonzero(which):
            index = int(self.np_random.integers(len(subject.starts))) if drawn else int(start or 0)
            settle_s = self.settings.settle_s
            if (index, settle_s) not in subject.settled:
                subject.started_at(self.stage.data, index, settle_s)
            self.positions[world], self.speeds[world] = subject.settled[index, settle_s]
            self.commands[world] = waiting(self.stage.gripper)
            if drawn:
                moved = self.commands[world, :7] + self.np_random.uniform(-most, most, 7)
                self.commands[world, :7] = np.clip(moved, self.one.lower, self.one.upper)
                self.positions[world, self.stage.tool_places[:7]] = self.commands[world, :7]
        self.counts[which], self.best[which] = 0, 0.0
        self.first[which] = self.positions[which, subject.place]
        self.stood[which] = self.roots()[which]
        self.worlds.place(*(part.astype(np.float32) for part in (self.positions, self.speeds, self.commands)))
        self.touched_before = which

    def step(self, actions: Arrays) -> tuple[Arrays, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Do one action of each. Raises ValueError where one is not finite."""
        if not np.isfinite(actions).all():
            raise ValueError("actions must be finite: what chooses them has diverged")
        before = self.commands
        self.commands = self.commanded(np.clip(np.asarray(actions, dtype=float), -1.0, 1.0))
        self.worlds.act(before.astype(np.float32), self.commands.astype(np.float32))
        if not self.crowded and self.worlds.overflowed():
            self.crowded = True
            logger.warning("%s: more contacts than Warp was given room for; some are left out", self.subject.task.name)
        self.touched_before = np.zeros(self.num_envs, dtype=bool)
        last = self.seen.copy()
        seen = self.look()
        self.counts += 1
        lost = ~np.isfinite(self.positions).all(axis=1) | ~np.isfinite(self.speeds).all(axis=1)
        lost |= np.abs(np.nan_to_num(self.read.tool + self.read.to_part, nan=np.inf)).max(axis=1) > LOST_M
        rewards, info = self.judged()
        rewards[lost] = 0.0
        seen[lost] = last[lost]
        info["object"] = self.object_moved()
        lost |= self.displaced()
        ended = (self.counts >= self.one.steps) & ~lost
        over = ended | lost
        if over.any():
            info |= {"final_obs": seen.copy(), "_final_obs": over}
            self.begin(over)
            # The others are where they were, but what their solver remembered has gone too.
            seen = np.where(over[:, None], self.look(), seen)
        self.seen = seen
        return seen.copy(), rewards, lost, ended, info

    def roots(self) -> Array:
        """(n, 2, 3) centres of the root links' mass, m, and up axes in their frames; zeros where roots are held."""
        place = self.subject.free_place
        if place is None:
            return np.zeros((self.num_envs, 2, 3))
        turns = Rotation.from_quat(self.positions[:, place + 3 : place + 7], scalar_first=True)
        centers = self.positions[:, place : place + 3] + turns.apply(self.stage.model.body_ipos[self.one.root])
        return np.stack([centers, turns.as_matrix()[:, 2]], axis=1)

    def displaced(self) -> NDArray[np.bool_]:
        """(n,) whether an object was tipped, lifted or shoved, which ends its episode where the settings say so."""
        if self.subject.free_place is None or not self.settings.ends_displaced:
            return np.zeros(self.num_envs, dtype=bool)
        return is_displaced(self.moved(), self.settings.guards)

    def moved(self) -> Array:
        """(n, 3) how far the objects were tilted (rad), lifted and shoved (m) since their episode began."""
        now = self.roots()
        return displacement(self.stood[:, 0], self.stood[:, 1], now[:, 0], now[:, 1])

    def object_moved(self) -> Arrays:
        """(n, 9) what ``CriticEnv`` shows of the objects themselves; zeros where roots are held."""
        place = self.subject.free_place
        if place is None:
            return np.zeros((self.num_envs, OBJECT), dtype=np.float32)
        at, dof = self.roots()[:, 0], int(self.stage.model.body_dofadr[self.one.root])
        turns = Rotation.from_quat(self.positions[:, place + 3 : place + 7], scalar_first=True)
        spin = turns.apply(self.speeds[:, dof + 3 : dof + 6])
        speed = self.speeds[:, dof : dof + 3] + np.cross(spin, at - self.positions[:, place : place + 3])
        return of_object(self.moved(), spin, speed, self.settings.guards)

    def look(self) -> Arrays:
        """(n, 38) observations of the state as it is."""
        self.read = read = self.worlds.read()
        subject, stage = self.subject, self.stage
        self.positions, self.speeds = read.positions.astype(float), read.speeds.astype(float)
        turn, origin = stage.base[:3, :3], stage.base[:3, 3]
        arm = self.positions[:, stage.tool_places[:7]]
        fingers = self.positions[:, stage.tool_places[7:]]
        self.opening = np.array([stage.gripper.opened(row) for row in fingers]) / stage.gripper.opening_m
        self.x = (self.positions[:, subject.place] - subject.lower) / (subject.upper - subject.lower)
        touched = read.touched & ~self.touched_before
        target = np.full(self.num_envs, subject.share(subject.target))
        columns = (
            arm, self.speeds[:, subject.arm_dofs], self.opening, (read.tool - origin) @ turn, read.hand[:, :, 2] @ turn,
            read.hand[:, :, 1] @ turn, read.to_part @ turn, self.x,
            self.speeds[:, subject.dof] / (subject.upper - subject.lower), target, touched, self.commands[:, :7] - arm,
        )  # fmt: skip
        high = self.single_observation_space.high
        assert len(columns) == len(OBSERVATION)
        values = np.concatenate([np.reshape(part, (self.num_envs, -1)) for part in columns], axis=1)
        self.seen = np.clip(np.nan_to_num(values).astype(np.float32), -high, high)
        return self.seen

    def judged(self) -> tuple[NDArray[Any], dict[str, Any]]:
        """(n,) rewards of the step, their terms, and S."""
        subject, settings = self.subject, self.settings.reward
        x, target = self.x[:, None], np.full((self.num_envs, 1), subject.share(subject.target))
        hand = self.read.hand[:, :, 2].astype(float)
        terms = reward_terms(
            self.read.to_part.astype(float), x, target, np.clip(self.opening, 0.0, 1.0), hand, self.one.dt_s, settings
        )
        start = (self.first[:, None] - subject.lower) / (subject.upper - subject.lower)
        done = success(x, start, target, settings)
        self.best = np.maximum(self.best, np.nan_to_num(done))
        info: dict[str, Any] = {name: getattr(terms, name) for name in TERMS}
        info |= {"S": done, "S_best": self.best.copy(), "position": self.positions[:, subject.place].copy()}
        return np.nan_to_num(terms.reward), info

    def commanded(self, actions: Array) -> Array:
        """(n, k) servo commands after actions, as ``ObjectEnv.commanded``."""
        settings, gripper = self.settings, self.stage.gripper
        now = self.positions[:, self.stage.tool_places[:7]]
        change = settings.turn_step_rad * actions[:, :7] if self.one.by_joints else self.toward(actions[:, :6])
        arm = np.clip(self.commands[:, :7] + change, now - settings.lead_rad, now + settings.lead_rad)
        arm = np.clip(arm, self.one.lower, self.one.upper)
        before = np.array([gripper.opening_of(row) for row in self.commands[:, 7:]])
        most, wanted = 2.0 * settings.finger_step_m, (actions[:, -1] + 1.0) / 2.0 * gripper.opening_m
        return np.concatenate([arm, gripper.servos(before + np.clip(wanted - before, -most, most))], axis=1)

    def toward(self, actions: Array) -> Array:
        """(n, 7) changes of the joints, rad, as ``ObjectEnv.toward``: a hinge's column is its axis times the lever."""
        settings, turn, read = self.settings, self.stage.base[:3, :3].T, self.read
        wanted = np.concatenate(
            [actions[:, :3] @ turn * settings.tool_step_m, actions[:, 3:] @ turn * settings.turn_step_rad], axis=1
        )
        axes = read.axes.astype(float)
        levers = np.cross(axes, read.tool[:, None].astype(float) - read.anchors)
        whole = np.concatenate([levers, axes], axis=2).transpose(0, 2, 1)
        inner = whole @ whole.transpose(0, 2, 1) + DAMPED**2 * np.eye(6)
        change = np.einsum("nij,ni->nj", whole, np.linalg.solve(inner, wanted[..., None])[..., 0])
        largest = np.maximum(np.abs(change).max(axis=1, keepdims=True), 1e-9)
        found: Array = change * np.minimum(1.0, 2.0 * settings.turn_step_rad / largest)
        return found


def make_warp_env(
    folder: str | Path,
    num_envs: int,
    task: Task | str | None = None,
    *,
    action: Literal["tool", "joints"] = "tool",
    settings: LearningSettings | None = None,
    base: Array | None = None,
    device: str | None = None,
) -> WarpEnv:
    """As many environments of the refined object in ``folder`` as asked for, what ``WarpEnv`` says of them; the other
    options are ``make_env``'s, which raises the same."""
    return WarpEnv(ObjectEnv(folder, task, action, settings, base), num_envs, device)
