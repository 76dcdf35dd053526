"""VLM-direct: one answer from all pictures at once, taken as it is (paper, baselines)."""

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import DeclaredMethod, ProposalJob, Proposed
from asset2sim.baselines.ours import first_question
from asset2sim.models.ask_overlay import ask_overlay
from asset2sim.models.prompts import DIRECT
from schemas.vocabulary import Method


def direct(job: ProposalJob, extraction: Extraction) -> Proposed:
    """One answer from all pictures at once. Raises SynthesisError."""
    return ask_overlay(first_question(DIRECT, job, extraction), extraction.features, job.ask)


METHOD = DeclaredMethod(
    Method.DIRECT, "direct VLM", "one answer of a model, taken as it is", direct, place=30, colour="#D55E00"
)
