"""Whether an asset's lengths are metres already, and which of its authored masses a body of that size can have."""

import math
from collections.abc import Collection, Sequence
from contextlib import suppress
from statistics import median

import numpy as np
from lxml.etree import _Element as Element

from asset2sim.guidance.amounts import LARGEST_M
from asset2sim.physics.inertia import tensor_of
from schemas.authored import KEPT_AS_ASKED, MASSES_FIT, UNLIKE_UNITS
from schemas.features import LinkFeatures
from schemas.vocabulary import Keep, VolumeSource

LEAST_DENSITY_KG_M3, MOST_DENSITY_KG_M3 = 5.0, 12_000.0
"""Density of a link over its hull, kg/m³: a cabinet of thin walls has 20, lead 11,300."""

LEAST_MATERIAL_KG_M3, THICKEST_PLATE_M = 60.0, 0.03
"""Density of what a plate is made of, kg/m³ (foams for building have 15 to 50, cardboard and balsa 100), and the
thickness, m, up to which a part that is drawn solid is one: thicker ones may stand for what is hollow."""

OWN_INERTIA = 3.0
"""Factor within which an inertia is that of its shape: weighed ones of other hands lie within 0.8 and 1.3, those that
were written for all parts are off by ten and more."""


UNLIKE_VOLUMES = 2.0
"""Factor between the hulls of parts from which they cannot weigh and turn alike."""

GRID_M, ON_GRID_M = 1e-4, 1e-7
"""Step of the lengths that people draw boxes and cylinders with in metres: a millimetre, a fraction of an inch (0.9144
is a yard); and how near to it floating point leaves them. Of lengths of anything else one in 500 comes so near."""
COARSE_M = 0.1
"""Step of lengths that say nothing: a unit cube and its halves have them, too."""
LEAST_LENGTHS, LEAST_OF_SHAPES, DRAWN_SHARE = 4, 2, 0.9
"""Different lengths, one of them finer than ``COARSE_M``, how many of them are of shapes rather than of where shapes
and joints stand, and the share on the grid, from which a drawing in metres is told: bringing an object to one size
leaves no round lengths."""
DRAWN = "its boxes and cylinders are drawn in tenths of a millimetre"
STATED_UNIT = "its meshes state their unit of length"
UNITS, OF_UNIT = (1.0, 2.0), 1e-3
"""Longest edge or diagonal of what was brought to one size, and the share by which it is off."""
NEAR_UNIT = 0.01
"""The share by which it may be off where parts have moved since, as a door that was ajar."""
UNIT_SPHERE_M = (1.5, 3.0)
"""Diagonal with all joints at zero of what was brought into a sphere of radius 1 in another state, with a tenth to
spare: 1.67 to 2.76 in PartNet-Mobility."""


def metric_evidence(
    metric_format: str,
    links: Sequence[LinkFeatures],
    kept: Keep = Keep.PLAUSIBLE,
    robot: Element | None = None,
    size: Sequence[float] = (),
    rest_size: Sequence[float] = (),
    *,
    unit_stated: bool = False,
) -> str:
    """The reason to take the authored lengths for metres; empty where there is none.

    ``metric_format`` is the name of a format that has metres, empty for one that may have anything. Metres has also a
    URDF whose masses fit its volumes: at ten times its size an object of those masses would be a thousand times too
    light; one of boxes, cylinders and spheres (of ``robot``) with lengths in whole tenths of a millimetre, unless it
    has meshes, too, and its ``size`` is of something that was brought to one; one whose meshes state their unit of
    length (``unit_stated``), unless it has such a size; and, the weakest, one whose ``size`` and
    ``rest_size`` (edges in m, closed and with all joints at zero) are none to which anything is brought. The size is
    ``kept`` as the user asks: whatever it is, where it is plausible, or not at all.
    """
    if kept is not Keep.PLAUSIBLE:
        return KEPT_AS_ASKED if kept is Keep.ALL else ""
    unweighed = placeholders(links)
    weighed = [link for link in links if link.name not in unweighed]
    densities = [density for link in weighed if (density := authored_density(link)) is not None]
    fits = bool(densities) and LEAST_DENSITY_KG_M3 <= median(densities) <= MOST_DENSITY_KG_M3
    if metric_format:
        return f"lengths of {metric_format} are metres{f', and {MASSES_FIT}' if fits else ''}"
    if fits:
        return MASSES_FIT
    # Meshes are brought to one size, and boxes around them with them; nobody does so to what is written in numbers.
    if robot is not None and is_drawn_in_metres(robot) and (robot.find("link//mesh") is None or not is_unit(size)):
        return DRAWN
    if unit_stated and not any(is_unit(edges, NEAR_UNIT) for edges in (size, rest_size)):
        return STATED_UNIT
    low, high = UNIT_SPHERE_M
    apart = not any(is_unit(edges, NEAR_UNIT) or low <= math.hypot(*edges) <= high for edges in (size, rest_size))
    return UNLIKE_UNITS if apart and 0.0 < max(size, default=0.0) <= LARGEST_M else ""


def is_drawn_in_metres(robot: Element) -> bool:
    """Whether the lengths of a URDF's boxes, cylinders, capsules and spheres are those of a drawing; of few, with the
    offsets of its shapes and joints."""
    found = set[float]()
    for geometry in robot.iterfind("link//geometry"):
        for shape in geometry.iterchildren("box", "cylinder", "capsule", "sphere"):
            edges, diameter = str(shape.get("size", "")).split(), shape.get("radius")
            try:
                lengths = [float(word) for word in (*edges, *filter(None, (shape.get("length"),)))]
                found.update(lengths if diameter is None else (*lengths, 2.0 * float(diameter)))
            except ValueError:
                continue  # reading its geometry says what is wrong
    found = {round(length, 9) for length in found if length > 0.0}
    if LEAST_OF_SHAPES <= len(found) < LEAST_LENGTHS:
        found |= offsets_of(robot)
    drawn = [length for length in found if off_grid(length, GRID_M) <= ON_GRID_M]
    fine = any(off_grid(length, COARSE_M) > ON_GRID_M for length in drawn)
    return fine and len(found) >= LEAST_LENGTHS and len(drawn) >= DRAWN_SHARE * len(found)


def offsets_of(robot: Element) -> set[float]:
    """The offsets, m, of a URDF's shapes in their links and of its joints, along each axis; zero is none."""
    found = set[float]()
    for origin in (*robot.iterfind("joint/origin"), *robot.iterfind("link/*/origin")):
        above = origin.getparent()
        if above is not None and above.tag != "inertial":
            with suppress(ValueError):  # reading it says what is wrong
                found.update(round(abs(float(word)), 9) for word in str(origin.get("xyz", "")).split())
    return found - {0.0}


def off_grid(length: float, step: float) -> float:
    """The distance of a length from a whole number of steps."""
    return abs(length - step * round(length / step))


def is_unit(size: Sequence[float], slack: float = OF_UNIT) -> bool:
    """Whether a box of these edges was brought to a longest edge or a diagonal of 1 or 2."""
    lengths = max(size, default=0.0), math.hypot(*size)
    return any(abs(length / unit - 1.0) <= slack for length in lengths for unit in UNITS)


def authored_density(link: LinkFeatures) -> float | None:
    """Authored mass over the volume of the hull at scale 1, kg/m³; None for a link without either."""
    if link.inertial is None or link.inertial.mass_kg <= 0.0 or link.hull_volume_m3 <= 0.0:
        return None
    return link.inertial.mass_kg / link.hull_volume_m3


def is_plate_of_nothing(link: LinkFeatures) -> bool:
    """Whether a part is drawn as solid plates that no material of its authored mass is as light as."""
    if link.inertial is None or link.volume_source is not VolumeSource.SIGNED or link.area_m2 <= 0.0:
        return False
    thickness = 2.0 * link.volume_m3 / link.area_m2
    return thickness <= THICKEST_PLATE_M and link.inertial.mass_kg < LEAST_MATERIAL_KG_M3 * link.volume_m3


def placeholders(links: Sequence[LinkFeatures], tied: Collection[str] = ()) -> frozenset[str]:
    """The links that have one and the same mass and inertia though all do, or though one is far larger than another, as
    exporters write where nothing was weighed; and those that have SDF's default, 1 kg and 1 kg·m² about each axis.
    Parts that are alike have it, too: theirs is that of their shape; and ``tied`` ones, which follow another's joint,
    are made light by their authors."""
    stated = [link for link in links if link.inertial is not None and link.inertial.mass_kg > 0.0 and link.has_geometry]
    groups: dict[tuple[float, ...], list[LinkFeatures]] = {}
    for link in stated:
        if link.inertial is not None:
            numbers = (link.inertial.mass_kg, *link.inertial.inertia)
            groups.setdefault(tuple(round(number, 9) for number in numbers), []).append(link)
    found = {link.name for link in stated if has_default_inertial(link)}
    for every in groups.values():
        group = every if len(every) == len(stated) else [link for link in every if link.name not in tied]
        volumes = [link.hull_volume_m3 for link in group]
        unlike = len(group) == len(stated) or max(volumes, default=0.0) > UNLIKE_VOLUMES * min(volumes, default=0.0)
        if len(group) > 1 and unlike and not all(map(has_own_inertia, group)):
            found.update(link.name for link in group)
    return frozenset(found)


def has_default_inertial(link: LinkFeatures) -> bool:
    """Whether a link's stated mass and inertia are those that SDF gives to a link that states none, and not its own."""
    own = link.inertial
    default = own is not None and own.mass_kg == 1.0 and np.allclose(tensor_of(own.inertia), np.eye(3))
    return default and not has_own_inertia(link)


def has_own_inertia(link: LinkFeatures) -> bool:
    """Whether a link's stated inertia is near what its mass has in its shape."""
    shape = tensor_of(link.unit_inertia).trace()
    if link.inertial is None or link.inertial.mass_kg <= 0.0 or shape <= 0.0:
        return False
    ratio = float(tensor_of(link.inertial.inertia).trace() / (link.inertial.mass_kg * shape))
    return 1.0 / OWN_INERTIA <= ratio <= OWN_INERTIA
