"""One asset from folder to record: extract, synthesize, validate, apply, refine, measure. Runs in a child
process."""

from pathlib import Path

from asset2sim.asset_progress import Progress
from asset2sim.assets.extract import extract
from asset2sim.assets.meshes.shape_cache import SHAPES
from asset2sim.checks.alignment.vision_judge import with_judgement
from asset2sim.checks.verdict import Verdict
from asset2sim.methods.dispatch import Work, run_method
from asset2sim.models.ask_overlay import SynthesisError
from asset2sim.validation.authored import check_authored
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError
from schemas.finding import Finding
from schemas.request import ModelAsk
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Severity, Stage, Status


def refine_asset(ref: AssetRef, out: Path, settings: Settings, ask: ModelAsk) -> AssetRecord:
    """Refine one asset into ``out/assets/<asset_id>`` and say how it went.

    Whatever is wrong with the asset or its model ends as a record with a failure mode; the folder of an earlier run is
    replaced only when the new one is complete.
    """
    progress = Progress()
    try:
        verdict = run_stages(ref, out, settings, ask, progress)
    except AssetError as error:
        if isinstance(error, SynthesisError):
            progress.calls.extend(error.calls)
        progress.findings.append(
            Finding(
                stage=progress.stage,
                severity=Severity.ERROR,
                code=error.code,
                message=str(error),
                link=error.link,
                joint=error.joint,
            )
        )
        verdict = Verdict(error.mode, str(error))
    return with_judgement(record(ref, settings, progress, verdict), out, settings, ask)


def run_stages(ref: AssetRef, out: Path, settings: Settings, ask: ModelAsk, progress: Progress) -> Verdict:
    """Extraction, and then what the settings' method does; raises AssetError where the asset cannot go on."""
    with progress.timed(Stage.EXTRACT):
        extraction = extract(ref, out / SHAPES)
        progress.findings.extend(extraction.findings)
        mended, told = check_authored(extraction, settings.physics)
        progress.findings.extend(told)
    try:
        return run_method(Work(ref, extraction, mended, out, settings, ask, progress))
    finally:
        extraction.triangles.keep()


def record(ref: AssetRef, settings: Settings, progress: Progress, verdict: Verdict) -> AssetRecord:
    """The record of one asset; whoever planned the run knows its content hash."""
    features = progress.features
    return AssetRecord(
        ref=ref,
        category=(features.category if features is not None else ref.category) or "",
        method=settings.method,
        model=settings.model.model,
        status=Status.OK if verdict.mode is FailureMode.NONE else Status.FAILED,
        failure_mode=verdict.mode,
        reason=verdict.reason,
        features=features,
        overlay=progress.overlay,
        measurement=next((r.measurement for r in progress.reports if r.measurement is not None), None),
        reports=progress.reports,
        overlaps=progress.overlaps,
        calls=tuple(progress.calls),
        trace=tuple(step.model_copy(update={"step": index}) for index, step in enumerate(progress.trace)),
        findings=tuple(progress.findings),
        seconds=dict(progress.seconds),
    )
