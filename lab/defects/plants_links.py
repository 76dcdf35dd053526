"""Defects of links: masses and inertias, collision meshes, and lengths."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from lxml.etree import _Element as Element

from asset2sim.assets.hulls import obj_text
from asset2sim.physics.arrays import Array
from lab.defects.planting import (
    Plant,
    PlantedChange,
    Target,
    above,
    changed,
    collision_files,
    edited,
    named,
    numbers,
    read_obj,
    rewrite_obj,
    scaled,
    write,
)

MILLIMETRES = 1000.0
AWAY_M = 1.0
"""Distance of planted collision meshes from the visual ones, m."""
POINT_KG_M2 = 1e-12
"""Moment of inertia of a link that its author took for a point mass, kg·m²."""
SIX = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
"""Terms of an inertia, the moments first."""


def mass_times(factor: float) -> Plant:
    """A link's mass times ``factor``, its inertia left: a unit or a decimal point is wrong."""
    return changed("link", "inertial/mass", lambda mass: f"has its mass from {scaled(mass, 'value', factor)} kg")


def mass_not_a_number(mass: Element) -> str:
    """A link's mass is NaN: an exporter divided by a volume of zero."""
    mass.set("value", "nan")
    return "has a mass of nan"


def inertial_missing(inertial: Element) -> str:
    """One link without an inertial among others that have one."""
    above(inertial).remove(inertial)
    return "has no inertial"


def inertia_impossible(inertia: Element) -> str:
    """A link with one moment above the sum of the others."""
    size = sum(float(inertia.get(key, "0")) for key in SIX[:3])
    return moments(inertia, (0.1 * size, 0.1 * size, 0.8 * size))


def moments(inertia: Element, values: tuple[float, float, float]) -> str:
    """Write a diagonal inertia."""
    for key, value in zip(SIX, (*values, 0.0, 0.0, 0.0), strict=True):
        write(inertia, key, value)
    return f"has moments of {', '.join(f'{value:.3g}' for value in values)} kg·m²"


def inertia_times(factor: float, keys: Sequence[str] = SIX) -> Plant:
    """A link's inertia, or some terms of it, times ``factor``: other units, or a mesh with its faces inside out."""

    def edit(inertia: Element) -> str:
        for key in keys:
            scaled(inertia, key, factor)
        return f"has {', '.join(keys)} times {factor:g}"

    return changed("link", "inertial/inertia", edit)


inertia_of_a_point = changed("link", "inertial/inertia", lambda inertia: moments(inertia, (POINT_KG_M2,) * 3))
"""A link with a mass and hardly any inertia."""
inertia_negative = inertia_times(-1.0, ("ixx",))
"""A link with a negative moment."""


def centre_moved_by(x: float, z: float) -> Plant:
    """A link's centre of mass moved by (x, 0, z) metres: it is stated in another frame, or is another part's."""

    def edit(origin: Element) -> str:
        write(origin, "xyz", numbers(origin, "xyz") + np.array([x, 0.0, z]))
        return f"has its centre of mass moved by ({x:g}, 0, {z:g}) m"

    return changed("link", "inertial/origin", edit)


def rewritten(
    said: str,
    vertices: Callable[[Array], Array] = np.asarray,
    faces: Callable[[Array], Array] = np.asarray,
    *,
    all_meshes: bool = False,
) -> Plant:
    """A link's largest collision mesh, or all of them, with other (n, 3) vertices or (k, 3) vertex numbers from 1."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        paths = collision_files(folder, at.link) if all_meshes else [largest(folder, at.link)]
        for path in paths:
            rewrite_obj(path, vertices, faces)
        meshes = "collision meshes" if all_meshes else paths[0].name
        return PlantedChange(f"{meshes} of '{at.link}' {said}", links=(at.link,))

    return plant


def pressed(points: Array) -> Array:
    """(n, 3) points pressed to the plane across the shortest edge of their box."""
    return np.where(np.arange(3) == int(np.argmin(np.ptp(points, axis=0))), points.mean(axis=0), points)


flat_collision = rewritten("is flat", pressed)
"""A link's largest collision mesh pressed to a plane."""
collision_in_millimetres = rewritten("are in millimetres", lambda points: points * MILLIMETRES, all_meshes=True)
"""A link's collision meshes in millimetres."""
collision_elsewhere = rewritten(
    f"lie {AWAY_M:g} m away", lambda points: np.add(points, (AWAY_M, 0.0, 0.0)), all_meshes=True
)
"""A link's collision meshes away from the visual ones: they were exported in another frame."""
collision_not_a_number = rewritten(
    "has a vertex that is nan", lambda points: np.where(np.arange(len(points))[:, None] == 0, np.nan, points)
)
"""A collision mesh with vertices that are NaN."""
collision_inside_out = rewritten("are inside out", faces=lambda triangles: triangles[:, ::-1], all_meshes=True)
"""A link's collision meshes with their faces turned inwards."""
collision_with_holes = rewritten("has holes", faces=lambda triangles: triangles[~(triangles == 1).any(axis=1)])
"""A collision mesh without the faces around one of its corners."""


def collision_missing(folder: Path, at: Target) -> PlantedChange:
    """A collision mesh whose file is not there."""
    path = largest(folder, at.link)
    path.unlink()
    return PlantedChange(f"{path.name} of '{at.link}' is not there", links=(at.link,))


def inside_filled(folder: Path, at: Target) -> PlantedChange:
    """One hull over all of a link's collision meshes: what it encloses is solid."""
    paths = collision_files(folder, at.link)
    text = obj_text(np.vstack([read_obj(path)[0] for path in paths]))
    if text is None:
        raise KeyError(f"link '{at.link}' is flat")
    paths[0].write_text(text, encoding="ascii")
    with edited(folder) as robot:
        link = named(robot, "link", at.link)
        for extra in link.findall("collision")[1:]:
            link.remove(extra)
    return PlantedChange(f"one hull stands for {len(paths)} collision meshes of '{at.link}'", links=(at.link,))


def all_in_millimetres(folder: Path, at: Target) -> PlantedChange:
    """Every length of the URDF in millimetres; masses and inertias as they were."""
    with edited(folder) as robot:
        for origin in robot.iter("origin"):
            if origin.get("xyz") is not None:
                write(origin, "xyz", numbers(origin, "xyz") * MILLIMETRES)
        for mesh in robot.iter("mesh"):
            mesh.set("scale", str(mesh.get("scale", "1 1 1")))
            write(mesh, "scale", numbers(mesh, "scale") * MILLIMETRES)
        for joint in robot.findall("joint"):
            limit = joint.find("limit")
            if joint.get("type") == "prismatic" and limit is not None:
                for key in ("lower", "upper"):
                    write(limit, key, numbers(limit, key) * MILLIMETRES)
    return PlantedChange("every length is in millimetres")


def largest(folder: Path, link: str) -> Path:
    """The collision mesh of a link whose box is the largest."""
    return max(collision_files(folder, link), key=lambda path: float(np.ptp(read_obj(path)[0], axis=0).prod()))
