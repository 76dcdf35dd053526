"""Coding agent: a model with tools, without our structure (paper, baselines)."""

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import DeclaredMethod, ProposalJob, Proposed
from schemas.vocabulary import Method


def by_agent(job: ProposalJob, extraction: Extraction) -> Proposed:
    """The agent's last submission. Raises SynthesisError."""
    from lab.methods.agent.run import run_agent  # its tools load engines, which no other method needs here

    return run_agent(job, extraction)


METHOD = DeclaredMethod(
    Method.AGENT,
    "coding agent",
    "a model with tools and no structure of ours",
    by_agent,
    place=50,
    colour="#CC79A7",
    dashes=(0, (3, 1, 1, 1)),
)
