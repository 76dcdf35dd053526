"""Convert densities that were given in g/cm³ to kg/m³, and walls in millimetres to metres."""

from schemas.features import Features, LinkFeatures
from schemas.finding import Notes
from schemas.overlay import LinkProposal, Overlay

LEAST_DENSITY_KG_M3 = 10.0
"""Density below which a number is none in kg/m³: foamed plastics have 10 and more, and solids in g/cm³ up to 9."""
KG_M3_PER_G_CM3 = 1000.0
THICKEST_M = 0.1
"""Wall from which on a number is none in metres, where the whole link is thinner ..."""
THINNEST_M = 1e-4
"""... and that of a foil, which a wall has at least."""
MM_PER_M = 1000.0


def convert_link_units(features: Features, overlay: Overlay, notes: Notes) -> Overlay:
    """The overlay with every density and wall converted that can only be in g/cm³ or millimetres; a finding for each.
    What may be either is kept: its unit cannot be told."""
    links = {link.name: link for link in features.links}
    proposals = tuple(
        converted(item, links[item.name], overlay.scale, notes) if item.name in links else item
        for item in overlay.links
    )
    return overlay if proposals == overlay.links else overlay.model_copy(update={"links": proposals})


def converted(item: LinkProposal, link: LinkFeatures, scale: float, notes: Notes) -> LinkProposal:
    """One link's proposal with its density in kg/m³ and its wall in m."""
    changes: dict[str, float] = {}
    density, wall = item.density_kg_m3, item.wall_m
    if density is not None and density < LEAST_DENSITY_KG_M3:
        right = density * KG_M3_PER_G_CM3
        changes["density_kg_m3"] = right
        message = f"link '{item.name}': no solid has {density:.4g} kg/m³; taken for g/cm³: {right:.4g} kg/m³"
        notes.warn("density_in_g_cm3", message, link=item.name, value=density, limit=right)
    thinnest = min(link.box_size) * scale
    if wall is not None and wall > max(THICKEST_M, thinnest) and wall / MM_PER_M >= THINNEST_M:
        changes["wall_m"] = wall / MM_PER_M
        message = (
            f"link '{item.name}': a wall of {wall:.4g} m is thicker than the link ({thinnest:.3g} m); taken for "
            f"millimetres: {changes['wall_m']:.4g} m"
        )
        notes.warn("wall_in_millimetres", message, link=item.name, value=wall, limit=changes["wall_m"])
    return item.model_copy(update=changes)
