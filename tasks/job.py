"""One asset to refine, as a run hands it to the stages."""

from dataclasses import dataclass
from pathlib import Path

from asset2sim.baselines.declared_method import known_methods
from schemas.asset import AssetRef
from schemas.guidance import NOTHING_ASKED, Guidance
from schemas.model_names import is_prior
from schemas.request import ModelAsk
from schemas.settings import Settings
from schemas.vocabulary import Source


@dataclass(frozen=True)
class AssetJob:
    """One asset, the output folder, the run's settings, the one way to ask a model, and, once the asset is extracted,
    what its prompt asks of it."""

    ref: AssetRef
    out: Path
    settings: Settings
    ask: ModelAsk
    guidance: Guidance = NOTHING_ASKED

    @property
    def source(self) -> Source:
        """Source of the numbers that the method proposes: an expert, a rule, a prior or a model."""
        stated = known_methods()[self.settings.method].source
        return stated or (Source.PRIOR if is_prior(self.settings.model.model) else Source.MODEL)
