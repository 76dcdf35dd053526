"""Checks of a hand with what was written, where a run asks for them: ``used``, ``contents``, ``lifted``. They decide
nothing: a joint that is not used, contents that do not stay, are findings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from asset2sim.engines.child import in_child
from schemas.finding import Finding
from schemas.hand_settings import HandSettings
from schemas.overlay import PhysicsOverlay
from schemas.vocabulary import Engine, Severity, Stage
from tasks.progress import AssetJob, StageResult


@dataclass(frozen=True)
class Amiss:
    """Fault that a check finds: the finding's code, what about it, the joint, and how much of it was done."""

    code: str
    message: str
    joint: str | None = None
    value: float | None = None


Columns = Mapping[str, float | str | None]
Check = Callable[[Path, PhysicsOverlay, HandSettings], tuple[Columns, Sequence[Amiss]]]


def used(folder: Path, overlay: PhysicsOverlay, settings: HandSettings) -> tuple[Columns, Sequence[Amiss]]:
    """The columns of ``used``, and the joints that a hand did not open and close."""
    from asset2sim.gym.hand.used import operated, progress, use  # loads MuJoCo, which a run without this may not have

    found = use(folder, overlay, settings)
    failed = [item for item in found if not item.done]
    columns: dict[str, float | str | None] = {
        "used": sum(item.done for item in found) / len(found) if found else None,
        "used_joints": len(operated(overlay)),
        "used_by": "; ".join(dict.fromkeys(item.by for item in found if item.done)) or None,
        "used_reason": "; ".join(f"{item.joint}: {item.fault}: {item.reason}" for item in failed) or None,
    }
    return columns, [
        Amiss("not_used", f"a hand and '{item.joint}': {item.fault}: {item.reason}", item.joint, progress(item) / 2.0)
        for item in failed
    ]


def measured(check: Check, reason: str, job: AssetJob, folder: Path | None) -> StageResult:
    """The columns of a check of the object in ``folder``, in a child that may crash or hang, and warnings of what is
    amiss; nothing where nothing was written. A child that died is the ``reason`` column."""
    if folder is None:
        return StageResult()

    def tried() -> tuple[Columns, Sequence[Amiss]]:
        overlay = PhysicsOverlay.model_validate_json((folder / "overlay.json").read_text(encoding="utf-8"))
        return check(folder, overlay, HandSettings())

    outcome = in_child(Engine.MUJOCO, tried, time_limit_s=job.settings.engine.time_limit_s)
    died = Amiss(f"not_{reason.removesuffix('_reason')}", f"a hand and it: {outcome.problem}")
    columns, amiss = outcome.value or ({reason: outcome.problem}, [died])
    findings = tuple(
        Finding(
            stage=Stage.MEASURE, severity=Severity.WARNING, code=item.code, message=item.message, joint=item.joint,
            value=item.value,
        )
        for item in amiss
    )  # fmt: skip
    return StageResult(further=columns, findings=findings)


def measure_used(job: AssetJob, folder: Path | None) -> StageResult:
    """How a hand opened and closed the parts of the object in ``folder``."""
    return measured(used, "used_reason", job, folder)
