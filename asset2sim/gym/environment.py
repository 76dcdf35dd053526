"""The environment: an arm, a refined object, the paper's reward. One object a world, many worlds a process."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import gymnasium
import mujoco
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from asset2sim.gym.arm.franka import waiting
from asset2sim.gym.arm.scene import LOST_M, SAMPLE_STEPS, TIMESTEP_S, CompiledScene
from asset2sim.gym.arm.tasks import Task, Verb
from asset2sim.gym.contacts import ToolContacts
from asset2sim.gym.guards import Rollout, displacement, guard, is_displaced, rollout_of, sample_of, solved_at_start
from asset2sim.gym.reward import TERMS, reward_terms, success
from asset2sim.gym.subject import subject_of
from asset2sim.load.description import State
from asset2sim.physics.arrays import Array
from schemas.errors import UnknownChoiceError
from schemas.learning_settings import LearningSettings

OBSERVATION = MappingProxyType(
    {
        "arm_positions": (slice(0, 7), 4.0),
        "arm_speeds": (slice(7, 14), 10.0),
        "opening": (slice(14, 15), 1.5),
        "tool_point": (slice(15, 18), 5.0),
        "tool_axis": (slice(18, 21), 1.5),
        "finger_axis": (slice(21, 24), 1.5),
        "to_part": (slice(24, 27), 10.0),
        "x": (slice(27, 28), 5.0),
        "x_speed": (slice(28, 29), 50.0),
        "x_target": (slice(29, 30), 1.5),
        "touching": (slice(30, 31), 1.0),
        "command_lead": (slice(31, 38), 1.0),
    }
)
"""Where each quantity is in the (38,) observation, and the bound at which it is cut off; units in ``ObjectEnv``."""
SIZE, DAMPED = 38, 0.05
SAMPLE_S = SAMPLE_STEPS * TIMESTEP_S
"""Time between two samples, s: as in recorded interactions."""
REDRAWN = 16
"""How often a random state is drawn again that has the part at its target."""
INSIDE_RAD = 0.02
"""How far commands stay from the joints' bounds."""
DIVERGED = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)

Action = NDArray[np.float32]


class ObjectEnv(gymnasium.Env[NDArray[np.float32], Action]):
    """An arm that learns to move one part of a refined object to a target.

    **Observation**, (38,) float32, vectors in the frame of the arm's base, ``OBSERVATION`` says where each is:
    ``arm_positions`` (7) rad and ``arm_speeds`` (7) rad/s; ``opening`` (1) of the gripper, 0 closed to 1 (0.08 m; the
    Robotiq 0.085 m); ``tool_point`` (3) between the finger tips, m; ``tool_axis`` (3) to which the fingers point and
    ``finger_axis`` (3) along which they open, unit vectors; ``to_part`` (3) from the tool point to the nearest point of
    the part, m;
    ``x`` (1) position of the part's joint as a share of its limits as loaded, ``x_speed`` (1) its change, 1/s,
    ``x_target`` (1) where it should be; ``touching`` (1) 1 where the arm touches the part; ``command_lead`` (7) by
    how much the servos' commands are ahead of the arm, rad.

    **Action**, float32 in [-1, 1]. ``tool`` (7): shift of the tool along x, y, z of the base, of 0.024 m at 1, turn
    about these axes, of 0.1 rad at 1, opening of the gripper, -1 closed to 1 open. ``joints`` (8): change of the seven
    joints' commands, of 0.1 rad at 1, and the same opening. An action lasts 0.08 s, commands change evenly over it.

    **Reward**: the paper's (``asset2sim.gym.guards``). ``info`` has each term, weights included, before Δt: ``reach``,
    ``reach_xy``, ``joint``, ``opening``, ``tilt``, ``off_xy``; the ``gate`` and ``dt_s``; ``S``, and ``position``, rad
    or m. A reset's has ``start`` (0 is the plain one) and ``solved_at_start``. The last step's has ``S_best``, what
    ``asset2sim.gym.guards`` found, ``reached``: S is at least 0.9 (a press: 0.8 at its deepest), and ``is_success``: no
    guard fires, too.

    An episode is truncated after ``episode_s``; it is terminated where the object itself is tipped, lifted or shoved
    (``ends_displaced``; not in the paper), the simulation diverges or the object flies away. ``reset(seed=…)`` draws a
    start of the reset check; ``reset(options={"start": 0})`` asks for one. ``state``, of it or
    ``reset(options={"state": …})``, has joints start as in ``asset2sim.load``: "closed", "open", "random", drawn anew
    at each reset, or {joint: share}; no links are in each other then.
    """

    def __init__(
        self,
        folder: str | Path,
        task: Task | str | None = None,
        action: Literal["tool", "joints"] = "tool",
        settings: LearningSettings | None = None,
        base: Array | None = None,
        render_mode: None = None,
        state: State = None,
    ) -> None:
        if action not in ("tool", "joints"):
            raise UnknownChoiceError("action", action, ("tool", "joints"))
        self.settings = settings or LearningSettings()
        self.subject = subject_of(Path(folder), task, base, self.settings)
        self.stage: CompiledScene = replace(self.subject.stage, data=mujoco.MjData(self.subject.stage.model))
        self.by_joints, self.state = action == "joints", state
        self.metadata, self.render_mode = {"render_modes": []}, render_mode
        self.sample_steps = round(SAMPLE_S / self.settings.timestep_s)
        self.dt_s = self.settings.samples_per_action * SAMPLE_S
        self.shares = np.linspace(0.0, 1.0, self.settings.samples_per_action + 1)[1:, None]
        self.steps = math.ceil(self.settings.episode_s / self.dt_s - 1e-9)
        high = np.zeros(SIZE, dtype=np.float32)
        for where, bound in OBSERVATION.values():
            high[where] = bound
        self.observation_space = spaces.Box(-high, high, dtype=np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (8 if self.by_joints else 7,), dtype=np.float32)
        arm = [int(self.stage.model.dof_jntid[dof]) for dof in self.subject.arm_dofs]
        self.lower, self.upper = (self.stage.model.jnt_range[arm] + (INSIDE_RAD, -INSIDE_RAD)).T
        self.command = waiting(self.stage.gripper)
        self.jacobian = np.zeros((2, 3, self.stage.model.nv))
        self.touch, self.sprung = ToolContacts(self.stage, self.subject.part_geoms), self.subject.joint.stiffness > 0.0
        self.root = int(self.stage.model.body_rootid[self.subject.body])
        self.sampled = self.subject.place, self.subject.body, self.root
        self.watched: Callable[[mujoco.MjData, float], None] | None = None
        self.begin()

    def begin(self) -> None:
        """Forget the last episode."""
        self.step_number = 0
        self.command = waiting(self.stage.gripper)
        self.samples = [sample_of(self.stage.data, *self.sampled)]
        self.done = self.best = 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin an episode. ``options["start"]`` is the number of a start; ValueError where there is no such.
        ``options["state"]`` is another of the joints; LoadError where there is no such."""
        super().reset(seed=seed)
        state = (options or {}).get("state", self.state)
        count = len(self.subject.starts)
        drawn = int(self.np_random.integers(count)) if self.settings.perturbed and state is None else 0
        index = int((options or {}).get("start", drawn))
        if not 0 <= index < count:
            raise ValueError(f"there is no start {index}: they are 0 to {count - 1}")
        positions = None if state is None else self.positions_of(state)
        self.subject.started_at(self.stage.data, index, self.settings.settle_s, positions)
        self.begin()
        if self.settings.perturbed and "start" not in (options or {}):
            self.shift_arm()
        first, subject = self.samples[0].position, self.subject
        solved = solved_at_start(first, subject.target, subject.lower, subject.upper, self.settings.guards)
        self.last = self.observe()
        return self.last.copy(), {"start": index, "solved_at_start": solved, "position": first}

    def positions_of(self, state: State) -> dict[str, float]:
        """Joint → position in a state; a random one is drawn again where nothing would be left to do."""
        subject = self.subject
        for _ in range(REDRAWN):
            found = subject.stage.about.positions_at(state, int(self.np_random.integers(2**31)))
            at, guards = found[subject.joint.name], self.settings.guards
            if not solved_at_start(at, subject.target, subject.lower, subject.upper, guards):
                break
        return found

    def shift_arm(self) -> None:
        """Let the arm wait a little beside where it waits."""
        most, data = self.settings.arm_noise_rad, self.stage.data
        self.command[:7] = np.clip(self.command[:7] + self.np_random.uniform(-most, most, 7), self.lower, self.upper)
        data.qpos[self.stage.tool_places[:7]] = data.ctrl[:7] = self.command[:7]
        mujoco.mj_forward(self.stage.model, data)

    def step(self, action: Action) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Do one action of ``dt_s`` seconds. Raises ValueError where it is not finite."""
        if not np.isfinite(action).all():
            raise ValueError(f"an action must be finite, not {action}: what chooses it has diverged")
        before, data = self.command, self.stage.data
        self.command = self.commanded(np.clip(np.asarray(action, dtype=float), -1.0, 1.0))
        for servos in before + self.shares * (self.command - before):
            data.ctrl[:] = servos
            touched, work = False, 0.0
            for _ in range(self.sample_steps):
                mujoco.mj_step(self.stage.model, data)
                touched = touched or self.touch.touches(data)  # a blow may be over before the sample
                if self.sprung:
                    work += self.touch.power(data) * self.settings.timestep_s
            self.samples.append(sample_of(data, *self.sampled, touched=touched, work_j=work))
            if self.watched is not None:
                self.watched(data, work)
        self.step_number += 1
        if self.lost():
            return self.last.copy(), 0.0, True, False, {"S": 0.0, "diverged": True, "is_success": False}
        self.last = self.observe()
        reward, info = self.judged()
        failed = self.settings.ends_displaced and bool(is_displaced(self.displaced(), self.settings.guards)[0])
        ended = self.step_number >= self.steps
        if ended or failed:
            info |= self.ending()
        return self.last.copy(), reward, failed, ended and not failed, info

    def commanded(self, action: Array) -> Array:
        """Servo commands after an action: within the joints' limits and not far ahead of the arm."""
        now = self.stage.data.qpos[self.stage.tool_places[:7]]
        change = self.settings.turn_step_rad * action[:7] if self.by_joints else self.toward(action[:6])
        arm = np.clip(self.command[:7] + change, now - self.settings.lead_rad, now + self.settings.lead_rad)
        arm = np.clip(arm, self.lower, self.upper)
        gripper, most = self.stage.gripper, 2.0 * self.settings.finger_step_m
        before = gripper.opening_of(self.command[7:])
        wanted = (float(action[-1]) + 1.0) / 2.0 * gripper.opening_m
        opening = np.array([before + np.clip(wanted - before, -most, most)])
        return np.concatenate([arm, gripper.servos(opening)[0]])

    def toward(self, action: Array) -> Array:
        """(7,) change of the joints, rad, that shifts and turns the tool as asked, by damped least squares."""
        turn = self.stage.base[:3, :3]
        wanted = np.concatenate(
            [turn @ action[:3] * self.settings.tool_step_m, turn @ action[3:] * self.settings.turn_step_rad]
        )
        model, data = self.stage.model, self.stage.data
        mujoco.mj_jac(model, data, *self.jacobian, data.geom_xpos[self.subject.tool_geom], self.subject.hand)
        whole = self.jacobian.reshape(6, -1)[:, self.subject.arm_dofs]
        change: Array = whole.T @ np.linalg.solve(whole @ whole.T + DAMPED**2 * np.eye(6), wanted)
        return change * min(1.0, 2.0 * self.settings.turn_step_rad / max(float(np.abs(change).max()), 1e-9))

    def to_part(self) -> Array:
        """(3,) from the tool point to the nearest point of the part, m, world."""
        model, data = self.stage.model, self.stage.data
        best, found, ends = 10.0, np.zeros(3), np.zeros(6)
        tool = data.geom_xpos[self.subject.tool_geom]
        near = np.linalg.norm(data.geom_xpos[self.subject.part_geoms] - tool, axis=1)
        near -= model.geom_rbound[self.subject.part_geoms]
        for index in np.argsort(near):
            if near[index] > best:
                break
            geom = int(self.subject.part_geoms[index])
            away = mujoco.mj_geomDistance(model, data, self.subject.tool_geom, geom, best, ends)
            if away < best:
                best, found = away, ends[3:] - ends[:3] if away > 0.0 else np.zeros(3)
        return found

    def observe(self) -> NDArray[np.float32]:
        """The (38,) observation of the state as it is."""
        stage, data, subject = self.stage, self.stage.data, self.subject
        mujoco.mj_kinematics(stage.model, data)
        mujoco.mj_comPos(stage.model, data)
        turn, origin = stage.base[:3, :3].T, stage.base[:3, 3]
        self.axes = data.xmat[subject.hand].reshape(3, 3)
        self.vector = self.to_part()
        arm = data.qpos[stage.tool_places[:7]]
        self.x = subject.share(float(data.qpos[subject.place]))
        self.opening = stage.gripper.opened(data.qpos[stage.tool_places[7:]]) / stage.gripper.opening_m
        values = np.concatenate([
            arm, data.qvel[subject.arm_dofs], [self.opening],
            turn @ (data.geom_xpos[subject.tool_geom] - origin), turn @ self.axes[:, 2], turn @ self.axes[:, 1],
            turn @ self.vector, [self.x, data.qvel[subject.dof] / (subject.upper - subject.lower)],
            [subject.share(subject.target), float(self.samples[-1].touched)], self.command[:7] - arm,
        ])  # fmt: skip
        high = self.observation_space.high  # type: ignore[attr-defined]
        found: NDArray[np.float32] = np.clip(values.astype(np.float32), -high, high)
        return found

    def judged(self) -> tuple[float, dict[str, Any]]:
        """Reward of the step, its terms, and S."""
        subject, settings = self.subject, self.settings.reward
        x, target = np.array([[self.x]]), np.array([[subject.share(subject.target)]])
        terms = reward_terms(
            self.vector[None], x, target, np.array([min(max(self.opening, 0.0), 1.0)]), self.axes[:, 2][None],
            self.dt_s, settings,
        )  # fmt: skip
        start = np.array([[subject.share(self.samples[0].position)]])
        self.done = float(success(x, start, target, settings)[0])
        self.best = max(self.best, self.done)
        info: dict[str, Any] = {name: float(getattr(terms, name)[0]) for name in TERMS}
        info |= {"dt_s": self.dt_s, "S": self.done, "position": self.samples[-1].position}
        return float(terms.reward[0]), info

    def ending(self) -> dict[str, Any]:
        """Further entries of the last step's info: success and guards."""
        limits = self.settings.guards
        found = guard(self.rollout(), limits)
        pressed = self.subject.task.verb is Verb.PRESS
        done = self.best >= limits.pressed if pressed else self.done >= limits.success
        return {"is_success": done and not found.degenerate, "reached": done, "S_best": self.best, **found.info()}

    def displaced(self) -> Array:
        """(1, 3) tilt, rad, lift and travel, m, of the object itself by now."""
        first, last = self.samples[0], self.samples[-1]
        return displacement(first.center, first.up, last.center[None], last.up[None])

    def rollout(self) -> Rollout:
        """Recording of the episode so far, a sample every 4 ms."""
        subject = self.subject
        joint, ends = subject.joint, (subject.lower, subject.upper)
        return rollout_of(self.samples, joint, ends, subject.target, subject.edge_m, SAMPLE_S, holds=joint.holds)

    def lost(self) -> bool:
        """Whether the simulation diverged or the object flew away."""
        data = self.stage.data
        if not np.isfinite(data.qpos).all() or any(data.warning.number[kind] for kind in DIVERGED):
            return True
        return bool(np.abs(data.geom_xpos[self.subject.part_geoms]).max() > LOST_M)
