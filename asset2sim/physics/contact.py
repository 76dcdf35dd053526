"""Contact friction of a named material."""

from asset2sim.models.language.tables import materials
from schemas.settings import PhysicsSettings


def contact_friction(material: str | None, settings: PhysicsSettings) -> float:
    """Coulomb coefficient of a contact material on a table top; the settings' default for none and for unknown ones."""
    known = materials().get((material or "").strip().lower())
    return settings.contact_friction if known is None else known.friction
