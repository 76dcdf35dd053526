"""Reach: a scripted arm moves a joint of what was written, where a run asks for that check; it decides nothing."""

from pathlib import Path

import mujoco
import numpy as np

from asset2sim.engines.child import in_child
from asset2sim.gym.arm.planning import planned
from asset2sim.gym.arm.record import record
from asset2sim.gym.arm.tasks import Task, Verb, is_near, joint_of, target_of, tasks_of
from asset2sim.load import LoadError
from lab.schemas.reached import Reached
from lab.schemas.trial_settings import TrialSettings
from lab.trials.physical_judge import judge
from schemas.finding import Finding
from schemas.overlay import PhysicsOverlay
from schemas.settings import Thresholds
from schemas.vocabulary import Engine, Severity, Stage
from tasks.progress import AssetJob, StageResult


def reach(folder: Path, limits: Thresholds) -> Reached:
    """Result of the arm with the refined object in ``folder``: its first task that moves a joint, or where it has none,
    opening the part that is furthest closed. Whatever stands against it is the reason."""
    overlay = PhysicsOverlay.model_validate_json((folder / "overlay.json").read_text(encoding="utf-8"))
    moving = (task for task in tasks_of(overlay) if task.verb is not Verb.GRASP)
    task = next(moving, Task("open", Verb.OPEN))
    joint = joint_of(task, overlay)
    if joint is None:
        return Reached(reason="it has no joint with a range to move")
    found, start, target = Reached(task=task.name, joint=joint.name), joint.initial_position, target_of(task, joint)
    if is_near(joint, start, target):
        return found.model_copy(update={"reason": "it starts where it should end"})
    try:
        attempt, _ = planned(folder, task, joint)
    except (LoadError, ValueError, mujoco.FatalError) as error:
        return found.model_copy(update={"reason": f"MuJoCo refuses it: {str(error).splitlines()[0]}"})
    if attempt is None:
        return found.model_copy(update={"reason": "neither the arm nor a bare finger finds a way to it"})
    track = record(attempt.stage, attempt.plan, attempt.stage.about_positions)
    left = np.abs(track.positions[:, track.joints.index(joint.name)] - target) / abs(start - target)
    pressed = task.verb is Verb.PRESS
    share = float(np.clip(1.0 - (left.min() if pressed else left[-1]), 0.0, 1.0)) if track.finite else 0.0
    sliders = {item.name for item in overlay.joints if item.type == "prismatic"}
    free = {item.name for item in overlay.joints if not item.holds}
    judged = judge(track, attempt.stage.moving_kg, sliders, free, TrialSettings())
    faults = {
        "it flew away": not track.finite,
        "nothing touched it": judged.first_contact_s is None,
        "it moved before it was touched": judged.moved_before_contact,
        f"it went {share:.0%} of its way": share < (limits.press_share if pressed else limits.reach_share),
        "by a bare finger: the arm finds no way": attempt.tool != "arm",
    }
    reason = "; ".join(text for text, true in faults.items() if true)
    return found.model_copy(update={"share": share, "reason": reason})


def measure_reach(job: AssetJob, folder: Path | None) -> StageResult:
    """Result of a scripted arm with the object in ``folder``, in a child of its own that may crash or hang, and a
    warning of what is amiss; nothing where nothing was written."""
    if folder is None:
        return StageResult()
    limits = job.settings.thresholds

    def tried() -> Reached:
        from lab.trials.reach_stage import reach  # loads MuJoCo, which a run without this check may not have

        return reach(folder, limits)

    outcome = in_child(Engine.MUJOCO, tried, time_limit_s=job.settings.engine.time_limit_s)
    found = outcome.value or Reached(reason=outcome.problem or "")
    if not found.reason:
        return StageResult(further=found.columns)
    nothing = outcome.value is not None and found.joint is None
    finding = Finding(
        stage=Stage.MEASURE, severity=Severity.INFO if nothing else Severity.WARNING, code="not_reachable",
        message=f"a scripted arm and '{found.task or 'it'}': {found.reason}", joint=found.joint, value=found.share,
        limit=limits.reach_share,
    )  # fmt: skip
    return StageResult(further=found.columns, findings=(finding,))
