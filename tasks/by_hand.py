"""The check ``used`` of what was written, where a run asks for it. It decides nothing: a joint that a hand does not
open and close is a finding."""

from functools import partial
from pathlib import Path

from asset2sim.engines.child import in_child
from schemas.finding import Finding, warning
from schemas.hand_settings import HandSettings
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import Engine, Stage
from tasks.progress import AssetJob, StageResult


def measure_used(job: AssetJob, folder: Path | None) -> StageResult:
    """How a hand opened and closed the parts of the object in ``folder``, in a child that may crash or hang; nothing
    where nothing was written. A child that died is the column ``used_reason``."""
    if folder is None:
        return StageResult()
    outcome = in_child(Engine.MUJOCO, partial(used, folder), time_limit_s=job.settings.engine.time_limit_s)
    if outcome.value is not None:
        return outcome.value
    died = warning(Stage.MEASURE, "not_used", f"a hand and it: {outcome.problem}")
    return StageResult(further={"used_reason": outcome.problem}, findings=(died,))


def used(folder: Path) -> StageResult:
    """The columns of ``used``, and a warning for each joint that a hand did not open and close."""
    from asset2sim.gym.hand.used import UsedJoint, no_task, progress, use  # loads MuJoCo

    overlay = PhysicsOverlay.model_validate_json((folder / "overlay.json").read_text(encoding="utf-8"))
    found = use(folder, overlay, HandSettings())
    failed = [item for item in found if not item.done]
    asked = [item for item in found if item.fault != "task"]

    def said(item: UsedJoint) -> Finding:
        message = f"a hand and '{item.joint}': {item.fault}: {item.reason}"
        return warning(Stage.MEASURE, "not_used", message, joint=item.joint, value=progress(item) / 2.0)

    columns: dict[str, float | str | None] = {
        "used": sum(item.done for item in asked) / len(asked) if asked else None,
        "used_joints": sum(not no_task(joint) for joint in overlay.joints),
        "used_by": "; ".join(dict.fromkeys(item.by for item in found if item.done)) or None,
        "used_reason": "; ".join(f"{item.joint}: {item.fault}: {item.reason}" for item in failed) or None,
    }
    return StageResult(further=columns, findings=tuple(said(item) for item in failed if item.fault != "task"))
