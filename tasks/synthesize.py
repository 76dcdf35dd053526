"""Synthesize: features and guidance → a proposed overlay; the stage at which methods differ (paper, "Synthesize")."""

from dataclasses import dataclass

from asset2sim.assets.extract import Extraction
from asset2sim.assets.views.canonical import labelled_views
from asset2sim.baselines.constant import propose_constant
from asset2sim.baselines.ivw import ask_fused
from asset2sim.baselines.reference import propose_reference
from asset2sim.models.ask_overlay import ask_overlay, synthesize
from asset2sim.models.prompts import DIRECT, overlay_request
from asset2sim.validation.sanity import sensible
from schemas.overlay import Overlay
from schemas.vocabulary import Method
from tasks.job import AssetJob
from tasks.progress import StageResult


@dataclass(frozen=True, kw_only=True)
class Synthesized(StageResult):
    """What the method proposes; None for an asset that is measured as it came."""

    proposal: Overlay | None


def by_rules(job: AssetJob, extraction: Extraction) -> Synthesized:
    """Asset2Sim: a model's answer, its scale and state corrected where they cannot be meant. Raises SynthesisError."""
    images = tuple(labelled_views(extraction, job.settings).values())
    proposal, calls, findings = synthesize(extraction.features, job.ref.prompt, job.ask, images)
    semantics = job.settings.method is not Method.NO_SEMANTICS
    proposal, corrected = sensible(extraction, proposal, job.ref.prompt, job.settings.physics, semantics=semantics)
    return Synthesized(proposal=proposal, calls=calls, findings=(*findings, *corrected))


def direct(job: AssetJob, extraction: Extraction) -> Synthesized:
    """VLM-direct: one answer from all five views. Raises SynthesisError."""
    images = tuple(labelled_views(extraction, job.settings).values())
    request = overlay_request(DIRECT, extraction.features, job.ref.prompt, images)
    proposal, calls, findings = ask_overlay(request, extraction.features, job.ask)
    return Synthesized(proposal=proposal, calls=calls, findings=findings)


def ivw(job: AssetJob, extraction: Extraction) -> Synthesized:
    """VLM-IVW: several answers to each view, fused. Raises SynthesisError."""
    images = labelled_views(extraction, job.settings)
    proposal, calls, findings = ask_fused(extraction, job.ref.prompt, job.ask, images, job.settings.methods)
    return Synthesized(proposal=proposal, calls=calls, findings=findings)


def reference(job: AssetJob, extraction: Extraction) -> Synthesized:
    """Human baseline: an expert's scale and state."""
    proposal, findings = propose_reference(job.ref, extraction.features)
    return Synthesized(proposal=proposal, findings=findings)


def agent(job: AssetJob, extraction: Extraction) -> Synthesized:
    """Coding agent: a model with tools, without our structure. Raises SynthesisError."""
    from asset2sim.baselines.agent import run_agent  # its tools load engines, which no other method needs here

    proposal, calls, findings = run_agent(job.ref, extraction, job.settings, job.ask, job.source)
    return Synthesized(proposal=proposal, calls=calls, findings=findings)


def constant(job: AssetJob, extraction: Extraction) -> Synthesized:
    """Trivial baseline: the same scale and share open for every object."""
    return Synthesized(proposal=propose_constant(extraction.features))


def nothing(job: AssetJob, extraction: Extraction) -> Synthesized:
    """Raw: no proposal; the asset is measured as it came."""
    return Synthesized(proposal=None)
