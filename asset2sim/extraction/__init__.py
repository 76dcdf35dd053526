"""Extract: asset folder → ``Features``. Reads only; the kinematics stay as authored (paper, "Extract")."""

from asset2sim.extraction.asset import Extraction, extract
from asset2sim.extraction.links import LinkGeometry

__all__ = ["Extraction", "LinkGeometry", "extract"]
