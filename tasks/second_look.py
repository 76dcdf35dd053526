"""Second look: the model sees parts at both ends of which only a guess says where they are closed."""

from dataclasses import dataclass, replace

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import known_methods
from asset2sim.intake.guessed_ends import with_told_ends
from asset2sim.validation.second_look import look_again
from schemas.model_names import is_prior
from tasks.extract import with_shown_front
from tasks.progress import AssetJob, StageResult


@dataclass(frozen=True, kw_only=True)
class LookedAgain(StageResult):
    """The asset with the closed ends that the model told, and the job, which keeps them."""

    extraction: Extraction
    job: AssetJob


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
