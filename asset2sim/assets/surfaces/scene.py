"""A URDF at given joint positions as painted surfaces in the root link's frame."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yourdfpy
from PIL import Image

from asset2sim.assets.authored import REFINED_NAME
from asset2sim.assets.meshes.load import primitive, scale_vector
from asset2sim.assets.surfaces.load import from_mesh, load_surfaces
from asset2sim.assets.surfaces.surface import PLAIN, Floats, Paint, Surface, Texture, posed
from asset2sim.assets.urdf.read import front_of, read_urdf, root_of, tree_joint
from asset2sim.assets.urdf.references import find_mesh
from asset2sim.physics.kinematics import link_to_root, parents_first
from schemas.base import Vector3
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode


@dataclass(frozen=True, eq=False)
class Scene:
    """The surfaces to draw, in the root frame (z up), the link of each, the (3,) unit direction that the object's front
    faces, and the URDF that was read, None where there is none."""

    surfaces: tuple[Surface, ...]
    links: tuple[str, ...]
    front: Floats
    robot: yourdfpy.Robot | None = None


def load_scene(
    urdf_file: Path,
    positions: Mapping[str, float],
    loaded: dict[Path, tuple[Surface, ...]] | None = None,
    front: Vector3 | None = None,
) -> Scene:
    """The asset at these joint positions (radians or metres; joints not named are at zero, mimicking joints follow).
    ``loaded`` remembers files already read, for further positions of the same asset; ``front`` is where it faces, where
    that is known better than by its file (``known_front``).

    Meshes that do not exist or cannot be read are left out. Links are drawn by their visuals, or, where no link of the
    asset has one, by their collision shapes. Raises AssetError: unreadable_asset or invalid_joint_configuration if the
    URDF is refused, missing_mesh if nothing is left to draw.
    """
    robot = read_urdf(urdf_file)
    poses = poses_of(robot, positions)
    loaded = {} if loaded is None else loaded
    surfaces: list[Surface] = []
    names: list[str] = []
    for role in ("visuals", "collisions"):
        for link in robot.links:
            for shape in painted_shapes(robot, link, role, urdf_file.parent, loaded, poses[link.name]):
                surfaces.extend(shape)
                names.extend(link.name for _ in shape)
        if surfaces:
            return Scene(
                tuple(surfaces),
                tuple(names),
                known_front(robot, urdf_file) if front is None else np.array(front),
                robot,
            )
    raise nothing_to_draw(urdf_file)


def known_front(robot: yourdfpy.Robot, urdf_file: Path) -> Floats:
    """(3,) the horizontal direction in the root frame in which an object faces: by the overlay beside a refined one,
    else by the custom of its file."""
    overlay = urdf_file.with_name(REFINED_NAME)
    try:
        stated = json.loads(overlay.read_bytes()).get("front") if overlay.is_file() else None
    except (ValueError, AttributeError):  # another's file of that name
        stated = None
    return front_of(robot, urdf_file) if stated is None else np.array(stated, dtype=float)


def nothing_to_draw(urdf_file: Path) -> AssetError:
    """The missing_mesh error of an asset of which no triangle can be drawn."""
    message = f"{urdf_file.name}: no visual or collision shape of it can be drawn; put its mesh files beside it"
    return AssetError(FailureMode.MISSING_MESH, "nothing_to_draw", message)


def poses_of(robot: yourdfpy.Robot, positions: Mapping[str, float]) -> dict[str, Floats]:
    """Link name → (4, 4) link-to-root transform; mimicking joints follow."""
    values = dict(positions)
    for joint in robot.joints:
        if joint.mimic is not None and joint.name not in positions:
            factor = 1.0 if joint.mimic.multiplier is None else joint.mimic.multiplier
            values[joint.name] = factor * positions.get(joint.mimic.joint, 0.0) + (joint.mimic.offset or 0.0)
    joints = parents_first([tree_joint(joint) for joint in robot.joints])
    return link_to_root(joints, root_of(robot), {name: float(value) for name, value in values.items()})


def painted_shapes(
    robot: yourdfpy.Robot,
    link: yourdfpy.Link,
    role: str,
    folder: Path,
    loaded: dict[Path, tuple[Surface, ...]],
    to_frame: Floats | None = None,
    scale: float = 1.0,
) -> list[list[Surface]]:
    """The surfaces of each shape of a link in a role (``visuals`` or ``collisions``), in the link's frame or moved by
    (4, 4) ``to_frame``, ``scale`` times as large. ``loaded`` remembers files already read."""
    materials = {material.name: material for material in robot.materials}
    found = []
    for shape in getattr(link, role):
        pose = np.eye(4) if shape.origin is None else np.array(shape.origin, dtype=float)
        pose[:3, 3] *= scale
        fallback = shape_paint(getattr(shape, "material", None), materials, folder)
        pieces, factors = pieces_of(shape.geometry, folder, loaded)
        pose = pose if to_frame is None else to_frame @ pose
        found.append([posed(piece, pose, scale * factors, fallback) for piece in pieces])
    return found


def shape_paint(material: yourdfpy.Material | None, materials: Mapping[str, yourdfpy.Material], folder: Path) -> Paint:
    """Colour and texture of a URDF material tag, which may name one that the robot defines; grey where it says nothing.
    A texture shows on surfaces that have texture coordinates; one that is missing or unreadable is left out."""
    if material is None:
        return Paint(PLAIN)
    stated = material if material.color is not None or material.texture is not None else materials.get(material.name)
    if stated is None:
        return Paint(PLAIN)
    texture = None if stated.texture is None else read_texture(str(stated.texture.filename), folder)
    color = PLAIN if texture is None else (1.0, 1.0, 1.0, 1.0)
    if stated.color is not None and stated.color.rgba is not None:
        red, green, blue, alpha = (float(np.clip(v, 0.0, 1.0)) for v in stated.color.rgba)
        color = (red, green, blue, alpha)
    return Paint(color, texture)


def read_texture(reference: str, folder: Path) -> Texture | None:
    """The picture that a URDF refers to; None where it is missing or unreadable."""
    file = find_mesh(reference, folder)
    try:
        return None if file is None else Texture(str(file.resolve()), Image.open(file))
    except (OSError, ValueError, Image.DecompressionBombError):  # what Pillow raises on a bad picture
        return None


def pieces_of(
    geometry: yourdfpy.Geometry, folder: Path, loaded: dict[Path, tuple[Surface, ...]]
) -> tuple[tuple[Surface, ...], Floats]:
    """The surfaces of one geometry in its own frame, and its (3,) scale. ``loaded`` remembers files already read."""
    if geometry.mesh is None:
        mesh = primitive(geometry)
        return (() if mesh is None else (from_mesh(mesh),)), np.ones(3)
    path = find_mesh(geometry.mesh.filename, folder)
    if path is None:
        return (), np.ones(3)
    if path not in loaded:
        loaded[path] = load_surfaces(path)
    return loaded[path], scale_vector(geometry.mesh)
