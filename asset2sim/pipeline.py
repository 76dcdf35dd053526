"""One asset from folder to record: extract, synthesize, validate, apply, refine, measure. Runs in a process of
its own."""

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

from asset2sim.apply import write_folder, write_urdf
from asset2sim.collision.hulls import collision_hulls
from asset2sim.engines.pybullet_rest import measure
from asset2sim.extraction import Extraction, extract
from asset2sim.folders import staged_folder
from asset2sim.metrics.verdict import Verdict, judge
from asset2sim.models.priors_known import is_prior
from asset2sim.models.synthesize import SynthesisError, synthesize
from asset2sim.physics.contact import contact_friction
from asset2sim.search.asset import refine_in_engine
from asset2sim.search.dynamics import mend_dynamics
from asset2sim.validation import validate
from asset2sim.views import png_bytes, render_views, write_views
from schemas.asset import AssetRecord, AssetRef
from schemas.call import ModelCall
from schemas.errors import AssetError
from schemas.features import Features
from schemas.finding import Finding
from schemas.measurement import Measurement
from schemas.overlay import Overlay, PhysicsOverlay
from schemas.request import LabelledImage, ModelAnswer, ModelRequest
from schemas.settings import Settings
from schemas.trace import TraceStep
from schemas.vocabulary import FailureMode, Severity, Source, Stage, Status

CACHE = ".cache/pieces"
"""Under the output folder: convex pieces by mesh content, shared by all assets and runs."""

Ask = Callable[[ModelRequest], ModelAnswer]


@dataclass
class Progress:
    """What one asset has left behind so far: whatever happens next, this reaches the record."""

    features: Features | None = None
    overlay: PhysicsOverlay | None = None
    measurement: Measurement | None = None
    calls: list[ModelCall] = field(default_factory=list)
    trace: list[TraceStep] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    stage: Stage = Stage.EXTRACT

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
        progress.features = extraction.features
        progress.findings.extend(extraction.findings)
    with progress.timed(Stage.SYNTHESIZE):
        proposal = propose(ref, extraction, settings, ask, progress)
    source = Source.PRIOR if is_prior(settings.model.model) else Source.MODEL
    with progress.timed(Stage.VALIDATE):
        friction = contact_friction(proposal.contact_material, settings.physics)
        overlay, findings = validate(extraction, proposal, source, friction, settings.physics)
        progress.overlay = overlay
        progress.findings.extend(findings)
    with staged_folder(out / "assets" / ref.asset_id) as path:
        with progress.timed(Stage.APPLY):
            hulls = collision_hulls(extraction, overlay.scale)
            folder = write_folder(extraction, overlay, hulls, path, settings.physics)
        with progress.timed(Stage.REFINE):
            refined = refine_in_engine(extraction, proposal, overlay, source, hulls, folder, out / CACHE, settings, ask)
            overlay, folder = refined.overlay, refined.folder
            progress.overlay = overlay
            progress.trace.extend(refined.trace)
            progress.calls.extend(refined.calls)
            progress.findings.extend(refined.findings)
        with progress.timed(Stage.MEASURE):
            positions = overlay.initial_positions

            def remeasure(changed: PhysicsOverlay) -> Measurement:
                write_urdf(extraction, changed, folder, settings.physics)
                return measure(folder.urdf, positions, changed.contact_friction, settings.engine)

            mended = mend_dynamics(extraction.features, overlay, remeasure(overlay), settings, remeasure)
            overlay, measurement = mended.overlay, mended.measurement
            progress.overlay, progress.measurement = overlay, measurement
            progress.trace.extend(mended.trace)
            progress.findings.extend(mended.findings)
            verdict = judge(measurement, prismatic_joints(overlay), settings.thresholds)
        progress.findings.extend(engine_findings(measurement, verdict))
        with progress.timed(Stage.PUBLISH):
            (path / "overlay.json").write_text(overlay.model_dump_json(indent=2), encoding="utf-8")
            (path / "measurement.json").write_text(measurement.model_dump_json(indent=2), encoding="utf-8")
            if settings.views.write:
                write_views(folder.urdf, positions, path / "views", settings.views)
    return verdict


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


def prismatic_joints(overlay: PhysicsOverlay) -> frozenset[str]:
    """The joints whose positions are metres."""
    return frozenset(joint.name for joint in overlay.joints if joint.type == "prismatic")


def engine_findings(measurement: Measurement, verdict: Verdict) -> list[Finding]:
    """What the engine printed while loading, and the verdict where it is a failure."""
    findings = [
        Finding(
            stage=Stage.MEASURE,
            severity=Severity.WARNING,
            code="engine_console",
            message=f"{measurement.engine} printed: {line}",
        )
        for line in measurement.console
    ]
    if not verdict.passed:
        findings.append(
            Finding(
                stage=Stage.MEASURE,
                severity=Severity.ERROR,
                code=verdict.mode,
                message=verdict.reason,
                value=verdict.value,
                limit=verdict.limit,
            )
        )
    return findings


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
        measurement=progress.measurement,
        calls=tuple(progress.calls),
        trace=tuple(step.model_copy(update={"step": index}) for index, step in enumerate(progress.trace)),
        findings=tuple(progress.findings),
        seconds=dict(progress.seconds),
        content_hash=hashlib.sha256(f"{content}\n{request}".encode()).hexdigest(),
    )
