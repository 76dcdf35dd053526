"""Asset2Sim: a model proposes, rules correct, complete and bound, a simulator decides."""

from collections.abc import Mapping

from asset2sim.assets.authored_overlap import rest_overlaps
from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import DeclaredMethod, ProposalJob, Proposed
from asset2sim.models.ask_overlay import ask_overlay
from asset2sim.models.prompts import SYNTHESIS, overlay_request
from asset2sim.render.marked import question_pictures
from asset2sim.validation.doubts import ObjectQuestion
from asset2sim.validation.overrides import stated_things
from asset2sim.validation.reconsider import reconsidered
from asset2sim.validation.sanity import corrected_proposal
from asset2sim.validation.support import forced_support
from schemas.features import RestOverlap
from schemas.model_names import is_prior
from schemas.request import ModelRequest
from schemas.vocabulary import Method


def first_question(
    purpose: str, job: ProposalJob, extraction: Extraction, aliases: Mapping[str, str] | None = None
) -> ModelRequest:
    """The first question of a method about an asset: the same facts and pictures for all, in the words of ``purpose``.
    Pictures are labelled with ``aliases`` where there are any."""
    images = question_pictures(extraction, job.settings, aliases)
    overlaps = told_overlaps(job, extraction)
    return overlay_request(purpose, extraction.features, job.ref.prompt, images, overlaps=overlaps)


def told_overlaps(job: ProposalJob, extraction: Extraction) -> tuple[RestOverlap, ...]:
    """The overlaps of the asset as drawn; none for ``prior/household``, which ignores them and is faster without."""
    return () if is_prior(job.settings.model.model) else tuple(rest_overlaps(extraction))


def by_rules(
    job: ProposalJob, extraction: Extraction, aliases: Mapping[str, str] | None = None, *, semantics: bool = True
) -> Proposed:
    """A model's answer, asked about again where it is doubtful, and corrected as far as settings say. Raises
    SynthesisError.

    Pictures are labelled with ``aliases`` where there are any; without ``semantics`` no kind of object is known.
    """
    settings = job.settings
    request = first_question(SYNTHESIS, job, extraction, aliases)
    first = ask_overlay(request, extraction.features, job.ask)
    forced = forced_support(job.ref.support or settings.support, extraction)
    stated = () if job.ref.overrides is None else stated_things(job.ref.overrides)
    question = ObjectQuestion(extraction, job.guidance, job.source, settings, forced, stated)
    proposal, calls, findings = reconsidered(request, first, question, job.ask)
    proposal, corrected = corrected_proposal(
        extraction, proposal, job.guidance, settings.physics, settings.correction, semantics=semantics
    )
    return proposal, tuple(calls), (*findings, *corrected)


METHOD = DeclaredMethod(
    Method.ASSET2SIM,
    "ours",
    "one answer of a model, asked about again where it is doubtful, with our rules and the closed loop",
    by_rules,
    place=40,
    rules=True,
    colour="#0072B2",
)
