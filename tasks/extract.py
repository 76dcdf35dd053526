"""What an asset states that is wrong by itself, looked at before anything is proposed: one entrance for all of it."""

from asset2sim.assets.extract import Extraction
from asset2sim.validation.passage import check_passages
from asset2sim.validation.stated import stated_findings
from schemas.finding import Finding
from schemas.settings import PhysicsSettings


def check_authored(extraction: Extraction, settings: PhysicsSettings) -> tuple[Extraction, tuple[Finding, ...]]:
    """The extraction with its joints mended where geometry leaves no doubt, and a warning for all that makes no sense.

    Whoever judges an asset as it came wants the findings alone: what is mended here is not in its file.
    """
    mended, passages = check_passages(extraction)
    return mended, (*stated_findings(extraction, settings), *passages)
