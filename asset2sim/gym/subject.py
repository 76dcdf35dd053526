"""State that the environments of one object and task share: the compiled world, the task's numbers, and the starts."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from asset2sim.checks.reset import held_starts, perturbed_starts
from asset2sim.gym.arm.franka import HAND, JOINTS, Arm, franka_spec, waiting
from asset2sim.gym.arm.gripper import Gripper, gripper_of
from asset2sim.gym.arm.paths import vertices
from asset2sim.gym.arm.planning import FURTHEST_M, NEAREST_M, ToolPlan, moving_plan
from asset2sim.gym.arm.scene import CompiledScene, base_at, build_stage
from asset2sim.gym.arm.tasks import PAPER, Task, Verb, joint_of, target_of, tasks_of
from asset2sim.gym.world import TOOL, welded_bodies
from asset2sim.load.description import height_at
from asset2sim.physics.arrays import Array
from schemas.base import Vector3
from schemas.errors import UsageError
from schemas.learning_settings import LearningSettings
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.settings import EngineSettings

BAG = Task("bag handle sideways", Verb.LAY, "rotation_handle")
"""The task that the paper's robot learns with the bag; its arm lifts it otherwise (``PAPER``). The bag's sentence has
the handle rest on one side from the start, so it is laid to the other."""
TOOL_POINT = "tool_point"
ROOM_M = 0.45
"""Distance that the default place of the base leaves between it and the object: the waiting hand is 0.3 m before it."""
KEPT = 16
"""Objects and tasks whose worlds are kept in memory."""


@dataclass(frozen=True)
class ResetStart:
    """A start of the reset check: the object shifted (m) and tilted (rotation vector, rad), or, where its root is held,
    its joints moved by a share of their ranges, alternately one way and the other beginning with ``turn``."""

    shift: Vector3 = (0.0, 0.0, 0.0)
    tilt: Vector3 = (0.0, 0.0, 0.0)
    share: float = 0.0
    turn: int = 0


PLAIN = ResetStart()


@dataclass(frozen=True, eq=False)
class TrialSubject:
    """One object, task and place of the arm. ``stage.model`` is shared by all environments of it, ``stage.data`` is
    none's; ``lower`` and ``upper`` are the limits of the task's joint as MuJoCo loaded them (half a turn either way of
    its start where it is turned), ``target`` where it should end, rad or m; ``plan`` the scripted arm's motion, None
    where it found none or the base was given."""

    stage: CompiledScene
    task: Task
    joint: JointPhysics
    lower: float
    upper: float
    target: float
    plan: ToolPlan | None
    edge_m: float
    part_geoms: NDArray[np.int64]
    tool_geom: int
    hand: int
    arm_dofs: NDArray[np.int64]
    place: int
    dof: int
    body: int
    free_place: int | None
    starts: tuple[ResetStart, ...]
    settled: dict[tuple[int, float], tuple[Array, Array]] = field(default_factory=dict)

    def share(self, position: float) -> float:
        """A position of the joint, rad or m, as a share of its limits as loaded."""
        return (position - self.lower) / (self.upper - self.lower)

    def started_at(
        self, data: mujoco.MjData, index: int, settle_s: float, state: Mapping[str, float] | None = None
    ) -> None:
        """Set the state of one start, 0 the plain one, at rest; kept once it has been worked out. ``state`` are joint
        positions, rad or m, other than those of the plain start."""
        key = (index, settle_s)
        if state is not None:
            found = self.settle(data, PLAIN, 0.0, state)
        elif key in self.settled:
            found = self.settled[key]
        else:
            found = self.settled[key] = self.settle(data, self.starts[index], settle_s if index else 0.0)
        mujoco.mj_resetData(self.stage.model, data)
        data.qpos[:], data.qvel[:] = found
        data.ctrl[:] = waiting(self.stage.gripper)
        mujoco.mj_forward(self.stage.model, data)

    def settle(
        self, data: mujoco.MjData, start: ResetStart, settle_s: float, state: Mapping[str, float] | None = None
    ) -> tuple[Array, Array]:
        """Positions and speeds after an object was let go of in a start, its joints held, and given time; it stands as
        high over the floor in another ``state`` of its joints."""
        model, stage = self.stage.model, replace(self.stage, data=data)
        mujoco.mj_resetData(model, data)
        data.ctrl[:] = waiting(stage.gripper)
        data.qpos[stage.tool_places] = stage.ratios @ data.ctrl
        for number, joint in enumerate(stage.about.joints):
            moved = start.share * (1.0 if (number + start.turn) % 2 == 0 else -1.0)
            low, high = model.jnt_range[stage.joint(joint.name)]
            at = (state or {}).get(joint.name, joint.initial_position) + moved * min(high - low, 2.0 * math.pi)
            data.qpos[stage.place(joint.name)] = np.clip(at, low, high) if high > low and moved else at
        if self.free_place is not None and state is not None:
            about = stage.about
            data.qpos[self.free_place + 2] += height_at(about.urdf, about.root, state) - about.height_m
        mujoco.mj_kinematics(model, data)
        if self.free_place is not None and start != PLAIN:
            self.moved_off(stage, start)
        mujoco.mj_forward(model, data)
        numbers = [stage.joint(joint.name) for joint in stage.about.joints]
        places, dofs = model.jnt_qposadr[numbers], model.jnt_dofadr[numbers]
        held = data.qpos[places].copy()
        for _ in range(round(settle_s / model.opt.timestep) if self.free_place is not None else 0):
            mujoco.mj_step(model, data)
            data.qpos[places], data.qvel[dofs] = held, 0.0
        return data.qpos.copy(), data.qvel.copy()

    def moved_off(self, stage: CompiledScene, start: ResetStart) -> None:
        """Shift and tilt a free object; its lowest point is as high over the floor as before, and by the shift more."""
        assert self.free_place is not None
        bodies = frozenset(stage.bodies)
        low = float(vertices(stage, bodies)[:, 2].min())
        root = stage.data.qpos[self.free_place : self.free_place + 7]
        turn, turned, angle = np.zeros(4), np.zeros(4), float(np.linalg.norm(start.tilt))
        mujoco.mju_axisAngle2Quat(turn, np.array(start.tilt) / max(angle, 1e-12), angle)
        mujoco.mju_mulQuat(turned, turn, root[3:])
        root[3:] = turned
        root[:2] += start.shift[:2]
        mujoco.mj_kinematics(stage.model, stage.data)
        root[2] += low + max(0.0, start.shift[2]) - float(vertices(stage, bodies)[:, 2].min())


def task_to_learn(overlay: PhysicsOverlay, name: str | None = None) -> Task:
    """The task of this name, or the first of an object's that moves a joint; the bag's is ``BAG``. Where none does, the
    largest joint is opened. Raises UsageError for a name that the object's tasks have not, and without a joint."""
    known = [task for task in tasks_of(overlay) if task.verb is not Verb.GRASP]
    known = known or [learned_tasks().get(overlay.asset_id, Task("open", Verb.OPEN))]
    found = [task for task in known if name in (None, task.name)]
    if not found:
        names = ", ".join(task.name for task in known)
        raise UsageError(f"{overlay.asset_id} has no task '{name}' that moves a joint; it has: {names}")
    return found[0]


def subject_of(folder: Path, task: Task | str | None, base: Array | None, settings: LearningSettings) -> TrialSubject:
    """The shared world of a refined object and task, made once in a process and again where the files change. Raises
    UsageError where the folder has no refined object, the object no joint to move, or the gripper is not installed;
    LoadError as ``load`` does."""
    file = folder / "overlay.json"
    if not file.is_file():
        raise UsageError(f"{file} is missing: name the folder of a refined object, as OUT/assets/ID")
    try:
        overlay = PhysicsOverlay.model_validate_json(file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise UsageError(f"{file} is not what a run writes: {error}; refine the object again") from error
    chosen = task if isinstance(task, Task) else task_to_learn(overlay, task)
    joint = joint_of(chosen, overlay)
    if joint is None:
        label = f" labelled '{chosen.part}'" if chosen.part else ""
        raise UsageError(f"{folder}: {overlay.asset_id} has no joint{label} with limits for the task '{chosen.name}'")
    stamps = tuple(sorted((item.name, item.stat().st_mtime_ns) for item in folder.iterdir() if item.is_file()))
    key = None if base is None else tuple(float(value) for value in np.asarray(base, dtype=float).ravel())
    try:
        return _subject(folder.resolve(), chosen, joint, key, gripper_of(settings.gripper), settings.timestep_s, stamps)
    except (ValueError, SyntaxError, mujoco.FatalError) as error:  # a broken URDF is a SyntaxError
        said = str(error).splitlines()[0]
        raise UsageError(
            f"{folder}: mobility.urdf or its meshes are refused: {said}; refine the object again"
        ) from error


@lru_cache(maxsize=KEPT)
def _subject(
    folder: Path,
    task: Task,
    joint: JointPhysics,
    base: tuple[float, ...] | None,
    gripper: Gripper,
    timestep_s: float,
    _: tuple[tuple[str, int], ...],
) -> TrialSubject:
    plan = None
    if base is None:
        stage = build_stage(folder, franka_spec(gripper), base_at(0.0, 1.0), gripper)
        plan = moving_plan(stage, Arm(gripper), task, joint)
    own = plan.base if plan is not None else None if base is None else np.array(base).reshape(4, 4)
    stage = build_stage(folder, arm_spec(gripper), default_base(folder) if own is None else own, gripper)
    model = stage.model
    model.opt.timestep = timestep_s
    number = stage.joint(joint.name)
    low, high = (float(value) for value in model.jnt_range[number])
    if task.verb is Verb.TURN:
        low, high = joint.initial_position - math.pi, joint.initial_position + math.pi
    elif not model.jnt_limited[number] or low >= high:
        raise UsageError(f"{folder}: joint {joint.name} has no limits as MuJoCo loads it; give it some")
    bodies = welded_bodies(model, int(model.jnt_bodyid[number]))
    solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    parts = [geom for geom in range(model.ngeom) if solid[geom] and int(model.geom_bodyid[geom]) in bodies]
    if not parts:
        raise UsageError(f"{folder}: what joint {joint.name} moves has no collision shape that an arm could push")
    free = [
        int(model.jnt_qposadr[index])
        for index in range(model.njnt)
        if model.jnt_type[index] == mujoco.mjtJoint.mjJNT_FREE and model.joint(index).name.startswith(stage.prefix)
    ]
    return TrialSubject(
        stage, task, joint, low, high, float(np.clip(target_of(task, joint), low, high)), plan,
        edge_m=stage.edge_m(joint.name, vertices(stage, bodies)), part_geoms=np.array(parts),
        tool_geom=int(model.geom(TOOL + TOOL_POINT).id), hand=int(model.body(TOOL + HAND).id),
        arm_dofs=np.array([int(model.joint(TOOL + name).dofadr[0]) for name in JOINTS]),
        place=int(model.jnt_qposadr[number]), dof=int(model.jnt_dofadr[number]),
        body=int(model.jnt_bodyid[number]), free_place=free[0] if free else None,
        starts=tuple(perturbed(bool(free), EngineSettings())),
    )  # fmt: skip


def perturbed(free: bool, settings: EngineSettings) -> Iterator[ResetStart]:
    """The plain start, then those of the reset check."""
    yield PLAIN
    if free:
        yield from (ResetStart(shift, tilt) for shift, tilt in perturbed_starts(settings))
    else:
        yield from (ResetStart(share=share, turn=index // 2) for index, share in enumerate(held_starts(settings)))


def arm_spec(gripper: Gripper) -> mujoco.MjSpec:
    """The arm with a point between its finger tips, which touches nothing: distances are from it."""
    spec = franka_spec(gripper)
    spec.body(HAND).add_geom(
        name=TOOL_POINT, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(1e-4, 0.0, 0.0), pos=(0.0, 0.0, gripper.tip_m),
        contype=0, conaffinity=0, mass=0.0,
    )  # fmt: skip
    return spec


def default_base(folder: Path) -> Array:
    """(4, 4) pose of the base where the scripted arm finds no way: before the object's front (+x), as high, facing it,
    ``ROOM_M`` from its outermost point, within the distances from which the arm reaches the middle."""
    stage = build_stage(folder, None, np.eye(4))
    points = vertices(stage, frozenset(range(1, stage.model.nbody)))
    reach = math.hypot(*np.abs(points[:, :2]).max(axis=0)) if len(points) else 0.0
    return base_at(0.0, float(np.clip(reach + ROOM_M, NEAREST_M, FURTHEST_M)), stage.about)


def learned_tasks() -> dict[str, Task]:
    """Asset id → task of the paper's nine learned objects."""
    return {name: next((task for task in tasks if task.verb is not Verb.GRASP), BAG) for name, tasks in PAPER.items()}
