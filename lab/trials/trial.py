"""One trial: plan, run, judge, film. What a child process does for one task with one refined object."""

import math
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from asset2sim.assets.authored import read_overlay
from asset2sim.gym.arm.franka import Arm, franka_spec, waiting
from asset2sim.gym.arm.gripper import PANDA, Gripper, gripper_of
from asset2sim.gym.arm.paths import ToolPath, push_paths, vertices
from asset2sim.gym.arm.planning import ABOVE, ToolPlan, moving_plan, plan_arm, runs_into, times_of
from asset2sim.gym.arm.scene import SAMPLE_STEPS, TIMESTEP_S, CompiledScene, base_at, place_joints
from asset2sim.gym.arm.tasks import Task, Verb, is_near, joint_of, range_of, target_of
from asset2sim.gym.guards import Rollout, guard
from asset2sim.gym.world import welded_bodies
from asset2sim.load import LoadError
from asset2sim.physics.arrays import Array
from lab.schemas.settings import TrialSettings
from lab.trials.film import film, write_mp4
from lab.trials.lifts import grasp_paths
from lab.trials.physical_judge import judge, score
from lab.trials.record import Track, record
from lab.trials.scene import Bowl, TrialScene, bowl_for, build_trial, pushed_stage
from schemas.learning_settings import GuardSettings
from schemas.overlay import JointPhysics
from schemas.table import Row

FILM, TRACK = "motion.mp4", "motion.parquet"
PRESSED_SHARE = 0.2
"""Share of its way that may be left where something is pressed: springs and rubber give."""


def run_trial(folder: Path, task: Task, to: Path, filmed: bool, settings: TrialSettings) -> Row:
    """Do one task with the refined object in ``folder``; its row of the table of trials, but for what the run knows.
    The recording, and the film if asked, go into ``to``. Whatever goes wrong is an outcome."""
    began = time.monotonic()
    to.mkdir(parents=True, exist_ok=True)
    for name in (FILM, TRACK):
        (to / name).unlink(missing_ok=True)
    overlay = read_overlay(folder)
    joint = joint_of(task, overlay)
    row: Row = {"task": task.name, "asset_id": overlay.asset_id, "verb": task.verb.value}
    if joint is None and task.verb is not Verb.GRASP:
        return row | failed(f"it has no joint '{task.part or 'that moves'}' to {task.verb.value}", began)
    if joint is not None:
        target = target_of(task, joint)
        row |= {"joint": joint.name, "start": joint.initial_position, "target": target}
        if is_near(joint, joint.initial_position, target):
            return row | ended("solved at start", f"{joint.name} starts where it should end", began)
    try:
        attempt, bowl = planned(folder, task, joint, gripper_of(settings.gripper))
    except (LoadError, ValueError, mujoco.FatalError) as error:
        return row | failed(f"MuJoCo refuses it: {str(error).splitlines()[0]}", began)
    if attempt is None:
        return row | ended("unreachable", "neither the arm nor the pusher finds a way that runs into nothing", began)
    track = record(attempt.stage, attempt.plan, attempt.stage.about.positions_at())
    write_track(track, to / TRACK)
    sliders = {item.name for item in overlay.joints if item.type == "prismatic"}
    free = {item.name for item in overlay.joints if not item.holds}
    judged = judge(track, attempt.stage.moving_kg, sliders, free, settings, carried=joint is None)
    reason = missing(track, task, joint, attempt.stage)
    done = not reason and judged.first_contact_s is not None
    reason = reason if judged.first_contact_s is not None else "the tool never touched it"
    if filmed:
        write_mp4(film(folder, track, attempt.plan.base, bowl, attempt.stage.gripper), to / FILM)
    end = None if joint is None else float(track.positions[-1, track.joints.index(joint.name)])
    return row | asdict(judged) | {
        "tool": attempt.tool, "end": end, "score": score(judged, done, track.finite),
        "seconds_simulated": float(track.times_s[-1]),
    } | ended("done" if done else "not done", "" if done else reason, began)  # fmt: skip


def missing(track: Track, task: Task, joint: JointPhysics | None, stage: TrialScene) -> str:
    """Parts missing for the task to be done by the arm; empty if nothing is."""
    if not track.finite:
        return "it flew away"
    if joint is None:
        return not_in_bowl(stage, track)
    path, target = track.positions[:, track.joints.index(joint.name)], target_of(task, joint)
    found = guard(track_rollout(track, stage, joint, target), GuardSettings())
    if found.displaced:
        most = f"tilted by {math.degrees(found.tilted_rad):.0f}°, lifted by {100.0 * found.lifted_m:.0f} cm"
        return f"the object itself was {most} and shoved by {100.0 * found.travelled_m:.0f} cm"
    if found.drifted or found.moved_untouched:
        return f"{joint.name} went {found.untouched_share:.0%} of its way untouched"
    if found.struck:
        return f"{joint.name} was struck: it went {found.struck_share:.0%} of its way faster than a hand"
    if found.spring_did_it:
        return f"its spring did {found.spring_share:.0%} of the work"
    if task.verb is Verb.PRESS:
        left = float(np.abs(path - target).min()) / max(abs(joint.initial_position - target), 1e-9)
        return "" if left <= PRESSED_SHARE else f"{left:.0%} of the way was left when it was pressed"
    return "" if is_near(joint, float(path[-1]), target) else f"{joint.name} ended at {path[-1]:.3g}, not {target:.3g}"


def track_rollout(track: Track, stage: TrialScene, joint: JointPhysics, target: float) -> Rollout:
    """The recording as the guards read it."""
    body = int(stage.model.jnt_bodyid[stage.joint(joint.name)])
    part = track.links.index(stage.model.body(body).name.removeprefix(stage.prefix))
    root = int(stage.model.body(stage.prefix + track.links[0]).id)
    ends = joint.initial_position - math.pi, joint.initial_position + math.pi
    lower, upper = (joint.lower, joint.upper) if range_of(joint) > 0.0 else ends
    return Rollout(
        track.positions[:, track.joints.index(joint.name)], track.touched.astype(np.bool_), track.work_j,
        middles(track.poses[:, part], stage.model.body_ipos[body])[:, 2],
        middles(track.poses[:, 0], stage.model.body_ipos[root]), track.poses[:, 0, 2, :3],
        float(lower or 0.0), float(upper or 0.0), target,
        stage.edge_m(joint.name, vertices(stage, welded_bodies(stage.model, body))), SAMPLE_STEPS * TIMESTEP_S,
        joint.stiffness, joint.spring_reference, joint.holds,
    )  # fmt: skip


def middles(poses: Array, center: Array) -> Array:
    """(n, 3) world positions of a point, m, of a link at these (n, 4, 4) poses."""
    found: Array = poses[:, :3, :3] @ center + poses[:, :3, 3]
    return found


def not_in_bowl(stage: TrialScene, track: Track) -> str:
    """Why what was to be put into the bowl is not in it; empty if it is."""
    first, *others = centers_of(stage, track.poses)
    if max(float(center[2] - first[2]) for center in others) < GuardSettings().lift_m:
        return "it was not lifted"
    off = off_bowl_m(stage, track.poses[-1])
    assert stage.bowl is not None
    where = "" if off <= stage.bowl.rim_m else f"it ended {off:.2f} m from the middle of the bowl"
    return ", ".join(filter(None, (where, "it was not let go of" if track.touched[-1] else "")))


def off_bowl_m(stage: TrialScene, poses: Array) -> float:
    """Horizontal distance of the object's centre of mass from the bowl's middle, m, with its links at these poses."""
    assert stage.bowl is not None
    return float(np.linalg.norm(centers_of(stage, poses[None])[0, :2] - stage.bowl.at))


def centers_of(stage: TrialScene, poses: Array) -> Array:
    """(n, 3) centres of mass of the object, m, with its links at these (n, links, 4, 4) poses."""
    bodies, mass = stage.bodies, stage.model.body_mass[stage.bodies]
    center = np.einsum("nbij,bj->nbi", poses[..., :3, :3], stage.model.body_ipos[bodies]) + poses[..., :3, 3]
    found: Array = np.einsum("nbi,b->ni", center, mass) / mass.sum()
    return found


def failed(reason: str, began: float) -> Row:
    """The end of a trial without a recording."""
    return ended("failed", reason, began)


def ended(outcome: str, reason: str, began: float) -> Row:
    """Outcome, reason and wall time."""
    return {"outcome": outcome, "reason": reason, "seconds": time.monotonic() - began}


def write_track(track: Track, to: Path) -> None:
    """Write a recording: a row a sample; the joints' and links' names are the lists' order, in the file's metadata."""
    lists = {"positions": track.positions, "speeds": track.speeds, "tool": track.tool,
             "poses": track.poses[:, :, :3].reshape(len(track.times_s), -1)}  # fmt: skip
    columns: dict[str, pa.Array] = {
        "time_s": pa.array(track.times_s), "phase": pa.array(track.phases), "force_n": pa.array(track.force_n),
        "depth_m": pa.array(track.depth_m), "touched": pa.array(track.touched), "given_j": pa.array(track.given_j),
        "work_j": pa.array(track.work_j),
    }  # fmt: skip
    for name, values in lists.items():
        columns[name] = pa.array(list(np.asarray(values, dtype=np.float32)), pa.list_(pa.float32()))
    table = pa.table(columns).replace_schema_metadata(
        {"joints": "\n".join(track.joints), "links": "\n".join(track.links)}
    )
    pq.write_table(table, to, compression="zstd")


@dataclass(frozen=True, eq=False)
class PlannedTrial:
    """A planned trial: the tool's name and motion, in a world of its own."""

    tool: str
    stage: TrialScene
    plan: ToolPlan


def planned(
    folder: Path, task: Task, joint: JointPhysics | None, gripper: Gripper = PANDA
) -> tuple[PlannedTrial | None, Bowl | None]:
    """A trial's tool and motion, and the bowl where it needs one; the pusher pushes where the arm finds no way."""
    arm = Arm(gripper)
    bowl = bowl_for(build_trial(folder, None, np.eye(4))) if joint is None else None
    stage = build_trial(folder, franka_spec(gripper), base_at(0.0, 1.0), bowl, gripper)
    if bowl is not None:
        place_joints(stage, stage.about.positions_at(), waiting(gripper))
        mujoco.mj_forward(stage.model, stage.data)
        plan = plan_arm(stage, arm, None, grasp_paths(stage, bowl))
    elif joint is not None:
        plan = moving_plan(stage, arm, task, joint)
    if plan is not None:
        return PlannedTrial("arm", build_trial(folder, franka_spec(gripper), plan.base, bowl, gripper), plan), bowl
    if joint is None:
        return None, bowl
    stage = pushed_stage(folder)
    place_joints(stage, stage.about.positions_at(), np.array([0.0, 0.0, 10.0]))
    mujoco.mj_forward(stage.model, stage.data)
    plan = plan_pusher(stage, joint.name, push_paths(stage, joint, target_of(task, joint), task.verb))
    return (None if plan is None else PlannedTrial("pusher", stage, plan)), None


def plan_pusher(stage: CompiledScene, joint: str, paths: Iterable[ToolPath]) -> ToolPlan | None:
    """The first way that the bare pusher can follow without running into anything; None for none."""
    for path in paths:
        top = float(vertices(stage, frozenset(range(1, stage.model.nbody)))[:, 2].max())
        first, last = ([*at[:2], max(top, at[2]) + ABOVE[2]] for at in (path.points[0], path.points[-1]))
        tools = np.array([first, first, path.points[0] + ABOVE, *path.points, path.points[-1] + ABOVE, last, last])
        phases = ("settle", "settle", "approach", *path.phases, "retreat", "retreat", "rest")
        plan = ToolPlan(np.eye(4), times_of(tools, tools, phases), tools, phases)
        if not runs_into(stage, joint, path, plan):
            return plan
    return None
