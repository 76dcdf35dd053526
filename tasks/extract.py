"""Validate an asset's own joints and physics before anything is proposed."""

from asset2sim.assets.extract import Extraction
from asset2sim.validation.passage import find_blocked_joints
from asset2sim.validation.stated import stated_findings
from schemas.finding import Finding
from schemas.settings import PhysicsSettings


def validate_authored(extraction: Extraction, settings: PhysicsSettings) -> tuple[Extraction, tuple[Finding, ...]]:
    """The extraction with joints corrected where geometry is unambiguous, and a warning for every implausible value.

    To measure an asset as authored use only the findings: its file does not have these corrections.
    """
    mended, passages = find_blocked_joints(extraction)
    return mended, (*stated_findings(extraction, settings), *passages)
