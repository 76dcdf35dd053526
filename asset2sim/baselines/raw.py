"""Raw: the asset unchanged, measured as it came."""

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import DOTTED, DeclaredMethod, ProposalJob, Proposed
from schemas.vocabulary import Method


def no_proposal(job: ProposalJob, extraction: Extraction) -> Proposed:
    """No proposal."""
    return None, (), ()


METHOD = DeclaredMethod(
    Method.RAW, "as it came", "the asset unchanged", no_proposal, place=80, asks=False, colour="#7F7F7F", dashes=DOTTED
)
