"""Defects of meshes and of lengths."""

from pathlib import Path

import numpy as np

from asset2sim.assets.hulls import obj_text
from asset2sim.studies.defects.planting import (
    PlantedChange,
    Target,
    collision_files,
    edited,
    named,
    numbers,
    read_obj,
    rewrite_obj,
    write,
)

MILLIMETRES = 1000.0
AWAY_M = 1.0
"""Distance of planted collision meshes from the visual ones, m."""


def flat_collision(folder: Path, at: Target) -> PlantedChange:
    """A link's largest collision mesh pressed to a plane."""

    def pressed(points: np.ndarray) -> np.ndarray:
        thin = int(np.argmin(np.ptp(points, axis=0)))
        return np.where(np.arange(3) == thin, points.mean(axis=0), points)

    path = largest(folder, at.link)
    rewrite_obj(path, vertices=pressed)
    return PlantedChange(f"{path.name} of '{at.link}' is flat", links=(at.link,))


def collision_in_millimetres(folder: Path, at: Target) -> PlantedChange:
    """A link's collision meshes in millimetres."""
    for path in collision_files(folder, at.link):
        rewrite_obj(path, vertices=lambda points: points * MILLIMETRES)
    return PlantedChange(f"collision meshes of '{at.link}' are in millimetres", links=(at.link,))


def collision_elsewhere(folder: Path, at: Target) -> PlantedChange:
    """A link's collision meshes away from the visual ones: they were exported in another frame."""
    for path in collision_files(folder, at.link):
        rewrite_obj(path, vertices=lambda points: points + np.array([AWAY_M, 0.0, 0.0]))
    return PlantedChange(f"collision meshes of '{at.link}' lie {AWAY_M:g} m away", links=(at.link,))


def collision_missing(folder: Path, at: Target) -> PlantedChange:
    """A collision mesh whose file is not there."""
    path = largest(folder, at.link)
    path.unlink()
    return PlantedChange(f"{path.name} of '{at.link}' is not there", links=(at.link,))


def collision_not_a_number(folder: Path, at: Target) -> PlantedChange:
    """A collision mesh with vertices that are NaN."""
    path = largest(folder, at.link)
    rewrite_obj(path, vertices=lambda points: np.where(np.arange(len(points))[:, None] == 0, np.nan, points))
    return PlantedChange(f"{path.name} of '{at.link}' has a vertex that is nan", links=(at.link,))


def collision_inside_out(folder: Path, at: Target) -> PlantedChange:
    """A link's collision meshes with their faces turned inwards."""
    for path in collision_files(folder, at.link):
        rewrite_obj(path, faces=lambda triangles: triangles[:, ::-1])
    return PlantedChange(f"collision meshes of '{at.link}' are inside out", links=(at.link,))


def collision_with_holes(folder: Path, at: Target) -> PlantedChange:
    """A collision mesh without the faces around one of its corners."""
    path = largest(folder, at.link)
    rewrite_obj(path, faces=lambda triangles: triangles[~(triangles == 1).any(axis=1)])
    return PlantedChange(f"{path.name} of '{at.link}' has holes", links=(at.link,))


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
