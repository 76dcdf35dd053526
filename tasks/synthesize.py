"""Synthesize: features and guidance → a proposed overlay; the stage at which methods differ (paper, "Synthesize")."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import ProposalJob, Proposed, known_methods
from asset2sim.intake.guessed_ends import with_told_ends
from asset2sim.validation.overrides import check_overrides, overridden, prompt_findings, words_with_scale
from asset2sim.validation.second_look import look_again
from schemas.finding import warning
from schemas.model_names import is_prior
from schemas.overlay import Overlay
from schemas.vocabulary import Method, Stage
from tasks.extract import with_shown_front
from tasks.progress import AssetJob, StageResult


@dataclass(frozen=True, kw_only=True)
class Synthesized(StageResult):
    """The method's proposal; None for an asset that is measured as it came."""

    proposal: Overlay | None


@dataclass(frozen=True, kw_only=True)
class LookedAgain(StageResult):
    """The asset with the closed ends that the model told, and the job, which keeps them."""

    extraction: Extraction
    job: AssetJob


def check_users_numbers(job: AssetJob, extraction: Extraction) -> StageResult:
    """Findings on prompt and own numbers, before a model is asked. AssetError for names and numbers that cannot be."""
    told = () if job.settings.method is Method.RAW else prompt_findings(job.guidance)
    stated = job.ref.overrides
    return StageResult(findings=told if stated is None else (*told, *check_overrides(extraction.features, stated)))


def second_look(job: AssetJob, extraction: Extraction) -> LookedAgain:
    """The asset with guessed closed ends as the model tells them that has seen both; as it was without a model that
    looks, or where doubts are not asked about."""
    method, settings = known_methods()[job.settings.method], job.settings
    if not (method.rules and method.asks and settings.asks_again) or is_prior(settings.model.model):
        return LookedAgain(extraction=extraction, job=job)
    overrides = job.ref.overrides
    stated = () if overrides is None else [name for name, at in overrides.joints.items() if at.unit != "share"]
    found = look_again(extraction, settings, job.ask, stated)
    if found.ends:
        extraction = with_shown_front(with_told_ends(extraction, found.ends))
    return LookedAgain(
        extraction=extraction,
        job=replace(job, closed_ends=found.ends),
        features=extraction.features,
        calls=found.calls,
        findings=found.findings,
    )


def with_users_numbers(
    propose: Callable[[ProposalJob, Extraction], Proposed], job: AssetJob, extraction: Extraction
) -> Synthesized:
    """The method's proposal with the user's own, checked numbers in place of its own. Raises what the method does."""
    stated, features = job.ref.overrides, extraction.features
    told = job if stated is None else guided_by_scale(job, stated.scale_of(features))
    proposal, calls, findings = propose(told, extraction)
    done = Synthesized(proposal=proposal, calls=calls, findings=findings)
    if stated is None:
        return done
    if done.proposal is None:
        message = (
            f"the user's own numbers count for nothing: method {job.settings.method} measures the asset as it came"
        )
        unused = warning(Stage.SYNTHESIZE, "overrides_unused", message)
        return replace(done, findings=(*done.findings, unused))
    proposal, said = overridden(features, done.proposal, stated, job.settings.physics)
    return replace(done, proposal=proposal, findings=(*done.findings, *said))


def guided_by_scale(job: AssetJob, scale: float | None) -> AssetJob:
    """The job with the scale that the user states as a number in its words and in what they ask."""
    if scale is None:
        return job
    words = job.ref.model_copy(update={"prompt": words_with_scale(job.ref.prompt, scale)})
    return replace(job, ref=words, guidance=job.guidance.scaled_to(scale))
