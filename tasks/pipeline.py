"""One asset from folder to record: extract, synthesize, validate, apply, refine, measure. Runs in a child
process."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from asset2sim.assets.authored import authored_overlay
from asset2sim.assets.extract import Extraction, extract
from asset2sim.assets.folder import URDF_NAME, staged_folder
from asset2sim.assets.meshes.shape_cache import PIECE_CACHE, SHAPE_CACHE
from asset2sim.assets.views.canonical import labelled_views
from asset2sim.baselines.as_proposed import as_proposed
from asset2sim.baselines.ivw import ask_fused
from asset2sim.baselines.no_semantics import without_semantics
from asset2sim.baselines.reference import propose_reference
from asset2sim.checks.alignment.vision_judge import with_judge_score
from asset2sim.checks.verdict import Verdict
from asset2sim.models.ask_overlay import SynthesisError, Synthesized, ask_overlay, synthesize
from asset2sim.models.prompts import DIRECT, overlay_request
from asset2sim.refinement.judge import verify_as_written
from asset2sim.refinement.refine import Job, refine_and_verify
from asset2sim.validation.sanity import sensible
from asset2sim.validation.validate import contact_friction, validate
from schemas.asset import AssetRecord, AssetRef
from schemas.errors import AssetError
from schemas.finding import Finding
from schemas.model_names import is_prior
from schemas.overlay import Overlay
from schemas.request import ModelAsk
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, Method, Severity, Source, Stage, Status
from tasks.extract import validate_authored
from tasks.measure import judge_overlay
from tasks.progress import Progress
from tasks.publish import publish


def refine_with_rules(
    ref: AssetRef, extraction: Extraction, out: Path, settings: Settings, ask: ModelAsk, progress: Progress
) -> Verdict:
    """Synthesize, validate, apply, refine, measure and publish one asset; raises AssetError where it cannot go on."""
    with progress.timed(Stage.SYNTHESIZE):
        images, features = tuple(labelled_views(extraction, settings).values()), extraction.features
        proposal, calls, findings = synthesize(
            features, ref.prompt, features.closed_size, features.link_centers, ask, images
        )
        progress.calls.extend(calls)
        progress.findings.extend(findings)
        semantic = settings.method is not Method.NO_SEMANTICS
        proposal, findings = sensible(extraction, proposal, ref.prompt, settings.physics, semantics=semantic)
        progress.findings.extend(findings)
    source = Source.PRIOR if is_prior(settings.model.model) else Source.MODEL
    with progress.timed(Stage.VALIDATE):
        friction = contact_friction(proposal.contact_material, settings.physics)
        overlay, findings = validate(extraction, proposal, source, friction, settings.physics)
        progress.overlay = overlay
        progress.findings.extend(findings)
    with staged_folder(out / "assets" / ref.asset_id) as path:
        job = Job(extraction, proposal, overlay, source, path, out / PIECE_CACHE, settings, ask, progress.timed)
        shaped = refine_and_verify(job)
        progress.refined(shaped)
        with progress.timed(Stage.PUBLISH):
            progress.overlay, told = publish(shaped.urdf, shaped.judged, settings)
            progress.findings.extend(told)
    return shaped.judged.verdict


@dataclass(frozen=True)
class Work:
    """One extracted asset: ``extraction`` as authored, ``mended`` with joints corrected by our rules, for our methods
    only."""

    ref: AssetRef
    extraction: Extraction
    mended: Extraction
    out: Path
    settings: Settings
    ask: ModelAsk
    progress: Progress


def run_method(work: Work) -> Verdict:
    """Run the settings' method on one asset; raises AssetError where the asset cannot go on."""
    ours = work.settings.method in (Method.ASSET2SIM, Method.NO_SEMANTICS)
    work.progress.features = (work.mended if ours else work.extraction).features
    return RUNS[work.settings.method](work)


def run_ours(work: Work) -> Verdict:
    """Our pipeline."""
    return refine_with_rules(work.ref, work.mended, work.out, work.settings, work.ask, work.progress)


def run_no_semantics(work: Work) -> Verdict:
    """Our pipeline with every semantic cue withheld from the model."""
    ask = without_semantics(work.ask, work.mended.features)
    return refine_with_rules(work.ref, work.mended, work.out, work.settings, ask, work.progress)


def run_raw(work: Work) -> Verdict:
    """Verify the authored URDF in every engine; nothing is written."""
    with work.progress.timed(Stage.MEASURE):
        overlay = authored_overlay(work.extraction, work.settings.physics)
        work.progress.overlay = overlay
        judged = verify_as_written(work.extraction, work.extraction.urdf, overlay, work.settings)
        work.progress.judged(judged)
    return judged.verdict


def run_direct(work: Work) -> Verdict:
    """VLM-direct: one answer from all five views, written unchanged."""
    with work.progress.timed(Stage.SYNTHESIZE):
        images = tuple(labelled_views(work.extraction, work.settings).values())
        found = work.extraction
        request = overlay_request(
            DIRECT, found.features, work.ref.prompt, found.features.closed_size, found.features.link_centers, images
        )
        proposal = kept(work, ask_overlay(request, found.features, work.ask))
    return publish_as_proposed(work, proposal, source_of(work.settings))


def run_ivw(work: Work) -> Verdict:
    """VLM-IVW: several answers to each view, fused."""
    with work.progress.timed(Stage.SYNTHESIZE):
        images = labelled_views(work.extraction, work.settings)
        fused = ask_fused(work.extraction, work.ref.prompt, work.ask, images, work.settings.methods)
        proposal = kept(work, fused)
    return publish_as_proposed(work, proposal, source_of(work.settings))


def run_reference(work: Work) -> Verdict:
    """Human baseline: an expert's scale and state."""
    with work.progress.timed(Stage.SYNTHESIZE):
        proposal, findings = propose_reference(work.ref, work.extraction.features)
        work.progress.findings.extend(findings)
    return publish_as_proposed(work, proposal, Source.USER)


def run_agent_method(work: Work) -> Verdict:
    """Coding agent: a model with tools, without our structure."""
    from asset2sim.baselines.agent import run_agent  # its tools load engines, which no other method needs here

    with work.progress.timed(Stage.SYNTHESIZE):
        done = run_agent(work.ref, work.extraction, work.settings, work.ask)
        proposal = kept(work, (done.overlay, tuple(done.calls), tuple(done.findings)))
    return publish_as_proposed(work, proposal, source_of(work.settings))


def kept(work: Work, synthesized: Synthesized) -> Overlay:
    """The proposed overlay; its calls and findings are added to the progress."""
    proposal, calls, findings = synthesized
    work.progress.calls.extend(calls)
    work.progress.findings.extend(findings)
    return proposal


def publish_as_proposed(work: Work, proposal: Overlay, source: Source) -> Verdict:
    """Write an answer's numbers unchanged, verify them in every engine, and publish."""
    with work.progress.timed(Stage.VALIDATE):
        overlay = as_proposed(work.extraction, proposal, source, work.settings)
        work.progress.overlay = overlay
    with staged_folder(work.out / "assets" / work.ref.asset_id) as path:
        with work.progress.timed(Stage.MEASURE):
            judged = judge_overlay(work.extraction, overlay, path, work.settings)
            work.progress.judged(judged)
        with work.progress.timed(Stage.PUBLISH):
            work.progress.overlay, told = publish(path / URDF_NAME, judged, work.settings)
            work.progress.findings.extend(told)
    return judged.verdict


def source_of(settings: Settings) -> Source:
    """Source of the proposal: a prior or a model."""
    return Source.PRIOR if is_prior(settings.model.model) else Source.MODEL


RUNS: dict[Method, Callable[[Work], Verdict]] = {
    Method.ASSET2SIM: run_ours,
    Method.NO_SEMANTICS: run_no_semantics,
    Method.DIRECT: run_direct,
    Method.IVW: run_ivw,
    Method.REFERENCE: run_reference,
    Method.AGENT: run_agent_method,
    Method.RAW: run_raw,
}


def refine_asset(ref: AssetRef, out: Path, settings: Settings, ask: ModelAsk) -> AssetRecord:
    """Record of one asset refined into ``out/assets/<asset_id>``.

    Any problem with the asset or its model gives a record with a failure mode; the folder of an earlier run is replaced
    only when the new one is complete.
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
    return with_judge_score(record(ref, settings, progress, verdict), out, settings, ask)


def run_stages(ref: AssetRef, out: Path, settings: Settings, ask: ModelAsk, progress: Progress) -> Verdict:
    """Extract the asset and run the settings' method; raises AssetError where the asset cannot go on."""
    with progress.timed(Stage.EXTRACT):
        extraction = extract(ref, out / SHAPE_CACHE)
        progress.findings.extend(extraction.findings)
        mended, told = validate_authored(extraction, settings.physics)
        progress.findings.extend(told)
    try:
        return run_method(Work(ref, extraction, mended, out, settings, ask, progress))
    finally:
        extraction.triangles.keep()


def record(ref: AssetRef, settings: Settings, progress: Progress, verdict: Verdict) -> AssetRecord:
    """Record of one asset, without its content hash, which the run's plan adds."""
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
