"""Whether an asset's lengths are metres already, and which of its authored masses a body of that size can have."""

from collections.abc import Sequence
from statistics import median

from schemas.authored import KEPT_AS_ASKED
from schemas.features import LinkFeatures
from schemas.vocabulary import Keep

LEAST_DENSITY_KG_M3, MOST_DENSITY_KG_M3 = 5.0, 12_000.0
"""Density of a link over its hull, kg/m³: a cabinet of thin walls has 20, lead 11,300."""


def metric_evidence(metric_format: str, links: Sequence[LinkFeatures], kept: Keep = Keep.PLAUSIBLE) -> str:
    """The reason to take the authored lengths for metres; empty where there is none.

    ``metric_format`` is the name of a format that has metres, empty for one that may have anything. Metres has also a
    URDF whose masses fit its volumes: at ten times its size an object of those masses would be a thousand times too
    light. The size is ``kept`` as the user asks: whatever it is, where it is plausible, or not at all.
    """
    if kept is not Keep.PLAUSIBLE:
        return KEPT_AS_ASKED if kept is Keep.ALL else ""
    if metric_format:
        return f"lengths of {metric_format} are metres"
    densities = [density for link in links if (density := authored_density(link)) is not None]
    if densities and not are_placeholders(links) and LEAST_DENSITY_KG_M3 <= median(densities) <= MOST_DENSITY_KG_M3:
        return "its masses fit its volumes in metres"
    return ""


def authored_density(link: LinkFeatures) -> float | None:
    """Authored mass over the volume of the hull at scale 1, kg/m³; None for a link without either."""
    if link.inertial is None or link.inertial.mass_kg <= 0.0 or link.hull_volume_m3 <= 0.0:
        return None
    return link.inertial.mass_kg / link.hull_volume_m3


def are_placeholders(links: Sequence[LinkFeatures]) -> bool:
    """Whether several links have one and the same mass and inertia, as exporters write where nothing was weighed."""
    stated = [link.inertial for link in links if link.inertial is not None and link.has_geometry]
    return len(stated) > 1 and len({(item.mass_kg, item.inertia) for item in stated}) == 1
