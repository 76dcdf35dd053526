"""Extract: asset folder → features and geometry (paper, "Extract"). Reads only."""

from dataclasses import dataclass

from asset2sim.assets.extract import Extraction, extract
from asset2sim.assets.meshes.shape_cache import SHAPE_CACHE
from asset2sim.validation.passage import find_blocked_joints
from asset2sim.validation.stated import stated_findings
from schemas.finding import Finding
from schemas.settings import PhysicsSettings
from tasks.job import AssetJob
from tasks.progress import StageResult


@dataclass(frozen=True, kw_only=True)
class Extracted(StageResult):
    """The asset as later stages see it."""

    extraction: Extraction


def extract_asset(job: AssetJob, *, correct_joints: bool) -> Extracted:
    """The asset, its joints corrected by our rules or, for methods without rules, as authored. Raises AssetError."""
    authored = extract(job.ref, job.out / SHAPE_CACHE)
    corrected, told = validate_authored(authored, job.settings.physics)
    extraction = corrected if correct_joints else authored
    return Extracted(extraction=extraction, features=extraction.features, findings=(*authored.findings, *told))


def validate_authored(extraction: Extraction, settings: PhysicsSettings) -> tuple[Extraction, tuple[Finding, ...]]:
    """The extraction with joints corrected where geometry is unambiguous, and a warning for every implausible value.

    To measure an asset as authored use only the findings: its file does not have these corrections.
    """
    corrected, blocked = find_blocked_joints(extraction)
    return corrected, (*stated_findings(extraction, settings), *blocked)
