"""Geometry of a URDF's tree: vectors, poses and the points of shapes, by numpy and the standard library alone."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np


class LoadError(RuntimeError):
    """The folder is no refined object, or holds or was given what cannot be used; says what to do."""


def finite_numbers(what: str, values: Any, counts: tuple[int, ...]) -> list[float]:
    """So many finite numbers. Raises LoadError."""
    try:
        found = np.atleast_1d(np.asarray(values, dtype=float)).ravel().tolist()
    except (TypeError, ValueError):
        found = []
    if len(found) not in counts or not all(map(math.isfinite, found)):
        several = f"{' or '.join(map(str, counts))} finite numbers"
        raise LoadError(f"{what}: {values} is not {'a finite number' if counts == (1,) else several}")
    return found


def link_of_end(element: ET.Element, tag: str) -> str:
    """The link that a joint's ``<parent>`` or ``<child>`` names."""
    found = element.find(tag)
    return "" if found is None else str(found.get("link"))


def vector_of(element: ET.Element | None, key: str, default: str = "0 0 0") -> np.ndarray:
    """(3,) numbers of an attribute."""
    numbers = str((element is not None and element.get(key)) or default).split()
    return np.array([float(number) for number in (numbers * 3)[:3]])


def axis_rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """(3, 3) rotation about an axis, by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def pose_of(element: ET.Element) -> np.ndarray:
    """(4, 4) transform of an element's ``<origin>``."""
    origin, pose, (x, y, z) = element.find("origin"), np.eye(4), np.eye(3)
    roll, pitch, yaw = vector_of(origin, "rpy")
    pose[:3, :3] = axis_rotation(z, yaw) @ axis_rotation(y, pitch) @ axis_rotation(x, roll)
    pose[:3, 3] = vector_of(origin, "xyz")
    return pose


def link_poses(urdf: ET.Element, root: str, positions: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Link → (4, 4) link-to-root transform at these joint positions."""
    poses, waiting = {root: np.eye(4)}, [root]
    for parent in waiting:
        for element in (joint for joint in urdf.findall("joint") if link_of_end(joint, "parent") == parent):
            motion, axis = np.eye(4), vector_of(element.find("axis"), "xyz", "1 0 0")
            position = positions.get(str(element.get("name")), 0.0)
            if element.get("type") == "prismatic":
                motion[:3, 3] = position * axis / np.linalg.norm(axis)
            elif element.get("type") != "fixed":
                motion[:3, :3] = axis_rotation(axis, position)
            poses[link_of_end(element, "child")] = poses[parent] @ pose_of(element) @ motion
            waiting.append(link_of_end(element, "child"))
    return poses


def carried_inertia(urdf: ET.Element, root: str, positions: Mapping[str, float]) -> dict[str, float]:
    """Joint → inertia of all beyond it about its axis, kg·m², or its mass where it slides, kg, the root held."""
    poses, found = link_poses(urdf, root, positions), dict[str, float]()
    joints, inertials = (
        urdf.findall("joint"),
        {str(link.get("name")): link.find("inertial") for link in urdf.iter("link")},
    )
    for joint in (one for one in joints if one.get("type") != "fixed"):
        links, total = [link_of_end(joint, "child")], 0.0
        at = poses[links[0]]
        axis = vector_of(joint.find("axis"), "xyz", "1 0 0")
        along = at[:3, :3] @ axis / np.linalg.norm(axis)
        for link in links:
            links.extend(link_of_end(one, "child") for one in joints if link_of_end(one, "parent") == link)
            inertial = inertials[link]
            if inertial is not None:
                mass, frame = vector_of(inertial.find("mass"), "value", "0")[0], poses[link] @ pose_of(inertial)
                (xx,), (yy,), (zz,), (xy,), (xz,), (yz,) = (
                    vector_of(inertial.find("inertia"), name, "0")[:1]
                    for name in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
                )
                own = frame[:3, :3].T @ along
                spin = own @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ own
                lever = np.cross(along, frame[:3, 3] - at[:3, 3])
                total += float(mass if joint.get("type") == "prismatic" else spin + mass * lever @ lever)
        found[str(joint.get("name"))] = total
    return found


def points_of(link: ET.Element, tag: str, names: tuple[str, ...] = ("",)) -> np.ndarray:
    """(n, 3) points that span a link's shapes of this tag whose name begins so, in the link's frame, m. Raises
    LoadError for a collision mesh that is not there or no OBJ; visual ones are left out."""
    clouds = [np.zeros((0, 3))]
    for item in (one for one in link.findall(tag) if str(one.get("name", "")).lower().startswith(names)):
        pose = pose_of(item)
        for shape in item.findall("geometry/*"):
            clouds.append(shape_points(shape, tag == "collision") @ pose[:3, :3].T + pose[:3, 3])
    return np.vstack(clouds)


def shape_points(shape: ET.Element, needed: bool) -> np.ndarray:
    """(n, 3) points that span a shape of a ``<geometry>``, in its own frame, m; see ``mesh_points``."""
    half = np.array([0.0, 0.0, float(shape.get("length", 0.0)) / 2.0])
    if shape.tag == "mesh":
        vertices: np.ndarray = mesh_points(Path(shape.get("filename", "")), needed) * vector_of(shape, "scale", "1")
        return vertices
    if shape.tag == "box":
        ends = [(-side / 2.0, side / 2.0) for side in vector_of(shape, "size")]
        return np.asarray(np.array(np.meshgrid(*ends)).reshape(3, -1).T)
    # Round: a cylinder along z by its rims, a sphere or capsule by circles about x.
    around = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
    circle = float(shape.get("radius", 0.0)) * np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=1)
    tilts = [axis_rotation(np.eye(3)[0], tilt) for tilt in (around[:1] if shape.tag == "cylinder" else around)]
    return np.vstack([circle @ tilt + side for tilt in tilts for side in (half, -half)])


def mesh_points(file: Path, needed: bool) -> np.ndarray:
    """(n, 3) vertices of an OBJ file, unscaled; none where it is not one that can be read and not ``needed``."""
    lines = file.read_text("utf-8", "replace").splitlines() if file.suffix.lower() == ".obj" and file.is_file() else []
    points = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], dtype=float).reshape(-1, 3)
    if needed and not len(points):
        problem = "is no OBJ; refine the object with --collision repair" if file.is_file() else "is not there"
        raise LoadError(f"collision mesh {file} {problem}")
    return points
