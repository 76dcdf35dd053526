"""What is run for every method."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from asset2sim.asset_progress import Progress
from asset2sim.assets.authored import authored_overlay
from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import URDF_NAME, staged_folder
from asset2sim.assets.views.canonical import labelled_views
from asset2sim.baselines.as_proposed import as_proposed
from asset2sim.baselines.ivw import ask_fused
from asset2sim.baselines.no_semantics import without_semantics
from asset2sim.baselines.reference import propose_reference
from asset2sim.checks.verdict import Verdict
from asset2sim.methods.judge_overlay import judge_overlay
from asset2sim.methods.ours import refine_with_rules
from asset2sim.models.ask_overlay import Synthesized, ask_overlay
from asset2sim.models.prompts import DIRECT, overlay_request
from asset2sim.publishing import publish
from asset2sim.refinement.judge import judge_as_written
from schemas.asset import AssetRef
from schemas.model_names import is_prior
from schemas.overlay import Overlay
from schemas.request import ModelAsk
from schemas.settings import Settings
from schemas.vocabulary import Method, Source, Stage


@dataclass(frozen=True)
class Work:
    """One asset, extracted: ``extraction`` as it was authored, ``mended`` with its joints put right by rules of ours,
    which only methods of ours may use."""

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


def run_blind(work: Work) -> Verdict:
    """Our pipeline with every semantic cue withheld from the model."""
    ask = without_semantics(work.ask, work.mended.features)
    return refine_with_rules(work.ref, work.mended, work.out, work.settings, ask, work.progress)


def run_raw(work: Work) -> Verdict:
    """The asset as it came: its own URDF, in every engine; nothing is written."""
    with work.progress.timed(Stage.MEASURE):
        overlay = authored_overlay(work.extraction, work.settings.physics)
        work.progress.overlay = overlay
        judged = judge_as_written(work.extraction, work.extraction.urdf, overlay, work.settings)
        work.progress.judged(judged)
    return judged.verdict


def run_direct(work: Work) -> Verdict:
    """One answer to all five views at once, taken as it is."""
    with work.progress.timed(Stage.SYNTHESIZE):
        images = tuple(labelled_views(work.extraction, work.settings).values())
        found = work.extraction
        request = overlay_request(
            DIRECT, found.features, work.ref.prompt, found.closed_size, found.link_centers, images
        )
        proposal = kept(work, ask_overlay(request, found.features, work.ask))
    return judge_as_proposed(work, proposal, source_of(work.settings))


def run_ivw(work: Work) -> Verdict:
    """Several answers to each view, fused."""
    with work.progress.timed(Stage.SYNTHESIZE):
        images = labelled_views(work.extraction, work.settings)
        fused = ask_fused(work.extraction, work.ref.prompt, work.ask, images, work.settings.methods)
        proposal = kept(work, fused)
    return judge_as_proposed(work, proposal, source_of(work.settings))


def run_reference(work: Work) -> Verdict:
    """An expert's scale and state."""
    with work.progress.timed(Stage.SYNTHESIZE):
        proposal, findings = propose_reference(work.ref, work.extraction.features)
        work.progress.findings.extend(findings)
    return judge_as_proposed(work, proposal, Source.USER)


def run_agent_method(work: Work) -> Verdict:
    """A model with tools and no structure of ours."""
    from asset2sim.baselines.agent import run_agent  # its tools load engines, which no other method needs here

    with work.progress.timed(Stage.SYNTHESIZE):
        done = run_agent(work.ref, work.extraction, work.settings, work.ask)
        proposal = kept(work, (done.overlay, tuple(done.calls), tuple(done.findings)))
    return judge_as_proposed(work, proposal, source_of(work.settings))


def kept(work: Work, synthesized: Synthesized) -> Overlay:
    """The overlay, its calls and findings kept."""
    proposal, calls, findings = synthesized
    work.progress.calls.extend(calls)
    work.progress.findings.extend(findings)
    return proposal


def judge_as_proposed(work: Work, proposal: Overlay, source: Source) -> Verdict:
    """Write an answer's numbers as they are, judge them, and publish what was judged."""
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
    """Who proposes: a prior or a model."""
    return Source.PRIOR if is_prior(settings.model.model) else Source.MODEL


RUNS: dict[Method, Callable[[Work], Verdict]] = {
    Method.ASSET2SIM: run_ours,
    Method.NO_SEMANTICS: run_blind,
    Method.DIRECT: run_direct,
    Method.IVW: run_ivw,
    Method.REFERENCE: run_reference,
    Method.AGENT: run_agent_method,
    Method.RAW: run_raw,
}
