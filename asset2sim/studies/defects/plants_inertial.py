"""Defects of masses and inertias."""

from pathlib import Path

import numpy as np

from asset2sim.studies.defects.planting import (
    Plant,
    PlantedChange,
    Target,
    edited,
    edited_part,
    named,
    numbers,
    part,
    scaled,
    write,
)

POINT_KG_M2 = 1e-12
"""Moment of inertia of a link that its author took for a point mass, kg·m²."""
FAR_M = 3.0
"""Distance of the planted centre of mass from the clean one, m."""


def mass_times(factor: float) -> Plant:
    """A link's mass times ``factor``, its inertia left: a unit or a decimal point is wrong."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        with edited_part(folder, "link", at.link, "inertial/mass") as mass:
            change = scaled(mass, "value", factor)
        return PlantedChange(f"mass of '{at.link}' from {change} kg", links=(at.link,))

    return plant


def mass_not_a_number(folder: Path, at: Target) -> PlantedChange:
    """A link's mass is NaN: an exporter divided by a volume of zero."""
    with edited_part(folder, "link", at.link, "inertial/mass") as mass:
        mass.set("value", "nan")
    return PlantedChange(f"mass of '{at.link}' is nan", links=(at.link,))


def inertial_missing(folder: Path, at: Target) -> PlantedChange:
    """One link without an inertial among others that have one."""
    with edited(folder) as robot:
        link = named(robot, "link", at.link)
        link.remove(part(link, "inertial"))
    return PlantedChange(f"'{at.link}' has no inertial", links=(at.link,))


def inertia_of_a_point(folder: Path, at: Target) -> PlantedChange:
    """A link with a mass and hardly any inertia."""
    return moments(folder, at, (POINT_KG_M2,) * 3)


def inertia_impossible(folder: Path, at: Target) -> PlantedChange:
    """A link with one moment above the sum of the others."""
    with edited_part(folder, "link", at.link, "inertial/inertia") as inertia:
        size = sum(float(inertia.get(key, "0")) for key in ("ixx", "iyy", "izz"))
    return moments(folder, at, (0.1 * size, 0.1 * size, 0.8 * size))


def inertia_negative(folder: Path, at: Target) -> PlantedChange:
    """A link with a negative moment: a mesh with its faces inside out was integrated."""
    with edited_part(folder, "link", at.link, "inertial/inertia") as inertia:
        change = scaled(inertia, "ixx", -1.0)
    return PlantedChange(f"ixx of '{at.link}' from {change} kg·m²", links=(at.link,))


def moments(folder: Path, at: Target, values: tuple[float, float, float]) -> PlantedChange:
    """Write a diagonal inertia."""
    with edited_part(folder, "link", at.link, "inertial/inertia") as inertia:
        for key in ("ixy", "ixz", "iyz"):
            write(inertia, key, 0.0)
        for key, value in zip(("ixx", "iyy", "izz"), values, strict=True):
            write(inertia, key, value)
    return PlantedChange(
        f"moments of '{at.link}' set to {', '.join(f'{value:.3g}' for value in values)} kg·m²", links=(at.link,)
    )


def inertia_times(factor: float) -> Plant:
    """A link's whole inertia times ``factor``: it is stated in other units."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        with edited_part(folder, "link", at.link, "inertial/inertia") as inertia:
            for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
                scaled(inertia, key, factor)
        return PlantedChange(f"inertia of '{at.link}' times {factor:g}", links=(at.link,))

    return plant


def centre_outside(folder: Path, at: Target) -> PlantedChange:
    """A link's centre of mass far from the link: it is stated in another frame."""
    with edited_part(folder, "link", at.link, "inertial/origin") as origin:
        write(origin, "xyz", numbers(origin, "xyz") + np.array([0.0, 0.0, FAR_M]))
    return PlantedChange(f"centre of mass of '{at.link}' moved {FAR_M:g} m away", links=(at.link,))
