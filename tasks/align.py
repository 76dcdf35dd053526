"""Align: hold an asset against its prompt, an expert's choice and readers' expectations (paper, "Evaluation")."""

from pathlib import Path

from asset2sim.checks.alignment.align import align
from asset2sim.checks.alignment.expectations import expectations_met, misfits
from asset2sim.checks.alignment.vision_judge import Judgement, judge
from asset2sim.render import render_views
from schemas.asset import AssetRecord
from schemas.errors import AssetError
from tasks.progress import AssetJob, StageResult


def align_asset(job: AssetJob, record: AssetRecord, urdf: Path | None) -> StageResult:
    """Rubric, distance from the expert's choice, and expectations met by the asset as far as it came, and where one is
    set the judge's score of pictures of ``urdf``; None: the asset is not to be judged. Nothing of it decides
    anything."""
    alignment, expected = align(record), expectations_met(record)
    unfit = () if record.features is None else misfits(record.features, record.ref.expectations)
    if alignment is None or urdf is None or job.settings.model.judge_model is None:
        return StageResult(alignment=alignment, expected=expected, findings=unfit)
    said = judge_pictures(job, record, urdf)
    judged = alignment.model_copy(update={"judged": said.score})
    return StageResult(alignment=judged, expected=expected, calls=said.calls, findings=(*said.findings, *unfit))


def judge_pictures(job: AssetJob, record: AssetRecord, urdf: Path) -> Judgement:
    """The judge's score of the URDF in its initial state; without pictures where it cannot be rendered."""
    assert record.overlay is not None
    try:
        views = render_views(urdf, record.overlay.initial_positions, job.settings.views, front=record.overlay.front)
    except AssetError:
        views = {}
    return judge(record, views, job.ask)
