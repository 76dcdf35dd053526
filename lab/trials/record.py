"""Running a planned motion in MuJoCo, and what is recorded of it: states, the tool's contacts, forces and energy."""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from asset2sim.gym.arm.planning import ToolPlan, command
from asset2sim.gym.arm.scene import LOST_M, SAMPLE_STEPS, TIMESTEP_S, CompiledScene
from asset2sim.gym.contacts import LEAST_N, pressures
from asset2sim.physics.arrays import Array

LIMIT_ROWS = (mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT,)
CONTACT_ROWS = (mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS, mujoco.mjtConstraint.mjCNSTR_CONTACT_PYRAMIDAL,
                mujoco.mjtConstraint.mjCNSTR_CONTACT_ELLIPTIC)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Track:
    """Recording of a trial, (n,) samples. ``links`` names the object's links, whose poses in the world are
    (n, links, 4, 4); ``joints`` its joints, with (n, joints) ``positions`` and ``speeds`` (rad, m, and per second);
    ``tool`` (n, k) are the tool's. ``force_n`` is what the tool exerts on the object, ``depth_m`` how deep it is in it,
    ``touched`` whether it touches it; ``given_j`` the energy that the other contacts and the joints' stops have put
    into the object since the last sample (negative: taken), ``work_j`` what the tool has. ``finite`` is whether every
    number stayed so: the recording ends where one did not, or the object flew away."""

    times_s: Array
    phases: tuple[str, ...]
    links: tuple[str, ...]
    poses: Array
    joints: tuple[str, ...]
    positions: Array
    speeds: Array
    tool: Array
    force_n: Array
    depth_m: Array
    touched: Array
    given_j: Array
    work_j: Array
    finite: bool


def record(stage: CompiledScene, plan: ToolPlan, start: Mapping[str, float]) -> Track:
    """Run the plan with the object in its start state."""
    model, data = stage.model, stage.data
    mujoco.mj_resetData(model, data)
    for name, value in start.items():
        data.qpos[stage.place(name)] = value
    data.qpos[stage.tool_places] = stage.ratios @ command(plan, 0.0)
    data.ctrl[:] = command(plan, 0.0)
    mujoco.mj_forward(model, data)
    run = RecordedRun(stage)
    for step in range(1, round(float(plan.times_s[-1]) / TIMESTEP_S) + 1):
        data.ctrl[:] = command(plan, step * TIMESTEP_S)
        run.step()
    return run.samples.track(plan, run.finite)


class RecordedRun:
    """A scene while time passes, and what is recorded of it."""

    def __init__(self, stage: CompiledScene) -> None:
        self.stage, self.samples = stage, TrackSamples(stage)
        self.steps, self.given, self.work, self.finite = 0, 0.0, 0.0, True
        self.samples.take(stage.data, 0.0, 0.0)

    def step(self) -> None:
        """A step with the servos' commands as they are; nothing any more once a number is not finite, or the object has
        flown away."""
        if not self.finite:
            return
        data = self.stage.data
        mujoco.mj_step1(self.stage.model, data)
        mujoco.mj_step2(self.stage.model, data)
        self.steps += 1
        tool, other = powers(self.stage)
        self.work, self.given = self.work + tool * TIMESTEP_S, self.given + other * TIMESTEP_S
        if self.steps % SAMPLE_STEPS:
            return
        bad = int(data.warning.number[mujoco.mjtWarning.mjWARN_BADQACC])
        self.finite = bool(np.isfinite(data.qpos).all()) and not bad
        if self.finite:
            self.samples.take(data, self.given, self.work)
            self.given = self.work = 0.0
            self.finite = bool(np.abs(self.samples.poses[-1][:, :3, 3]).max(initial=0.0) <= LOST_M)


def powers(stage: CompiledScene) -> tuple[float, float]:
    """Power that the tool exerts on the object, and that of the object's other contacts and stops, W."""
    data, count = stage.data, int(stage.data.nefc)
    if not count:
        return 0.0, 0.0
    kind = data.efc_type[:count]
    contact = np.isin(kind, CONTACT_ROWS)
    tool = np.zeros(count, dtype=bool)
    number = data.efc_id[:count]
    geoms = data.contact.geom
    held = stage.tool_geoms[geoms[:, 0]] | stage.tool_geoms[geoms[:, 1]]
    tool[contact] = held[number[contact]]
    jacobian = data.efc_J.reshape(-1, stage.model.nv)[:count, stage.object_dofs]
    power = (jacobian @ data.qvel[stage.object_dofs]) * data.efc_force[:count]
    other = (contact & ~tool) | np.isin(kind, LIMIT_ROWS)
    return float(power[tool].sum()), float(power[other].sum())


class TrackSamples:
    """Samples recorded so far."""

    def __init__(self, stage: CompiledScene) -> None:
        self.stage = stage
        model = stage.model
        self.bodies = stage.bodies
        self.names = tuple(model.body(index).name.removeprefix(stage.prefix) for index in self.bodies)
        self.joints = tuple(joint.name for joint in stage.about.joints)
        self.places = [stage.place(name) for name in self.joints]
        self.dofs = [int(model.joint(stage.prefix + name).dofadr[0]) for name in self.joints]
        self.times: list[float] = []
        self.poses: list[Array] = []
        self.rows: list[tuple[Array, Array, Array]] = []
        self.felt: list[tuple[float, float, float, float, float]] = []

    def take(self, data: mujoco.MjData, given: float, work: float) -> None:
        """Keep the state as it is now, and the energy since the last."""
        poses = np.tile(np.eye(4), (len(self.bodies), 1, 1))
        poses[:, :3, :3] = data.xmat[self.bodies].reshape(-1, 3, 3)
        poses[:, :3, 3] = data.xpos[self.bodies]
        self.times.append(float(data.time))
        self.poses.append(poses)
        self.rows.append(
            (data.qpos[self.places].copy(), data.qvel[self.dofs].copy(), data.qpos[self.stage.tool_places].copy())
        )
        force, depth, touched = tool_force(self.stage)
        self.felt.append((force, depth, touched, given, work))

    def track(self, plan: ToolPlan, finite: bool) -> Track:
        """All of it, with the plan's phases."""
        index = np.clip(np.searchsorted(plan.times_s, np.array(self.times), side="left"), 0, len(plan.phases) - 1)
        return self.phased(tuple(plan.phases[number] for number in index), finite)

    def phased(self, phases: tuple[str, ...], finite: bool) -> Track:
        """All of it; ``phases`` is one a sample."""
        times = np.array(self.times)
        positions, speeds, tool = (np.array([row[column] for row in self.rows]) for column in range(3))
        force, depth, touched, given, work = np.array(self.felt).T
        return Track(
            times, phases, self.names, np.array(self.poses), self.joints, positions, speeds, tool, force, depth,
            touched > 0.0, given, work, finite,
        )  # fmt: skip


def tool_force(stage: CompiledScene) -> tuple[float, float, float]:
    """The force between tool and object, N, how deep the tool is in it, m, and 1 where they touch."""
    total, depth, touched = np.zeros(3), 0.0, 0.0
    for number, _, _, force in pressures(stage):
        total += force
        depth = max(depth, -float(stage.data.contact.dist[number]))
        touched = 1.0 if float(np.linalg.norm(force)) > LEAST_N else touched
    return float(np.linalg.norm(total)), depth, touched
