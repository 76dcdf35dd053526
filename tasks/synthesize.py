"""Synthesize: features and guidance → a proposed overlay; the stage at which methods differ (paper, "Synthesize")."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from asset2sim.assets.extract import Extraction
from asset2sim.assets.rest_overlaps import rest_overlaps
from asset2sim.baselines.constant import propose_constant
from asset2sim.baselines.ivw import ask_fused
from asset2sim.baselines.no_semantics import name_aliases
from asset2sim.baselines.reference import propose_reference
from asset2sim.models.ask_overlay import ask_overlay
from asset2sim.models.prompts import DIRECT, overlay_request, synthesis_request
from asset2sim.render.canonical import labelled_views
from asset2sim.render.marked import question_pictures
from asset2sim.validation.doubts import ObjectQuestion
from asset2sim.validation.overrides import (
    check_overrides,
    overridden,
    prompt_findings,
    stated_scale,
    stated_things,
    words_with_scale,
)
from asset2sim.validation.reconsider import reconsidered
from asset2sim.validation.sanity import sensible
from asset2sim.validation.support import forced_support
from schemas.finding import Finding
from schemas.model_names import is_prior
from schemas.overlay import Overlay
from schemas.vocabulary import Method, Severity, Stage
from tasks.job import AssetJob
from tasks.progress import StageResult


@dataclass(frozen=True, kw_only=True)
class Synthesized(StageResult):
    """What the method proposes; None for an asset that is measured as it came."""

    proposal: Overlay | None


def check_users_numbers(job: AssetJob, extraction: Extraction) -> StageResult:
    """Findings on the user's prompt and own numbers, before a model is asked. Raises AssetError for names and numbers
    that cannot be."""
    told = () if job.settings.method is Method.RAW else prompt_findings(job.guidance)
    stated = job.ref.overrides
    return StageResult(findings=told if stated is None else (*told, *check_overrides(extraction.features, stated)))


def with_users_numbers(
    method: Callable[[AssetJob, Extraction], Synthesized], job: AssetJob, extraction: Extraction
) -> Synthesized:
    """What the method proposes, with the user's own numbers, which are checked, in place of its own. Raises what the
    method raises."""
    stated, features = job.ref.overrides, extraction.features
    if stated is None:
        return method(job, extraction)
    done = method(guided_by_scale(job, stated_scale(features, stated)), extraction)
    if done.proposal is None:
        message = (
            f"the user's own numbers count for nothing: method {job.settings.method} measures the asset as it came"
        )
        unused = Finding(stage=Stage.SYNTHESIZE, severity=Severity.WARNING, code="overrides_unused", message=message)
        return replace(done, findings=(*done.findings, unused))
    proposal, said = overridden(features, done.proposal, stated, job.settings.physics)
    return replace(done, proposal=proposal, findings=(*done.findings, *said))


def guided_by_scale(job: AssetJob, scale: float | None) -> AssetJob:
    """The job with the scale that the user states as a number in its words and in what they ask."""
    if scale is None:
        return job
    words = job.ref.model_copy(update={"prompt": words_with_scale(job.ref.prompt, scale)})
    return replace(job, ref=words, guidance=job.guidance.scaled_to(scale))


def by_rules(job: AssetJob, extraction: Extraction) -> Synthesized:
    """Asset2Sim: a model's answer, asked about again where it is doubtful, and corrected as far as settings say. Raises
    SynthesisError."""
    settings, words, features = job.settings, job.ref.prompt, extraction.features
    semantics = settings.method is not Method.NO_SEMANTICS
    images = question_pictures(extraction, settings, None if semantics else name_aliases(features).aliases)
    # The offline prior reads no overlaps, and to find them takes longer than all else that it does.
    overlaps = () if is_prior(settings.model.model) else rest_overlaps(extraction)
    request = synthesis_request(features, words, images, overlaps)
    first = ask_overlay(request, features, job.ask)
    forced = forced_support(job.ref.support or settings.support)
    stated = () if job.ref.overrides is None else stated_things(job.ref.overrides)
    question = ObjectQuestion(extraction, job.guidance, job.source, settings, forced, stated)
    proposal, calls, findings = reconsidered(request, first, question, job.ask)
    proposal, corrected = sensible(
        extraction, proposal, job.guidance, settings.physics, settings.correction, semantics=semantics
    )
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

    proposal, calls, findings = run_agent(job.ref, extraction, job.settings, job.ask, job.source, job.guidance)
    return Synthesized(proposal=proposal, calls=calls, findings=findings)


def constant(job: AssetJob, extraction: Extraction) -> Synthesized:
    """Trivial baseline: the same scale and share open for every object."""
    return Synthesized(proposal=propose_constant(extraction.features))


def nothing(job: AssetJob, extraction: Extraction) -> Synthesized:
    """Raw: no proposal; the asset is measured as it came."""
    return Synthesized(proposal=None)
