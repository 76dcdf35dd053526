"""Reach: a scripted arm moves a joint of what was written, where a run asks for that check; it decides nothing."""

from pathlib import Path

from asset2sim.engines.child import in_child
from lab.schemas.reached import Reached
from schemas.finding import Finding
from schemas.vocabulary import Engine, Severity, Stage
from tasks.job import AssetJob
from tasks.progress import StageResult


def measure_reach(job: AssetJob, folder: Path | None) -> StageResult:
    """Result of a scripted arm with the object in ``folder``, in a child of its own that may crash or hang, and a
    warning of what is amiss; nothing where nothing was written."""
    if folder is None:
        return StageResult()
    limits = job.settings.thresholds

    def tried() -> Reached:
        from lab.trials.reach import reach  # loads MuJoCo, which a run without this check may not have

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
