"""What a model proposes against what anybody can tell is wrong: units, size, and the requested state.

Before ``validate``, which completes and bounds whatever comes, and which the search calls again for other positions.
"""

from asset2sim.assets.extract import Extraction
from asset2sim.models.language.object_info import ObjectInfo, read_prompt
from asset2sim.models.prompts import synthesis_request
from asset2sim.validation.asked_state import with_asked_state
from asset2sim.validation.misread_units import in_right_units
from asset2sim.validation.notes import Notes
from asset2sim.validation.size import with_sensible_size
from schemas.finding import Finding
from schemas.overlay import Overlay
from schemas.settings import PhysicsSettings


def sensible(
    extraction: Extraction, overlay: Overlay, guidance: str | None, settings: PhysicsSettings, *, semantics: bool = True
) -> tuple[Overlay, tuple[Finding, ...]]:
    """The proposal with its evident mistakes put right, and a finding for each; a second time it changes nothing.

    Without ``semantics`` only units are looked at: what an object is and what its parts are called is withheld then.
    """
    notes, words = Notes(), guidance or ""
    overlay = in_right_units(extraction.features, overlay, notes)
    if semantics:
        info = object_of(extraction, guidance)
        overlay = with_sensible_size(info, words, overlay, notes)
        overlay = with_asked_state(info, words, overlay, settings, notes)
    return overlay, tuple(notes.findings)


def object_of(extraction: Extraction, guidance: str | None) -> ObjectInfo:
    """What the model was told of the object, read as the offline prior reads it."""
    request = synthesis_request(extraction.features, guidance, extraction.closed_size, extraction.link_centers)
    return ObjectInfo.from_json(read_prompt(request.text)[0])
