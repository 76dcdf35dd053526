"""The checks ``used``, ``contents`` and ``lifted``, where a run asks for them; what fails is a finding alone."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from asset2sim.assets.authored import read_overlay
from asset2sim.engines.child import in_child
from schemas.finding import Finding, warning
from schemas.hand_settings import ContentSettings, HandSettings, LiftSettings
from schemas.vocabulary import Engine, Stage
from tasks.progress import AssetJob, StageResult


def measure_in_child(
    job: AssetJob, folder: Path | None, check: Callable[[Path], StageResult], code: str
) -> StageResult:
    """A check of the object in ``folder``, in a child that may crash or hang; nothing where nothing was written. Of a
    child that died the reason stands in the check's column of reasons and in a finding of this code."""
    if folder is None:
        return StageResult()
    outcome = in_child(Engine.MUJOCO, partial(check, folder), time_limit_s=job.settings.engine.time_limit_s)
    if outcome.value is not None:
        return outcome.value
    died = warning(Stage.MEASURE, code, f"a hand and it: {outcome.problem}")
    return StageResult(further={f"{check.__name__}_reason": outcome.problem}, findings=(died,))


def measure_used(job: AssetJob, folder: Path | None) -> StageResult:
    """How a hand opened and closed the parts of the object in ``folder``."""
    return measure_in_child(job, folder, used_columns, "not_used")


def measure_contents(job: AssetJob, folder: Path | None) -> StageResult:
    """The bodies that stayed in the interiors of the object in ``folder``, and the share of these that is free."""
    return measure_in_child(job, folder, contents_columns, "contents_leave")


def measure_lifted(job: AssetJob, folder: Path | None) -> StageResult:
    """How a hand lifted the object in ``folder`` and set it down."""
    return measure_in_child(job, folder, lifted_columns, "not_lifted")


def contents_columns(folder: Path) -> StageResult:
    """The columns of ``contents``, and a warning for each interior in which not all stayed."""
    from asset2sim.gym.hand.contents import content_records  # loads MuJoCo

    found = content_records(folder, read_overlay(folder), HandSettings(), ContentSettings())
    tried = [item for item in found if not item.shut]
    room_m3 = sum(item.room_m3 for item in found)
    columns: dict[str, int | float | str | None] = {
        "contents": sum(not item.reason for item in tried) / len(tried) if tried else None,
        "contents_interiors": len(tried),
        "contents_room_l": 1e3 * room_m3,
        "contents_free": sum(item.free * item.room_m3 for item in found) / room_m3 if found else None,
        "contents_reason": "; ".join(f"{item.link}: {item.reason}" for item in found if item.reason) or None,
    }
    said = [
        warning(Stage.MEASURE, "contents_leave", f"what lies in '{item.link}': {item.reason}", link=item.link)
        for item in tried
        if item.reason
    ]
    return StageResult(further=columns, findings=tuple(said))


def lifted_columns(folder: Path) -> StageResult:
    """The columns of ``lifted``, and a warning where what a hand carries was not lifted at every yaw."""
    from asset2sim.gym.hand.lifted import lift  # loads MuJoCo

    found = lift(folder, read_overlay(folder), HandSettings(), LiftSettings())
    columns: dict[str, int | float | str | None] = {
        "lifted": found.share, "lifted_by": found.by or None, "lifted_reason": found.reason or None
    }  # fmt: skip
    said = [warning(Stage.MEASURE, "not_lifted", f"a hand that lifts it: {found.reason}", value=found.share)]
    return StageResult(further=columns, findings=tuple(said if found.reason else ()))


def used_columns(folder: Path) -> StageResult:
    """The columns of ``used``, and a warning for each joint that a hand did not open and close."""
    from asset2sim.gym.hand.used import UsedJoint, share_done, use_records  # loads MuJoCo

    overlay = read_overlay(folder)
    found = use_records(folder, overlay, HandSettings())
    failed = [item for item in found if not item.done]
    told = [item for item in found if item.reason]
    asked = [item for item in found if item.fault != "task"]

    def finding_of(item: UsedJoint) -> Finding:
        message = f"a hand and '{item.joint}': {item.fault}: {item.reason}"
        return warning(Stage.MEASURE, "not_used", message, joint=item.joint, value=share_done(item) / 2.0)

    columns: dict[str, int | float | str | None] = {
        "used": sum(item.done for item in asked) / len(asked) if asked else None,
        "used_joints": len(overlay.joints) - sum(item.fault == "task" for item in found),
        "used_by": "; ".join(dict.fromkeys(item.by for item in found if item.done)) or None,
        "used_reason": "; ".join(": ".join(filter(None, (item.joint, item.fault, item.reason))) for item in told)
        or None,
    }
    return StageResult(further=columns, findings=tuple(finding_of(item) for item in failed if item.fault != "task"))
