"""VLM-direct: one answer from all five views, taken as it is (paper, baselines)."""

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import DeclaredMethod, ProposalJob, Proposed
from asset2sim.models.ask_overlay import ask_overlay
from asset2sim.models.prompts import DIRECT, overlay_request
from asset2sim.render.canonical import labelled_views
from schemas.vocabulary import Method


def direct(job: ProposalJob, extraction: Extraction) -> Proposed:
    """One answer from all five views. Raises SynthesisError."""
    images = tuple(labelled_views(extraction, job.settings).values())
    request = overlay_request(DIRECT, extraction.features, job.ref.prompt, images)
    return ask_overlay(request, extraction.features, job.ask)


METHOD = DeclaredMethod(
    Method.DIRECT, "direct VLM", "one answer of a model, taken as it is", direct, place=30, colour="#D55E00"
)
