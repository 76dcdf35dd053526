"""The colour by which each link is known in pictures and in words."""

from schemas.features import Features

PALETTE: dict[str, tuple[float, float, float]] = {
    "beige": (0.87, 0.80, 0.66), "red": (0.90, 0.16, 0.16), "blue": (0.16, 0.36, 0.92), "green": (0.10, 0.62, 0.20),
    "yellow": (0.98, 0.86, 0.10), "purple": (0.56, 0.20, 0.74), "orange": (0.98, 0.52, 0.06),
    "turquoise": (0.10, 0.78, 0.78), "pink": (0.98, 0.45, 0.72), "brown": (0.50, 0.30, 0.12),
    "lime": (0.62, 0.92, 0.16), "navy": (0.08, 0.12, 0.42), "lavender": (0.74, 0.66, 0.98),
    "maroon": (0.50, 0.04, 0.14), "teal": (0.02, 0.42, 0.42), "salmon": (0.98, 0.64, 0.54),
}  # fmt: skip
"""Colour name → sRGB, 0 to 1; the first is for the largest link."""
OTHERS = "grey"
"""Name of the colour of all further links, which are not named in pictures."""
GREY = (0.66, 0.66, 0.68)


def mark_names(features: Features) -> dict[str, str]:
    """Link → the name of its colour, the links with the largest outside first; without those that have no geometry."""
    shaped = [link for link in features.links if link.has_geometry]
    ranked = sorted(shaped, key=lambda link: -max(link.outer_m2, link.area_m2))
    names = [*PALETTE, *[OTHERS] * max(len(ranked) - len(PALETTE), 0)]
    return {link.name: name for link, name in zip(ranked, names, strict=False)}
