"""One trial: plan, run, judge, film. What a child process does for one task with one refined object."""

import math
import time
from dataclasses import asdict
from pathlib import Path

import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from asset2sim.gym.arm.gripper import gripper_of
from asset2sim.gym.arm.planning import planned
from asset2sim.gym.arm.record import Track, record
from asset2sim.gym.arm.scene import Bowl
from asset2sim.gym.arm.tasks import Task, Verb, is_near, joint_of, target_of
from asset2sim.load import LoadError
from lab.schemas.trial_settings import TrialSettings
from lab.trials.film import film, write_mp4
from lab.trials.physical_judge import angle, judge, score
from schemas.learning_settings import GuardSettings
from schemas.overlay import JointPhysics, PhysicsOverlay
from schemas.table import Row

FILM, TRACK = "motion.mp4", "motion.parquet"
LIFTED_M = 0.03
"""How far an object must have been off the floor to have been lifted."""
PRESSED_SHARE = 0.2
"""Share of its way that may be left where something is pressed: springs and rubber give."""


def run_trial(folder: Path, task: Task, to: Path, filmed: bool, settings: TrialSettings) -> Row:
    """Do one task with the refined object in ``folder``; its row of the table of trials, but for what the run knows.
    The recording, and the film if asked, go into ``to``. Whatever goes wrong is an outcome."""
    began = time.monotonic()
    to.mkdir(parents=True, exist_ok=True)
    for name in (FILM, TRACK):
        (to / name).unlink(missing_ok=True)
    overlay = PhysicsOverlay.model_validate_json((folder / "overlay.json").read_text(encoding="utf-8"))
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
    track = record(attempt.stage, attempt.plan, attempt.stage.about_positions)
    write_track(track, to / TRACK)
    sliders = {item.name for item in overlay.joints if item.type == "prismatic"}
    free = {item.name for item in overlay.joints if not item.holds}
    judged = judge(track, attempt.stage.moving_kg, sliders, free, settings)
    reason = missing(track, task, joint, bowl)
    done = not reason and judged.first_contact_s is not None
    reason = reason if judged.first_contact_s is not None else "the tool never touched it"
    if filmed:
        write_mp4(film(folder, track, attempt.plan.base, bowl, attempt.stage.gripper), to / FILM)
    end = None if joint is None else float(track.positions[-1, track.joints.index(joint.name)])
    return row | asdict(judged) | {
        "tool": attempt.tool, "end": end, "score": score(judged, done, track.finite),
        "seconds_simulated": float(track.times_s[-1]),
    } | ended("done" if done else "not done", "" if done else reason, began)  # fmt: skip


def missing(track: Track, task: Task, joint: JointPhysics | None, bowl: Bowl | None) -> str:
    """Parts missing for the task to be done; empty if nothing is."""
    if not track.finite:
        return "it flew away"
    tilted = angle(track.poses[0, 0, :3, :3], track.poses[-1, 0, :3, :3])
    if task.verb is not Verb.GRASP and tilted > GuardSettings().tilt_rad:
        return f"it was tipped by {math.degrees(tilted):.0f}°"
    if joint is not None:
        path = track.positions[:, track.joints.index(joint.name)]
        target = target_of(task, joint)
        if task.verb is Verb.PRESS:
            left = float(np.abs(path - target).min()) / max(abs(joint.initial_position - target), 1e-9)
            return "" if left <= PRESSED_SHARE else f"{left:.0%} of the way was left when it was pressed"
        return (
            "" if is_near(joint, float(path[-1]), target) else f"{joint.name} ended at {path[-1]:.3g}, not {target:.3g}"
        )
    assert bowl is not None
    centers = track.poses[:, :, :3, 3].mean(axis=1)
    if float(centers[:, 2].max() - centers[0, 2]) < LIFTED_M:
        return "it was not lifted"
    if track.touched[-1]:
        return "it was not let go of"
    off = float(np.linalg.norm(centers[-1, :2] - bowl.at))
    return "" if off <= bowl.rim_m else f"it ended {off:.2f} m from the middle of the bowl"


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
