"""Asset2Sim: a model proposes, rules correct, complete and bound, a simulator decides."""

from collections.abc import Mapping

from asset2sim.assets.extract import Extraction
from asset2sim.assets.rest_overlaps import rest_overlaps
from asset2sim.baselines.declared_method import DeclaredMethod, ProposalJob, Proposed
from asset2sim.models.ask_overlay import ask_overlay
from asset2sim.models.prompts import synthesis_request
from asset2sim.render.marked import question_pictures
from asset2sim.validation.doubts import ObjectQuestion
from asset2sim.validation.overrides import stated_things
from asset2sim.validation.reconsider import reconsidered
from asset2sim.validation.sanity import sensible
from asset2sim.validation.support import forced_support
from schemas.model_names import is_prior
from schemas.vocabulary import Method


def by_rules(
    job: ProposalJob, extraction: Extraction, aliases: Mapping[str, str] | None = None, *, semantics: bool = True
) -> Proposed:
    """A model's answer, asked about again where it is doubtful, and corrected as far as settings say. Raises
    SynthesisError.

    Pictures are labelled with ``aliases`` where there are any; without ``semantics`` no kind of object is known.
    """
    settings, words, features = job.settings, job.ref.prompt, extraction.features
    images = question_pictures(extraction, settings, aliases)
    # The offline prior reads no overlaps, and to find them takes longer than all else that it does.
    overlaps = () if is_prior(settings.model.model) else rest_overlaps(extraction)
    request = synthesis_request(features, words, images, overlaps)
    first = ask_overlay(request, features, job.ask)
    forced = forced_support(job.ref.support or settings.support, extraction)
    stated = () if job.ref.overrides is None else stated_things(job.ref.overrides)
    question = ObjectQuestion(extraction, job.guidance, job.source, settings, forced, stated)
    proposal, calls, findings = reconsidered(request, first, question, job.ask)
    proposal, corrected = sensible(
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
