"""One asset from folder to record: extract, synthesize, validate, apply, refine, measure. Runs in a process of
its own."""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

from asset2sim.authored import authored_overlay
from asset2sim.extraction import Extraction, extract
from asset2sim.folders import staged_folder
from asset2sim.judging import Judged, judge_as_written
from asset2sim.metrics.verdict import Verdict
from asset2sim.models.priors_known import is_prior
from asset2sim.models.synthesize import SynthesisError, synthesize
from asset2sim.physics.contact import contact_friction
from asset2sim.publishing import publish
from asset2sim.shaping import Job, Shaped, shape_and_judge
from asset2sim.validation import validate
from asset2sim.validation.authored import check_authored
from asset2sim.views import png_bytes, render_views
from schemas.asset import AssetRecord, AssetRef
from schemas.call import ModelCall
from schemas.errors import AssetError
from schemas.features import Features
from schemas.finding import Finding
from schemas.interaction import EngineReport, OverlapPair
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.request import LabelledImage, ModelAnswer, ModelRequest
from schemas.settings import Settings
from schemas.trace import TraceStep
from schemas.vocabulary import FailureMode, Method, Severity, Source, Stage, Status

CACHE = ".cache/pieces"
"""Under the output folder: convex pieces by mesh content, shared by all assets and runs."""

Ask = Callable[[ModelRequest], ModelAnswer]


@dataclass
class Progress:
    """What one asset has left behind so far: whatever happens next, this reaches the record."""

    features: Features | None = None
    overlay: PhysicsOverlay | None = None
    reports: tuple[EngineReport, ...] = ()
    overlaps: tuple[OverlapPair, ...] = ()
    calls: list[ModelCall] = field(default_factory=list)
    trace: list[TraceStep] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    stage: Stage = Stage.EXTRACT

    def refined(self, shaped: Shaped) -> None:
        """Keep a refinement and its judgement."""
        self.findings.extend(shaped.findings)
        self.trace.extend(shaped.refined.trace)
        self.calls.extend(shaped.refined.calls)
        self.findings.extend(shaped.refined.findings)
        self.judged(shaped.judged)

    def judged(self, judged: Judged) -> None:
        """Keep a judgement."""
        self.overlay, self.reports, self.overlaps = judged.overlay, judged.reports, judged.overlaps
        self.trace.extend(judged.trace)
        self.findings.extend(judged.findings)

    @contextmanager
    def timed(self, stage: Stage) -> Iterator[None]:
        """Run a stage, adding its wall time."""
        self.stage, start = stage, perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + perf_counter() - start


def refine_asset(ref: AssetRef, out: Path, settings: Settings, ask: Ask) -> AssetRecord:
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
    return record(ref, settings, progress, verdict)


def run_stages(ref: AssetRef, out: Path, settings: Settings, ask: Ask, progress: Progress) -> Verdict:
    """The stages in order; raises AssetError where the asset cannot go on."""
    with progress.timed(Stage.EXTRACT):
        extraction = extract(ref)
        progress.findings.extend(extraction.findings)
        mended, told = check_authored(extraction, settings.physics)
        progress.findings.extend(told)
        if settings.method is not Method.RAW:
            extraction = mended
        progress.features = extraction.features
    if settings.method is Method.RAW:
        return judge_raw(extraction, settings, progress)
    with progress.timed(Stage.SYNTHESIZE):
        proposal = propose(ref, extraction, settings, ask, progress)
    source = Source.PRIOR if is_prior(settings.model.model) else Source.MODEL
    with progress.timed(Stage.VALIDATE):
        friction = contact_friction(proposal.contact_material, settings.physics)
        overlay, findings = validate(extraction, proposal, source, friction, settings.physics)
        progress.overlay = overlay
        progress.findings.extend(findings)
    with staged_folder(out / "assets" / ref.asset_id) as path:
        job = Job(extraction, proposal, overlay, source, path, out / CACHE, settings, ask, progress.timed)
        shaped = shape_and_judge(job)
        progress.refined(shaped)
        with progress.timed(Stage.PUBLISH):
            progress.overlay, told = publish(shaped.urdf, shaped.judged, settings)
            progress.findings.extend(told)
    return shaped.judged.verdict


def judge_raw(extraction: Extraction, settings: Settings, progress: Progress) -> Verdict:
    """Judge an asset as it came: its own URDF, in every engine; nothing is written."""
    with progress.timed(Stage.MEASURE):
        overlay = authored_overlay(extraction, settings.physics)
        progress.overlay = overlay
        judged = judge_as_written(extraction, extraction.urdf, overlay, settings)
        progress.judged(judged)
    return judged.verdict


def propose(ref: AssetRef, extraction: Extraction, settings: Settings, ask: Ask, progress: Progress) -> Overlay:
    """The model's overlay, its calls and findings kept. Views are rendered only for models that might look at them."""
    images: tuple[LabelledImage, ...] = ()
    if not is_prior(settings.model.model):
        views = render_views(extraction.urdf, {}, settings.views)
        images = tuple(LabelledImage(label=name, png=png_bytes(image)) for name, image in views.items())
    proposal, calls, findings = synthesize(
        extraction.features, ref.prompt, extraction.closed_size, extraction.link_centers, ask, images
    )
    progress.calls.extend(calls)
    progress.findings.extend(findings)
    return proposal


def record(ref: AssetRef, settings: Settings, progress: Progress, verdict: Verdict) -> AssetRecord:
    """The record of one asset."""
    features = progress.features
    content = features.content_hash if features is not None else ""
    request = f"{ref.prompt}\n{settings.model_dump_json(exclude={'run', 'views'})}"
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
        content_hash=hashlib.sha256(f"{content}\n{request}".encode()).hexdigest(),
    )
