"""The views that a method shows to its model."""

from asset2sim.extraction import Extraction
from asset2sim.models.priors_known import is_prior
from asset2sim.views import png_bytes, render_views
from schemas.request import LabelledImage
from schemas.settings import Settings


def labelled_views(extraction: Extraction, settings: Settings) -> dict[str, LabelledImage]:
    """View name → picture of the asset as authored, for models that might look at them; empty for those that cannot."""
    if is_prior(settings.model.model):
        return {}
    views = render_views(extraction.urdf, {}, settings.views)
    return {name: LabelledImage(label=name, png=png_bytes(image)) for name, image in views.items()}
