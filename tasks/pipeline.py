"""One asset from folder to record, stage by stage; runs in a child process of its own.

What a method does differently is what it proposes, and whether our rules complete its answer and refine it
(``asset2sim.baselines``).
"""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from asset2sim.assets.folder import staged_folder
from asset2sim.baselines.declared_method import known_methods
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError
from schemas.extensions import further_check, object_at
from schemas.request import ModelAsk
from schemas.settings import Settings
from schemas.verdict import Verdict
from schemas.vocabulary import Stage
from tasks import synthesize
from tasks.align import align_asset
from tasks.apply import apply_overlay
from tasks.extract import extract_asset, guidance_of
from tasks.measure import measure_written
from tasks.progress import AssetJob, Progress
from tasks.publish import publish_folder
from tasks.refine import Refined, refine_written
from tasks.remake import recipe_of
from tasks.validate import validate_overlay


def refine_asset(ref: AssetRef, out: Path, settings: Settings, ask: ModelAsk) -> AssetRecord:
    """Record of one asset refined into ``out/assets/<asset_id>``.

    Any problem with the asset or its model gives a record with a failure mode; the folder of an earlier run is replaced
    only when the new one is complete.
    """
    progress, job = Progress(), AssetJob(ref, out, settings, ask)
    try:
        verdict = run_stages(job, progress)
    except AssetError as error:
        verdict = progress.failed(error)
        progress.run(Stage.ALIGN, align_asset, job, progress.record(ref, settings, verdict), None)
    return progress.record(ref, settings, verdict)


def run_stages(job: AssetJob, progress: Progress) -> Verdict:
    """All stages in their order; raises AssetError where the asset cannot go on."""
    run, method = progress.run, known_methods()[job.settings.method]
    extracted = run(Stage.EXTRACT, extract_asset, job, correct_joints=method.rules)
    job, extraction = replace(job, guidance=extracted.guidance), extracted.extraction
    given = job
    ask, known = method.given(job.ask, extraction)
    if known is not extraction:
        # Rules read the words without labels, too; the score is by what they mean with them.
        job = replace(job, guidance=guidance_of(job.ref, known.features))
    job, extraction = replace(job, ask=ask), known
    try:
        run(Stage.SYNTHESIZE, synthesize.check_users_numbers, job, extraction)
        looked = run(Stage.SYNTHESIZE, synthesize.second_look, job, extraction)
        job, extraction = looked.job, looked.extraction
        propose = synthesize.with_users_numbers
        proposal = run(Stage.SYNTHESIZE, propose, method.propose, job, extraction).proposal
        validated = run(Stage.VALIDATE, validate_overlay, job, extraction, proposal, rules=method.rules)
        overlay, extraction = validated.overlay, validated.extraction
        final = job.out / "assets" / job.ref.asset_id
        with nullcontext() if proposal is None else staged_folder(final) as folder:
            applied = run(Stage.APPLY, apply_overlay, job, extraction, proposal, overlay, folder, rules=method.rules)
            refined = Refined(overlay=overlay, folder=applied.folder)
            if method.rules:
                refined = run(Stage.REFINE, refine_written, job, applied)
            measured = run(
                Stage.MEASURE, measure_written, job, extraction, applied.urdf, refined.overlay, refined.reports
            )
            overlay = refined.overlay if folder is None else refined.overlay.with_followers()
            progress.overlay = overlay
            draft = progress.record(job.ref, job.settings, measured.verdict)
            run(Stage.ALIGN, align_asset, given, draft, applied.urdf)
            recipe = recipe_of(job, extraction, overlay, refined.folder)
            run(Stage.PUBLISH, publish_folder, job, folder, overlay, measured.reports, recipe)
            for name in job.settings.checks:
                run(Stage.MEASURE, object_at(further_check(name).run), job, folder)
        progress.written = proposal is not None
        return measured.verdict
    finally:
        extraction.triangles.keep()
